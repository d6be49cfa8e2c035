"""Handwritten letters, made by a model of one writer: a data set that is always at hand, with its truth.

A letter is an action plan of a few strokes (`letter_plans`), executed by the sigma-lognormal model (`sigma_lognormal`): each
stroke is an arc to a virtual target, written with lognormal speed, and strokes overlap in time, so that the pen rounds most
targets and slows down at corners. A stroke as long as the x-height has half its way behind it `STROKE_TIME` after its onset;
longer strokes take little longer, the isochrony principle (Viviani & McCollum, Neuroscience 10, 1983).

Repetitions differ as `WriterVariation` says, in the plan and in its timing: each is an exact sigma-lognormal movement, and its
recording differs from that by white sensor noise alone.
"""

from dataclasses import dataclass, replace

import numpy as np

from probdmp.checks import FloatArray, check_choice, freeze_arrays
from probdmp.demonstrations.demonstration import Demonstration
from probdmp.demonstrations.letter_plans import LETTERS, LetterPlan, letter_plan
from probdmp.demonstrations.sigma_lognormal import Strokes, accelerations, displacements, strokes_between, velocities
from probdmp.demonstrations.synthesis import check_stds, check_synthesis
from probdmp.errors import InputError, InputTypeError

__all__ = ["LETTERS", "WriterVariation", "WrittenLetter", "synthetic_letters", "written_letters"]

X_HEIGHT = 10.0
"""Millimetres."""
SLANT = 7.0
"""Degrees to the right of upright: this writer's hand."""
STROKE_TIME = 0.33
"""Seconds, exp(mu) of a stroke as long as the x-height."""
ISOCHRONY = 0.3
"""Power of its length with which the time of a stroke grows."""
RESPONSE_TIME = 0.25
"""sigma of every stroke."""
OVERLAP = 0.55
"""Of exp(mu): how long after a stroke has half its way behind it the next one has."""
CORNER = 0.95
"""The same around a corner."""
PEN_DOWN = 3.0
"""Standard deviations of logarithmic time: the recording begins and ends when 0.13 % of the first stroke is written, and when
as much is left of the last."""


@dataclass(frozen=True, slots=True)
class WriterVariation:
    """How much one writer's repetitions differ: standard deviations, each >= 0; all zero repeats a letter exactly."""

    shape: float = 0.03
    """Of virtual targets, x-heights per axis; targets close together move together, so corners and retraced stems stay."""
    bend: float = 4.0
    """Of how much each stroke turns, degrees."""
    size: float = 0.05
    """Of the logarithm of the size."""
    aspect: float = 0.04
    """Of the logarithm of width over height."""
    slant: float = 2.5
    """Degrees."""
    position: float = 1.5
    """Of the place on the page, millimetres, per axis."""
    tempo: float = 0.07
    """Of the logarithm of the duration."""
    timing: float = 0.04
    """Of the logarithms of each stroke's own exp(mu), of its sigma, and of the time that passes before it."""
    sensor_noise: float = 0.03
    """White noise of each sample, millimetres, per axis."""

    def __post_init__(self) -> None:
        check_stds(self, shape=0.5, bend=15.0, size=0.5, aspect=0.5, slant=15.0, tempo=0.5, timing=0.5)


@dataclass(frozen=True, slots=True, eq=False)
class WrittenLetter:
    """One repetition of a letter, and the movement behind the recording."""

    demonstration: Demonstration
    """The recording: positions with sensor noise, millimetres."""
    positions: FloatArray
    """(T, 2) array, millimetres: x to the right, y up, without noise."""
    velocities: FloatArray
    """(T, 2) array, millimetres per second."""
    accelerations: FloatArray
    """(T, 2) array, millimetres per second squared."""
    strokes: Strokes
    """The sigma-lognormal parameters of the N strokes; onsets in seconds from the first sample, the first ones before it."""
    targets: FloatArray
    """(N + 1, 2) array, millimetres: where the pen was set down, and the virtual target of each stroke."""

    def __post_init__(self) -> None:
        freeze_arrays(self)


