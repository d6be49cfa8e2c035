"""pykalman: plain NumPy, one series after the other."""

import numpy as np
from pykalman import KalmanFilter

from peers.system import Score, Smooth, System
from probdmp.checks import FloatArray

__all__ = ["score_call", "smooth_call"]


def score_call(system: System, observations: FloatArray) -> Score:
    """Observations (N, T)."""
    one = _filter(system)
    return lambda: np.array([one.loglikelihood(series[:, None]) for series in observations])


def smooth_call(system: System, observations: FloatArray) -> Smooth:
    """Observations (N, T)."""
    one = _filter(system)

    def smooth() -> tuple[FloatArray, FloatArray]:
        found = [one.smooth(series[:, None]) for series in observations]
        return np.stack([means for means, _ in found]), found[0][1]

    return smooth


def _filter(system: System) -> KalmanFilter:
    return KalmanFilter(
        transition_matrices=system.transition,
        transition_offsets=system.drifts,
        transition_covariance=system.process_covariances,
        observation_matrices=system.observation_row[None],
        observation_covariance=np.array([[system.observation_variance]]),
        initial_state_mean=system.initial_mean,
        initial_state_covariance=system.initial_covariance,
    )
