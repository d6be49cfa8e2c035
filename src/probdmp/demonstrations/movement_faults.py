"""Movements that go wrong: blocked, slowed, pushed, led elsewhere, or not the movement that was asked for.

A faulty movement is still measured by the same sensor: where holding or interpolating takes the recording's noise away it is
drawn anew at the recording's own level, so that nothing can be detected merely because samples repeat exactly or because
noise sets in. What was missing stays missing, and nothing else becomes so. Sizes are fractions of the range, the largest
extent of this execution along any axis.
"""

from collections.abc import Callable, Sequence

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations.extent import largest_extent
from probdmp.demonstrations.smoothing import noise_stds, sampled_between, without_noise

__all__ = ["drift", "hold", "hold_release", "push", "slow", "wrong_class", "wrong_goal"]

RELEASE = 0.15
"""Fraction of the movement after which a held one is let go."""
PUSH = 0.2
"""Fraction of the movement that a push lasts."""
SLOWED = 0.5
"""Speed of a slowed movement, as a fraction of its own."""


def hold(positions: FloatArray, onset: int, rng: np.random.Generator) -> FloatArray:
    """Blocked from `onset` until the end: the paper's fault.

    Parameters
    ----------
    positions : (T, D) array, data units.
    onset : first sample at which the movement no longer advances, 1 to T - 1.

    Returns
    -------
    (T, D) array: as recorded before the onset, the last position measured, with sensor noise, from then on.
    """
    return np.concatenate([positions[:onset], _held(positions, onset, len(positions) - onset, rng)])


def hold_release(positions: FloatArray, onset: int, rng: np.random.Generator) -> FloatArray:
    """Blocked from `onset` for 15 % of the movement, then continued from there: as many samples longer.

    Parameters
    ----------
    positions : (T, D) array, data units.

    Returns
    -------
    (T + max(1, round(0.15 T)), D) array.
    """
    held = _held(positions, onset, max(1, round(RELEASE * len(positions))), rng)
    return np.concatenate([positions[:onset], held, positions[onset:]])


def slow(positions: FloatArray, onset: int, rng: np.random.Generator) -> FloatArray:
    """Half as fast from `onset` on, up to the same end.

    Parameters
    ----------
    positions : (T, D) array, data units.

    Returns
    -------
    (onset + 2 (T - onset), D) array: the path behind the recording, twice as densely sampled, with new noise. A sample is
    missing where the recorded one nearest to it is.
    """
    last = len(positions) - 1
    instants = onset - 1 + SLOWED * np.arange(1.0, round((len(positions) - onset) / SLOWED) + 1)
    slowed = sampled_between(without_noise(positions), instants)
    slowed += rng.standard_normal(slowed.shape) * noise_stds(positions)
    slowed[np.isnan(positions[np.minimum(np.round(instants).astype(int), last)])] = np.nan
    return np.concatenate([positions[:onset], slowed])


def push(positions: FloatArray, onset: int, rng: np.random.Generator, size: float) -> FloatArray:
    """Pushed aside and back: a raised cosine over 20 % of the movement, in a random direction of space.

    Parameters
    ----------
    positions : (T, D) array, data units.
    size : largest displacement, as a fraction of the range.

    Returns
    -------
    (T, D) array.
    """
    lasts = max(2, round(PUSH * len(positions)))
    return _displaced(
        positions, onset, rng, size, lambda k, n: np.where(k < lasts, 0.5 * (1 - np.cos(2 * np.pi * k / lasts)), 0.0)
    )


def drift(positions: FloatArray, onset: int, rng: np.random.Generator, size: float) -> FloatArray:
    """Led astray ever further, linearly from `onset` to `size` times the range at the end, in a random direction.

    Parameters
    ----------
    positions : (T, D) array, data units.
    size : displacement of the last sample, as a fraction of the range.

    Returns
    -------
    (T, D) array.
    """
    return _displaced(positions, onset, rng, size, lambda k, n: k / n)


def wrong_goal(positions: FloatArray, onset: int, rng: np.random.Generator, size: float) -> FloatArray:
    """Led to another goal, smoothly from `onset` to the end (minimum jerk), in a random direction.

    Source of the profile: Flash & Hogan, Journal of Neuroscience 5 (1985), 10 s^3 - 15 s^4 + 6 s^5.

    Parameters
    ----------
    positions : (T, D) array, data units.
    size : distance of the new goal from the old one, as a fraction of the range.

    Returns
    -------
    (T, D) array.
    """
    return _displaced(positions, onset, rng, size, lambda k, n: (k / n) ** 3 * (10 - 15 * (k / n) + 6 * (k / n) ** 2))


def wrong_class(positions: FloatArray, onset: int, rng: np.random.Generator, others: Sequence[FloatArray]) -> FloatArray:
    """Another movement, from the commanded start on.

    Parameters
    ----------
    positions : (T, D) array, data units: the execution that was asked for.
    onset : without meaning; the movement is another one from its first sample.
    others : executions of other movements, (T', D) arrays at the same rate; one is drawn.

    Returns
    -------
    (T', D) array: that one, moved so that both have the same first measured position.
    """
    other = others[int(rng.integers(len(others)))]
    return other + np.nan_to_num(_first_measured(positions) - _first_measured(other))


def _held(positions: FloatArray, onset: int, n_samples: int, rng: np.random.Generator) -> FloatArray:
    noise = rng.standard_normal((n_samples, positions.shape[1])) * noise_stds(positions)
    return noise + _first_measured(positions[onset - 1 :: -1])


def _first_measured(positions: FloatArray) -> FloatArray:
    """(D,) array; NaN for what is never measured."""
    return np.array([column[np.argmin(np.isnan(column))] for column in positions.T])


def _displaced(
    positions: FloatArray,
    onset: int,
    rng: np.random.Generator,
    size: float,
    profile: Callable[[FloatArray, int], FloatArray],
) -> FloatArray:
    """Shift by `profile` of 1, 2, … at the samples from the onset on, and of their number, times `size` of the range."""
    direction = rng.standard_normal(positions.shape[1])
    distance = size * largest_extent(positions)
    n = len(positions) - onset
    displaced = np.array(positions)
    displaced[onset:] += profile(np.arange(1.0, n + 1), n)[:, None] * (distance * direction / np.linalg.norm(direction))
    return displaced
