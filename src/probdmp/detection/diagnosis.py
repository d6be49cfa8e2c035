"""Why an execution was called failed: where it goes, or when it gets there.

What has not moved lately is held. Otherwise explanations compete, each with an onset o some ticks ago:

    pace     the movement as taught, but since o at speed r for w ticks: tick u of the execution is phase phi(u) of it,
             phi(u) = u until o, then o + r (u - o), and after w ticks on again as before, but late or early
    aside    the movement on time, but since o pushed aside: y(u) = path(u) + b g(u - o), b ~ N(0, ASIDE_STD^2 I), g rising
             to 1 for good, or for a while

Under each the execution is a draw from a Gaussian over paths. The explanation with the largest density wins; a pace also has to
explain what came after its onset about as well as ordinary executions are explained.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.evidence import DEGREES_OF_FREEDOM
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.windows import whitened

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
    return [
        Diagnosis("timing", "held") if is_held else _explained(model, mean, path, int(tick))
        for is_held, mean, path, tick in zip(held.tolist(), means, recent, ticks, strict=True)
    ]


def _explained(model: PathModel, means: FloatArray, recent: FloatArray, tick: int) -> Diagnosis:
    """What happened to one execution that is not held."""
    back = LOOKED_AT[len(recent) > LOOKED_AT]
    back = back[~np.isnan(recent[-1 - back]).any(axis=1)]
    explanations = _explanations(int(back.max()) if len(back) else 0)
    if len(explanations.onsets) < 2:
        return Diagnosis("motion", "off the path")
    density, follows = _fit(model, means, recent[-1 - back], tick - back, tick, explanations)
    best, speed = int(np.argmax(density)), float(explanations.speeds[np.argmax(density)])
    if speed == 1 or density[best] < density[0] + CLEARLY or follows[best] > FOLLOWS:
        return Diagnosis("motion", "off the path")
    if speed == 0:
        return Diagnosis("timing", "paused")
    return Diagnosis("timing", "slow" if speed < 1 else "fast")


def _are_held(
    means: FloatArray, recent: FloatArray, ticks: IntArray, extents: FloatArray, n_rest: IntArray
) -> NDArray[np.bool_]:
    """(n,) array: whether executions have not moved for some ticks, while they should have.

    Parameters
    ----------
    extents : (D,) array, root mean square by which what is at rest still seems to move.
    n_rest : (n,) array: ticks that count.
    """
    n_ticks, executions = recent.shape[1], np.arange(len(recent))
    is_latest = np.arange(n_ticks) >= n_ticks - n_rest[:, None]
    counted = is_latest & ~np.isnan(recent).any(axis=2)
    latest, counts = np.where(counted[..., None], recent, 0.0), np.maximum(counted.sum(axis=1), 1)[:, None]
    places = latest.sum(axis=1) / counts
    away = recent - places[:, None]
    spread = np.sqrt(np.sum(np.where(counted[..., None], away, 0.0) ** 2, axis=1) / counts)
    at_rest = (counted.sum(axis=1) >= REST_TICKS[0]) & np.all(spread <= extents, axis=1)
    moved = np.any(np.abs(away) > 3 * extents, axis=2)[:, ::-1]
    since = np.where(moved.any(axis=1), np.argmax(moved, axis=1), np.minimum(ticks + 1, n_ticks))
    due = means[executions, np.minimum(ticks, TICKS)] - means[executions, np.clip(ticks - since, 0, TICKS)]
    return np.asarray(at_rest & np.any(np.abs(due) > np.maximum(5 * extents, LEAST_DUE), axis=1))


class _Explanations(NamedTuple):
    """(E,) arrays, one entry for each; the first is that nothing happened."""

    onsets: FloatArray
    """Ticks before now."""
    speeds: FloatArray
    lengths: FloatArray
    """Ticks at that speed."""
    rises: FloatArray
    """Ticks in which the movement is pushed aside for good; infinite if it is not."""
    widths: FloatArray
    """Ticks in which it is pushed aside and comes back; 0 if it is not."""


def _explanations(longest: int) -> _Explanations:
    onsets = [onset for onset in ONSETS if onset < longest]
    nothing = [(0, 1.0, 0, np.inf, 0)]
    paces = [(o, r, 10 * TICKS, np.inf, 0) for o in onsets for r in SPEEDS]
    pauses = [(o, 0.0, w, np.inf, 0) for o in onsets for w in PAUSES if w < o]
    aside = [(o, 1.0, 0, rise, 0) for o in onsets for rise in RISES]
    pushes = [(o, 1.0, 0, np.inf, width) for o in onsets for width in WIDTHS]
    return _Explanations(*np.array(nothing + paces + pauses + aside + pushes).T)


def _fit(
    model: PathModel, means: FloatArray, path: FloatArray, ticks: FloatArray, now: int, explanations: _Explanations
) -> tuple[FloatArray, FloatArray]:
    """How well each explanation fits a path (P, D) at its ticks (P,).

    Returns
    -------
    Log-density of a multivariate t but for a constant; squared deviation per number after the onset, relative to that before.
    (E,) arrays.
    """
    (points, dof), count = path.shape, len(explanations.onsets)
    since = np.maximum(ticks - (now - explanations.onsets[:, None]), 0)  # ticks since the onset, (E, P)
    lost = (1 - explanations.speeds[:, None]) * np.minimum(since, explanations.lengths[:, None])
    phases = np.clip(np.rint(ticks - lost).astype(int), 0, TICKS)
    widths = explanations.widths[:, None]
    bumps = np.where(since < widths, np.sin(np.pi * since / np.maximum(widths, 1)) ** 2, 0.0)
    aside = ASIDE_STD * (np.minimum(since / explanations.rises[:, None], 1.0) + bumps)
    rows = (phases[..., None] * dof + np.arange(dof)).reshape(count, points * dof)
    covariances = model.covariance.ravel().take(rows[:, :, None] * model.means.size + rows[:, None, :])
    by_dof = covariances.reshape(count, points, dof, points, dof)
    moved = aside[:, :, None] * aside[:, None, :]
    for d in range(dof):
        by_dof[:, :, d, :, d] += moved
    covariances[:, np.arange(points * dof), np.arange(points * dof)] += np.tile(model.noise_variances, points)
    white, logarithms = whitened(covariances, (path - means[phases]).reshape(count, -1))
    squares, determinants = white.reshape(count, points, dof) ** 2, logarithms.sum(axis=-1)
    nu, size = DEGREES_OF_FREEDOM, points * dof
    density = -determinants - (nu + size) / 2 * np.log1p(squares.sum(axis=(1, 2)) / nu)
    later = since > 0
    after = np.where(later[:, :, None], squares, 0.0).sum(axis=(1, 2))
    n_after = dof * later.sum(axis=1)
    sloppiness = (nu + squares.sum(axis=(1, 2)) - after) / (nu + size - n_after)
    return density, after / np.maximum(n_after, 1) / sloppiness
