"""Why an execution was called failed, from where it has been lately.

What has not moved for `REST_TICKS` ticks is held. Otherwise the last `LOOKED_BACK` ticks are compared with the mean path run through
at several speeds, from every phase: an execution that is on its path, but at another time or speed than it should be, is
slow or fast; one that is nowhere on it is off the path.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS

__all__ = ["Diagnosis", "diagnose"]

REST_TICKS = 8
REST_EXTENT = 0.004
"""Root mean square by which what is held still moves, as a fraction of the range, besides 1.5 times the noise."""
LOOKED_BACK = (0, 4, 8, 12)
"""Ticks before now at which an execution is compared with its path."""
SPEEDS = np.array([0.25, 0.4, 0.5, 0.6, 0.75, 0.9, 1.0, 1.15, 1.35, 1.6, 2.0])
ON_PATH = 2.5
"""Mean squared distance per degree of freedom up to which an execution is on its path."""
UNREMARKABLE_LAG = 4
"""Ticks by which ordinary executions are early or late."""
REMARKABLE_GAIN = 0.5
"""Another timing has to leave less than this share of the squared distance to be the reason."""


class Diagnosis(NamedTuple):
    """What happened."""

    kind: str
    """One of `probdmp.detection.verdict.KINDS`."""
    cause: str


def diagnose(model: PathModel, means: FloatArray, tick: int, recent: Sequence[FloatArray], noise_stds: FloatArray) -> Diagnosis:
    """Motion or timing, and what in particular.

    Parameters
    ----------
    means : (M, D) array, mean path of the execution.
    tick : ticks since the start.
    recent : displacements (D,) at the last ticks, the latest last.
    noise_stds : (D,) array, noise of the sensor as a fraction of the range.
    """
    latest = np.stack(list(recent)[-REST_TICKS:])
    latest = latest[~np.isnan(latest).any(axis=1)]
    if len(latest) >= REST_TICKS // 2:
        extents = np.sqrt(np.mean((latest - latest.mean(axis=0)) ** 2, axis=0))
        if np.all(extents < REST_EXTENT + 1.5 * noise_stds):
            return Diagnosis("timing", "held")
    distances = _distances(model, means, recent)
    if distances is None:
        return Diagnosis("motion", "off the path")
    best = np.unravel_index(np.nanargmin(distances), distances.shape)
    speed, phase = float(SPEEDS[best[0]]), int(best[1])
    on_time = np.abs(np.arange(TICKS + 1) - min(tick, TICKS)) <= UNREMARKABLE_LAG
    ordinary = float(np.nanmin(distances[int(np.flatnonzero(SPEEDS == 1.0)[0]), on_time]))
    if distances[best] > ON_PATH or distances[best] > REMARKABLE_GAIN * ordinary:
        return Diagnosis("motion", "off the path")
    late = tick - phase
    if late > UNREMARKABLE_LAG or (late >= 0 and speed < 1):
        return Diagnosis("timing", "slow")
    return Diagnosis("timing", "fast")


def _distances(model: PathModel, means: FloatArray, recent: Sequence[FloatArray]) -> FloatArray | None:
    """Mean squared distance per degree of freedom from the path run through at each speed, up to each phase: (speeds, M)."""
    back = [j for j in LOOKED_BACK if j < len(recent) and not np.isnan(recent[-1 - j]).any()]
    if not back:
        return None
    dof, ticks = means.shape[1], np.arange(TICKS + 1)
    variances = model.covariance[ticks, :, ticks] + np.diag(model.noise_variances)
    total = np.zeros((len(SPEEDS), TICKS + 1))
    for j in back:
        residuals = recent[-1 - j] - means
        squares = np.sum(residuals * np.linalg.solve(variances, residuals[..., None])[..., 0], axis=-1) / dof
        total += squares[np.clip(np.rint(ticks - SPEEDS[:, None] * j).astype(int), 0, TICKS)]
    return total / len(back)
