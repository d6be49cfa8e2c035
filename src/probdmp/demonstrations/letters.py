"""Handwritten letters, made by a model of one writer: a data set that is always at hand.

Each letter is one pen stroke, a uniform cubic B-spline of its control points q[0], …, q[N-1], the ends thrice:

    p(u) = sum_i B3(u - i) q[i],   u = 0 … N + 1

Every span takes the same time, so the pen slows where points crowd, which is in tight turns, as the two-thirds power law
has it (Lacquaniti, Terzuolo & Viviani, Acta Psychologica 54, 1983). The curve stays within the hull of its points: no
overshoot. A point named thrice is a corner, passed at rest.

The curve leaves and reaches the ends at rest and is twice continuously differentiable in time.
"""

from dataclasses import dataclass, fields

import numpy as np

from probdmp.checks import MILLISECONDS_HINT, FloatArray, check_array, check_choice, check_count, check_seconds
from probdmp.demonstrations.demonstration import Demonstration
from probdmp.errors import InputError, InputTypeError

__all__ = ["LETTERS", "WriterVariation", "synthetic_letters"]

CONTROL_POINTS = {
    "a": "82,84 62,108 22,108 -4,75 -4,25 20,-10 55,-2 80,40 86,98 86,98 86,40 88,0 100,-8 118,14",
    "b": "0,200 0,140 0,60 0,-5 0,-5 2,60 22,108 62,112 90,70 90,25 62,-10 25,-8 0,20",
    "c": "82,82 62,108 22,108 -4,75 -4,25 20,-10 60,-10 86,18",
    "d": "82,84 62,108 22,108 -4,75 -4,25 20,-10 55,-2 80,40 86,120 86,200 86,200 86,120 86,40 88,0 100,-8 118,14",
    "e": "5,46 45,50 90,60 85,105 45,115 0,95 -6,40 15,-10 60,-12 90,20",
    "f": "88,178 68,208 36,205 32,150 32,60 32,-5 32,-5 32,50 10,90 -5,95 -5,95 30,95 80,95",
    "g": "82,84 62,108 22,108 -4,75 -4,25 20,-10 55,-2 80,40 86,98 86,98 86,20 86,-60 60,-112 20,-108 -4,-78",
    "h": "0,200 0,140 0,60 0,-5 0,-5 2,60 22,108 62,112 82,75 82,20 86,-8 100,-8 116,14",
    "k": "0,200 0,140 0,60 0,-5 0,-5 2,30 20,55 65,100 65,100 65,100 12,50 12,50 12,50 40,20 80,0",
    "l": "0,200 0,140 0,40 6,-8 30,-12 50,15",
    "m": "0,100 0,50 0,-5 0,-5 2,60 18,108 50,112 64,70 64,-5 64,-5 66,60 82,108 114,112 128,75 128,20 132,-8 146,-8 160,14",
    "n": "0,100 0,50 0,-5 0,-5 2,60 22,108 62,112 82,75 82,20 86,-8 100,-8 116,14",
    "o": "55,100 22,108 -4,75 -4,25 20,-10 66,-10 92,25 92,75 66,108 40,100",
    "p": "0,100 0,20 0,-60 0,-105 0,-105 0,-30 2,60 22,108 62,112 90,70 90,25 62,-10 25,-8 0,20",
    "q": "82,84 62,108 22,108 -4,75 -4,25 20,-10 55,-2 80,40 86,98 86,98 86,20 86,-60 86,-105 86,-105 116,-75",
    "r": "0,100 0,50 0,-5 0,-5 2,60 22,105 52,112 68,90",
    "s": "75,85 60,108 20,110 0,85 10,58 60,45 80,20 62,-10 15,-12 -2,15",
    "u": "0,100 0,50 5,-5 40,-15 75,25 82,100 82,100 82,40 84,0 96,-8 114,14",
    "v": "0,100 20,50 36,0 36,0 52,50 72,100",
    "w": "0,100 15,50 28,0 28,0 50,85 50,85 72,0 72,0 85,50 100,100",
    "y": "0,100 0,50 5,-5 40,-15 75,25 82,100 82,100 82,20 82,-60 58,-112 18,-108 -8,-78",
    "z": "0,98 40,98 78,98 78,98 78,98 40,50 0,0 0,0 0,0 40,0 82,0",
}
"""x,y of each letter's control points, hundredths of the x-height, in the order of writing; y = 0 is the baseline."""

LETTERS = "".join(CONTROL_POINTS)
"""The letters that one stroke can write."""

X_HEIGHT = 10.0
"""Millimetres."""
PACE = 0.6
"""Seconds for a stroke as long as the x-height; the duration grows with the root of the length, the isochrony principle
(Viviani & McCollum, Neuroscience 10, 1983)."""
SAMPLING_INTERVALS = (1e-4, 0.1)
"""Seconds, shortest and longest dt."""


