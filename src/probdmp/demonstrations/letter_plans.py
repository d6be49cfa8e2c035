"""The action plans of 22 handwritten letters: where one writer's strokes aim, how they bend, and where the pen turns."""

from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray

__all__ = ["LETTERS", "LetterPlan", "letter_plan"]

PLANS = {
    "a": "82,86   -2,47,+130  78,40,+190  86,100,+10 / 86,8,0  114,16,+120",
    "b": "0,205   0,0,0 / 4,68,-8  82,54,-165  2,8,-150",
    "c": "80,84   -2,49,+130  84,15,+165",
    "d": "82,86   -2,47,+130  78,40,+190  88,205,+10 / 86,8,0  115,16,+120",
    "e": "2,46    84,64,+50  -2,48,+170  86,14,+165",
    "f": "86,180  32,154,+150  28,-2,0 / -8,90,+70 / 78,94,0",
    "g": "82,86   -2,47,+130  78,40,+190  86,100,+10 / 84,-55,0  -6,-80,-150",
    "h": "0,205   0,-2,0 / 6,68,-6  78,66,-160  78,8,0  107,16,+120",
    "k": "0,205   0,-2,0 / 4,42,0  68,100,-20 / 12,52,-12 / 80,-2,+20",
    "l": "0,205   2,14,0  35,18,+130",
    "m": "0,102   0,-2,0 / 4,68,-6  62,68,-165  64,-2,0 / 68,68,-6  126,68,-165  126,8,0  154,16,+120",
    "n": "0,102   0,-2,0 / 4,68,-6  78,66,-165  78,8,0  107,16,+120",
    "o": "46,102  0,49,+110  86,49,+180  40,103,+120",
    "p": "0,102   0,-105,0 / 4,66,-3  84,56,-165  4,6,-150",
    "q": "82,86   -2,47,+130  78,40,+190  86,100,+10 / 84,-108,0 / 114,-76,+10",
    "r": "0,102   0,-2,0 / 4,66,-6  66,90,-120",
    "s": "76,86   8,76,+140  72,26,-15  -4,13,-140",
    "u": "0,102   2,32,0  76,34,+170  84,100,0 / 84,8,0  112,16,+120",
    "v": "0,102   36,-2,+4 / 74,102,+8",
    "w": "0,102   26,-2,+8 / 52,90,+6 / 78,-2,+8 / 106,102,+10",
    "y": "0,102   2,32,0  76,34,+170  82,100,0 / 80,-55,0  -10,-80,-150",
    "z": "0,97    80,99,-8 / 0,0,0 / 84,0,+8",
}
"""By letter: x,y where the pen is set down, then x,y,bend stroke by stroke: the virtual target, hundredths of the x-height with
the baseline at y = 0, and by how many degrees the stroke turns on its way there, counterclockwise. A stroke begins while the
one before is under way, and the pen rounds the target between them. After a slash it waits, and the pen all but stops there."""

LETTERS = "".join(PLANS)
"""The letters that one stroke of the pen can write."""


class LetterPlan(NamedTuple):
    """The N strokes of a letter, before anybody's hand has varied them."""

    targets: FloatArray
    """(N + 1, 2) array, x-heights: where the pen is set down, and where each stroke aims."""
    bends: FloatArray
    """(N,) array, radians, counterclockwise: theta_e - theta_s."""
    after_corner: FloatArray
    """(N,) array: 1 for a stroke that waits until the one before is nearly over, else 0."""


def letter_plan(letter: str) -> LetterPlan:
    """The action plan of one of `LETTERS`."""
    start, *words = PLANS[letter].split()
    strokes = [word.split(",") for word in words if word != "/"]
    corners = [before == "/" for before, word in zip([start, *words], words, strict=False) if word != "/"]
    numbers = np.array(strokes, dtype=np.float64)
    targets = np.vstack([np.array(start.split(","), dtype=np.float64), numbers[:, :2]]) / 100
    return LetterPlan(targets, np.radians(numbers[:, 2]), np.array(corners, dtype=np.float64))
