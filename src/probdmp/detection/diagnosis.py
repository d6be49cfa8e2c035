"""Why an execution was called failed: where it goes, or when it gets there.

What has not moved lately is held. Otherwise explanations compete, each with an onset o some ticks ago:

    pace     the movement as taught, but since o at speed r for w ticks: tick u of the execution is phase phi(u) of it,
             phi(u) = u until o, then o + r (u - o), and after w ticks on again as before, but late or early
    aside    the movement on time, but since o pushed aside: y(u) = path(u) + b g(u - o), b ~ N(0, ASIDE_STD^2 I), g rising
             to 1 for good, or for a while

Under each the execution is a draw from a Gaussian over paths. The explanation with the largest density wins; a pace also has to
explain what came after its onset about as well as ordinary executions are explained.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.evidence import DEGREES_OF_FREEDOM
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.point_densities import densities_of_points

__all__ = ["LOOKED_AT", "Diagnosis", "diagnose"]

REST_TICKS = (4, 8)
"""Ticks without movement that make a standstill: at the alarm, and once there was time to see."""
REST_EXTENT = 0.004
"""Root mean square by which what is held still moves, as a fraction of the range, besides 1.5 times the noise."""
LEAST_DUE = 0.03
"""What rests is held if it should have moved at least so far, as a fraction of the range."""
LOOKED_AT = np.array([84, 74, 64, 54, 46, 38, 31, 25, 20, 16, 12, 8, 5, 2, 0])
"""Ticks before now at which an execution is compared with its path."""
ONSETS = np.array([4, 8, 12, 16, 21, 27, 34, 42, 52, 64])
"""Ticks before now at which the pace may have changed."""
SPEEDS = np.array([0.25, 0.5, 0.75, 1.33, 2.0])
PAUSES = np.array([5, 10, 15, 20])
"""Ticks that a movement may have been held before it went on."""
RISES = np.array([6, 20, 50])
"""Ticks in which a movement may be pushed aside."""
WIDTHS = np.array([10, 20, 35])
"""Ticks in which it may be pushed aside and come back."""
ASIDE_STD = 0.3
"""How far it may be, as a fraction of the range."""
FOLLOWS = 5.0
"""Squared deviation per number, relative to the sloppiness before, up to which what came later follows from the rest."""
CLEARLY = 6.0
"""Nats by which an uneven pace has to be likelier than an even one."""


class Diagnosis(NamedTuple):
    """What happened."""

    kind: str
    """One of `probdmp.detection.verdict.KINDS`."""
    cause: str


def diagnose(
    model: PathModel, means: FloatArray, recent: FloatArray, ticks: IntArray, noise_stds: FloatArray, seen_since: IntArray
) -> list[Diagnosis]:
    """Motion or timing, and what in particular, of n executions.

    Parameters
    ----------
    means : (n, M, D) array, mean path of each execution.
    recent : (n, L, D) array: displacements at the last ticks, the latest last; NaN where nothing was seen, or before the start.
    ticks : (n,) array: of the latest, since the start.
    noise_stds : (D,) array, noise of the sensor as a fraction of the range.
    seen_since : (n,) array: ticks since the alarm.
    """
    n_rest = np.minimum(REST_TICKS[0] + seen_since, REST_TICKS[1])
    held = _are_held(means, recent, ticks, REST_EXTENT + 1.5 * noise_stds, n_rest)
    found = [Diagnosis("timing", "held")] * len(ticks)
    back = LOOKED_AT[recent.shape[1] > LOOKED_AT]
    points = recent[:, -1 - back]
    points[np.isnan(points).any(axis=2)] = np.nan
    longest = np.max(np.where(np.isnan(points[..., 0]), 0, back), axis=1, initial=0)
    for length in np.unique(longest[~held]).tolist():
        some = np.flatnonzero(~held & (longest == length))
        causes = _explained(model, means[some], points[some][:, back <= length], ticks[some], _explanations(length))
        for k, cause in zip(some.tolist(), causes, strict=True):
            found[k] = cause
    return found


def _explained(
    model: PathModel, means: FloatArray, points: FloatArray, ticks: IntArray, explanations: "_Explanations"
) -> list[Diagnosis]:
    """What happened to n executions that are not held, by the points (n, P, D) that explanations are about."""
    executions = np.arange(len(ticks))
    phases = np.rint((ticks[:, None] - explanations.back)[:, None] - explanations.lost).astype(np.int64)
    phases = np.minimum(np.maximum(phases, 0), TICKS)
    residuals = points[:, None] - means[executions[:, None, None], phases]
    (n, n_explanations, n_points, dof), aside = residuals.shape, np.broadcast_to(explanations.aside, phases.shape)
    density, squares = densities_of_points(
        model.covariance[None],
        model.noise_variances[None],
        phases.reshape(1, -1, n_points),
        aside.reshape(1, -1, n_points),
        residuals.reshape(1, -1, n_points, dof),
    )
    density = density.reshape(n, n_explanations)
    best = np.argmax(density, axis=1)
    follows = _follow(squares.reshape(residuals.shape)[executions, best], points, explanations.later[best])
    certain = (density[executions, best] >= density[:, 0] + CLEARLY) & (follows <= FOLLOWS)
    return [
        _pace(speed) if is_certain and speed != 1 else Diagnosis("motion", "off the path")
        for is_certain, speed in zip(certain.tolist(), explanations.speeds[best].tolist(), strict=True)
    ]


def _pace(speed: float) -> Diagnosis:
    return Diagnosis("timing", "paused" if speed == 0 else "slow" if speed < 1 else "fast")


def _follow(squares: FloatArray, points: FloatArray, later: NDArray[np.bool_]) -> FloatArray:
    """(n,) array: squared deviation per number after the onset, (n, P) says which those are, relative to that before."""
    seen = ~np.isnan(points)
    after, n_after = (np.where(later[..., None], x, 0).sum(axis=(1, 2)) for x in (squares, seen))
    before, n_before = squares.sum(axis=(1, 2)) - after, seen.sum(axis=(1, 2)) - n_after
    return after / np.maximum(n_after, 1) / ((DEGREES_OF_FREEDOM + before) / (DEGREES_OF_FREEDOM + n_before))


def _are_held(
    means: FloatArray, recent: FloatArray, ticks: IntArray, extents: FloatArray, n_rest: IntArray
) -> NDArray[np.bool_]:
    """(n,) array: whether executions have not moved for some ticks, while they should have.

    Parameters
    ----------
    extents : (D,) array, root mean square by which what is at rest still seems to move.
    n_rest : (n,) array: ticks that count.
    """
    latest = recent[:, -max(REST_TICKS) :]
    is_latest = np.arange(-latest.shape[1], 0) >= -n_rest[:, None]
    counted = is_latest & ~np.isnan(latest).any(axis=2)
    counts = np.maximum(counted.sum(axis=1), 1)[:, None]
    places = np.where(counted[..., None], latest, 0.0).sum(axis=1) / counts
    away = np.where(counted[..., None], latest - places[:, None], 0.0)
    held = (counted.sum(axis=1) >= REST_TICKS[0]) & np.all(np.sqrt(np.sum(away**2, axis=1) / counts) <= extents, axis=1)
    some, n_ticks = np.flatnonzero(held), recent.shape[1]
    moved = np.any(np.abs(recent[some] - places[some, None]) > 3 * extents, axis=2)[:, ::-1]
    since = np.where(moved.any(axis=1), np.argmax(moved, axis=1), np.minimum(ticks[some] + 1, n_ticks))
    due = means[some, np.minimum(ticks[some], TICKS)] - means[some, np.clip(ticks[some] - since, 0, TICKS)]
    held[some] = np.any(np.abs(due) > np.maximum(5 * extents, LEAST_DUE), axis=1)
    return held


class _Explanations(NamedTuple):
    """E of them for P points; the first is that nothing happened. Read-only."""

    back: IntArray
    """(P,) array: ticks before now at which an execution is compared with its path."""
    speeds: FloatArray
    """(E,) array: 1 but for a pace."""
    later: NDArray[np.bool_]
    """(E, P) array: whether a point comes after the onset."""
    lost: FloatArray
    """(E, P) array: u - phi(u), ticks."""
    aside: FloatArray
    """(E, P) array: g, fractions of the range."""


@lru_cache(maxsize=len(LOOKED_AT))
def _explanations(longest: int) -> _Explanations:
    """Of what happened in the last ticks, so many at the most."""
    onsets = [onset for onset in ONSETS if onset < longest]
    nothing = [(0, 1.0, 0, np.inf, 0)]
    paces = [(o, r, 10 * TICKS, np.inf, 0) for o in onsets for r in SPEEDS]
    pauses = [(o, 0.0, w, np.inf, 0) for o in onsets for w in PAUSES if w < o]
    aside = [(o, 1.0, 0, rise, 0) for o in onsets for rise in RISES]
    pushes = [(o, 1.0, 0, np.inf, width) for o in onsets for width in WIDTHS]
    onset, speed, length, rise, width = np.array(nothing + paces + pauses + aside + pushes).T[..., None]
    back = LOOKED_AT[longest >= LOOKED_AT]
    since = np.maximum(onset - back, 0)
    bumps = np.where(since < width, np.sin(np.pi * since / np.maximum(width, 1)) ** 2, 0.0)
    lost = (1 - speed) * np.minimum(since, length)
    found = _Explanations(back, speed[:, 0], since > 0, lost, ASIDE_STD * (np.minimum(since / rise, 1.0) + bumps))
    for array in found:
        array.flags.writeable = False
    return found
