"""filterpy: one filter object for each degree of freedom, stepped in a loop."""

import numpy as np
from filterpy.kalman import KalmanFilter

from peers.system import Score, Stepper, System
from probdmp.checks import FloatArray

__all__ = ["score_call", "stepper"]

ONE = np.ones((1, 1))


def score_call(system: System, observations: FloatArray) -> Score:
    """Observations (N, T)."""

    def score() -> FloatArray:
        found = np.empty(len(observations))
        for k, series in enumerate(observations):
            one = _Steps([system])
            found[k] = sum(one.step(series[t : t + 1]) for t in range(len(series)))
        return found

    return score


def stepper(systems: list[System]) -> Stepper:
    """An execution of D degrees of freedom that are independent."""
    return _Steps(systems)


class _Steps:
    def __init__(self, systems: list[System]) -> None:
        self._filters = [_filter(system) for system in systems]
        self._drifts = [system.drifts[:, :, None] for system in systems]
        self._noises = [system.process_covariances for system in systems]
        self._t = 0

    def step(self, observation: FloatArray) -> float:
        t, total = self._t, 0.0
        for d, one in enumerate(self._filters):
            if t > 0:
                one.predict(u=ONE, B=self._drifts[d][t - 1], Q=self._noises[d][t - 1])
            one.update(observation[d])
            total += float(one.log_likelihood)
        self._t += 1
        return total


def _filter(system: System) -> KalmanFilter:
    n = len(system.transition)
    one = KalmanFilter(dim_x=n, dim_z=1, dim_u=1)
    one.x, one.P = system.initial_mean[:, None].copy(), system.initial_covariance.copy()
    one.F, one.H = system.transition, system.observation_row[None]
    one.R = np.array([[system.observation_variance]])
    return one
