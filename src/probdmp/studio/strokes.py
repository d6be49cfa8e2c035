"""Strokes of a pen as demonstrations, and the built-in examples placed on the canvas."""

from dataclasses import replace

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import (
    LETTERS,
    Demonstration,
    demonstration_from_times,
    placement_within,
    synthetic_letters,
)
from probdmp.errors import InputError
from probdmp.studio.limits import CANVAS, DT, LONGEST_STROKE
from probdmp.studio.settings import PRESSURE

__all__ = ["EXAMPLES", "N_EXAMPLES", "example_strokes", "stroke_of"]

EXAMPLES = tuple(LETTERS)
N_EXAMPLES = 10
"""Demonstrations of an example."""


def stroke_of(points: FloatArray, label: str) -> Demonstration:
    """A stroke at the rate of the studio.

    Parameters
    ----------
    points : (n, 4) array: seconds, x, y, pressure; NaN where there is no pressure. Kept only where all of it was felt.
    """
    if not points[-1, 0] - points[0, 0] <= LONGEST_STROKE:
        raise InputError(f"a stroke of at most {LONGEST_STROKE:g} s", f"{points[-1, 0] - points[0, 0]:g} s")
    feels = not np.isnan(points[:, 3]).any()
    names = ("x", "y", PRESSURE)[: 3 if feels else 2]
    drawn = demonstration_from_times(points[:, 0], points[:, 1 : 1 + len(names)], DT, label, names)
    channels = {PRESSURE: drawn.positions[:, 2]} if feels else {}
    return replace(drawn, positions=drawn.positions[:, :2], names=("x", "y"), channels=channels)


def example_strokes(letter: str) -> list[Demonstration]:
    """Ten demonstrations of a built-in letter, as large as fits the canvas well."""
    written = synthetic_letters(N_EXAMPLES, letters=letter, dt=DT)
    placement = placement_within(written, CANVAS)
    return [replace(placement.placed(d), units="") for d in written]