@dataclass(frozen=True, slots=True)
class WriterVariation:
    """How much one writer's repetitions differ: standard deviations, each >= 0; all zero repeats a letter exactly."""

    shape: float = 0.03
    """Of control points, x-heights; points close together move together, so corners and retraced stems stay."""
    size: float = 0.05
    """Of the logarithm of the size."""
    aspect: float = 0.04
    """Of the logarithm of width over height."""
    slant: float = 3.0
    """Degrees."""
    position: float = 2.0
    """Of the place on the page, millimetres, per axis."""
    tempo: float = 0.07
    """Of the logarithm of the duration."""
    timing: float = 0.02
    """Of the moment at which a part of the letter is written, fractions of the duration."""
    sensor_noise: float = 0.03
    """White noise of each sample, millimetres, per axis."""

    def __post_init__(self) -> None:
        for name in (field.name for field in fields(self)):
            value = float(check_array(getattr(self, name), name, ()))
            if value < 0:
                raise InputError(f"{name} >= 0, a standard deviation", repr(value))
            object.__setattr__(self, name, value)


def synthetic_letters(
    n_demonstrations: int = 20,
    seed: int = 0,
    letters: str = LETTERS,
    dt: float = 0.01,
    variation: WriterVariation = WriterVariation(),
) -> list[Demonstration]:
    """Repetitions of handwritten letters, letter after letter.

    A repetition depends on the seed, its letter and its number alone, not on what else was asked for.

    Parameters
    ----------
    n_demonstrations : repetitions of each letter.
    seed : the writer's mood; the same seed gives the same data.
    letters : different ones out of `LETTERS`, such as "abc".
    dt : seconds between samples.

    Returns
    -------
    n_demonstrations for each letter, labelled with it: x to the right and y up, millimetres.

    Raises
    ------
    InputError, InputTypeError
        If there are no letters, a letter is unknown or named twice, or a number is out of range.
    """
    n_demonstrations = check_count(n_demonstrations, "n_demonstrations")
    seed = check_count(seed, "seed", least=0)
    dt = check_seconds(dt, "dt")
    shortest, longest = SAMPLING_INTERVALS
    if not shortest <= dt <= longest:
        raise InputError(f"dt from {shortest:g} to {longest:g} seconds", repr(dt), MILLISECONDS_HINT)
    if not isinstance(variation, WriterVariation):
        raise InputTypeError("variation as a WriterVariation", type(variation).__name__)
    return [
        Demonstration(_write(letter, (seed, ord(letter), k), dt, variation), dt, letter, ("x", "y"), "mm")
        for letter in _check_letters(letters)
        for k in range(n_demonstrations)
    ]


def _check_letters(letters: str) -> str:
    if not isinstance(letters, str):
        raise InputTypeError("letters as one string", repr(letters), 'Join them: letters="abc".')
    if not letters or len(set(letters)) < len(letters):
        raise InputError("letters as different letters, at least one", repr(letters))
    for letter in letters:
        check_choice(letter, "each of letters", LETTERS)
    return letters


def _write(letter: str, entropy: tuple[int, int, int], dt: float, variation: WriterVariation) -> FloatArray:
    """(T, 2) array, millimetres: one repetition.

    Everything is drawn whatever its magnitude, the noise last: changing one magnitude leaves the other draws alone.
    """
    rng = np.random.default_rng(entropy)
    points = np.array([pair.split(",") for pair in CONTROL_POINTS[letter].split()], dtype=np.float64) / 100
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    duration = PACE * np.sqrt(length) * np.exp(variation.tempo * rng.standard_normal())
    linear = _distortion(variation, rng)
    offset = variation.position * rng.standard_normal(2)
    shifts = np.column_stack([_smooth_noise(points, rng), _smooth_noise(points, rng)])
    phases = np.arange(0.0, duration, dt) / duration
    phases += variation.timing * np.sin(np.pi * phases) * _smooth_noise(phases[:, None], rng)
    path = _spline(points + variation.shape * shifts, phases) @ linear.T + offset
    return path + variation.sensor_noise * rng.standard_normal(path.shape)


def _distortion(variation: WriterVariation, rng: np.random.Generator) -> FloatArray:
    """(2, 2) matrix from x-heights to millimetres: size, aspect and slant."""
    size, aspect, slant = rng.standard_normal(3) * (variation.size, variation.aspect / 2, np.radians(variation.slant))
    shear = np.array([[1.0, np.tan(slant)], [0.0, 1.0]])
    return X_HEIGHT * np.exp(size) * shear @ np.diag([np.exp(aspect), np.exp(-aspect)])


def _smooth_noise(points: FloatArray, rng: np.random.Generator, scale: float = 0.4, n_waves: int = 32) -> FloatArray:
    """(N,) array of zero mean and unit variance at (N, D) points: a random field with squared-exponential correlation.

    Source: Rahimi & Recht, Random features for large-scale kernel machines, NeurIPS 2007, as a sum of random waves.
    """
    frequencies = rng.standard_normal((points.shape[1], n_waves)) / scale
    return np.cos(points @ frequencies + rng.uniform(0, 2 * np.pi, n_waves)).sum(axis=1) * np.sqrt(2 / n_waves)


def _spline(points: FloatArray, phases: FloatArray) -> FloatArray:
    """(T, 2) array: the uniform cubic B-spline of (N, 2) control points at phases in [0, 1]."""
    from scipy.interpolate import BSpline

    coefficients = np.pad(points, ((2, 2), (0, 0)), mode="edge")
    n_spans = len(coefficients) - 3
    knots = np.arange(-3.0, n_spans + 4)
    return np.asarray(BSpline(knots, coefficients, 3)(np.clip(phases, 0, 1) * n_spans))