def synthetic_letters(
    n_demonstrations: int = 20,
    seed: int = 0,
    letters: str = LETTERS,
    dt: float = 0.01,
    variation: WriterVariation = WriterVariation(),
) -> list[Demonstration]:
    """Repetitions of handwritten letters, letter after letter; `written_letters` returns them with their truth.

    The writer follows the sigma-lognormal kinematic theory of rapid human movements (R. Plamondon, Biological Cybernetics 72,
    1995; C. O'Reilly & R. Plamondon, Pattern Recognition 42, 2009). A repetition depends on the seed, its letter and its number
    alone, not on what else was asked for.

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
    return [written.demonstration for written in written_letters(n_demonstrations, seed, letters, dt, variation)]


def written_letters(
    n_demonstrations: int = 20,
    seed: int = 0,
    letters: str = LETTERS,
    dt: float = 0.01,
    variation: WriterVariation = WriterVariation(),
) -> list[WrittenLetter]:
    """The same repetitions as `synthetic_letters`, each with its noise-free movement and the parameters of its strokes."""
    n_demonstrations, seed, dt = check_synthesis(n_demonstrations, seed, dt)
    if not isinstance(variation, WriterVariation):
        raise InputTypeError("variation as a WriterVariation", type(variation).__name__)
    return [
        _write(letter, (seed, ord(letter), k), dt, variation)
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


def _write(letter: str, entropy: tuple[int, int, int], dt: float, variation: WriterVariation) -> WrittenLetter:
    """One repetition. Everything is drawn whatever its magnitude, the noise last: changing one leaves the others alone."""
    rng = np.random.default_rng(entropy)
    plan = letter_plan(letter)
    targets = _draw_targets(plan, variation, rng)
    bends = plan.bends + np.radians(variation.bend) * rng.standard_normal(len(plan.bends))
    strokes, duration = _draw_timing(plan, targets, bends, variation, rng)
    times = np.arange(0.0, duration, dt)
    positions = targets[0] + displacements(strokes, times)
    noisy = positions + variation.sensor_noise * rng.standard_normal(positions.shape)
    demonstration = Demonstration(noisy, dt, letter, ("x", "y"), "mm")
    return WrittenLetter(demonstration, positions, velocities(strokes, times), accelerations(strokes, times), strokes, targets)


def _draw_targets(plan: LetterPlan, variation: WriterVariation, rng: np.random.Generator) -> FloatArray:
    """(N + 1, 2) array, millimetres: the virtual targets of one repetition."""
    size, aspect, slant = rng.standard_normal(3) * (variation.size, variation.aspect / 2, np.radians(variation.slant))
    shear = np.array([[1.0, np.tan(np.radians(SLANT) + slant)], [0.0, 1.0]])
    linear = X_HEIGHT * np.exp(size) * shear @ np.diag([np.exp(aspect), np.exp(-aspect)])
    offset = variation.position * rng.standard_normal(2)
    shifts = np.column_stack([_smooth_noise(plan.targets, rng), _smooth_noise(plan.targets, rng)])
    return np.asarray((plan.targets + variation.shape * shifts) @ linear.T + offset)


def _draw_timing(
    plan: LetterPlan, targets: FloatArray, bends: FloatArray, variation: WriterVariation, rng: np.random.Generator
) -> tuple[Strokes, float]:
    """When each stroke is written, and the seconds from pen down, time 0, to pen up."""
    n_strokes = len(bends)
    tempo = np.exp(variation.tempo * rng.standard_normal())
    own_times, spreads, waits = np.exp(variation.timing * rng.standard_normal((3, n_strokes)))
    sigmas = RESPONSE_TIME * spreads
    still = strokes_between(targets, bends, np.zeros(n_strokes), np.zeros(n_strokes), sigmas)
    medians = tempo * STROKE_TIME * (still.amplitudes / X_HEIGHT) ** ISOCHRONY
    apart = np.where(plan.after_corner, CORNER, OVERLAP)[1:] * (medians[:-1] + medians[1:]) / 2
    onsets = np.concatenate([[0.0], np.cumsum(apart * waits[1:])]) - medians
    strokes = strokes_between(targets, bends, onsets, np.log(medians * own_times), sigmas)
    begin, end = strokes.instants(-PEN_DOWN).min(), strokes.instants(PEN_DOWN).max()
    return replace(strokes, onsets=onsets - begin), float(end - begin)


def _smooth_noise(points: FloatArray, rng: np.random.Generator, scale: float = 0.4, n_waves: int = 32) -> FloatArray:
    """(N,) array of zero mean and unit variance at (N, D) points: a random field with squared-exponential correlation.

    Source: Rahimi & Recht, Random features for large-scale kernel machines, NeurIPS 2007, as a sum of random waves.
    """
    frequencies = rng.standard_normal((points.shape[1], n_waves)) / scale
    return np.cos(points @ frequencies + rng.uniform(0, 2 * np.pi, n_waves)).sum(axis=1) * np.sqrt(2 / n_waves)
