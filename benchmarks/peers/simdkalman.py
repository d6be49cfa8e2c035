"""simdkalman: NumPy over many series, each with covariances of its own.

Its filter class takes neither a control nor noise that depends on time, so its documented single steps are called in a loop.
Its log-likelihood leaves out the constant -ln(2 pi) / 2 of each observation, which is added here.
"""

import numpy as np
from simdkalman import KalmanFilter

from peers.system import Score, Stepper, System
from probdmp.checks import FloatArray

__all__ = ["score_call", "stepper"]

LEFT_OUT = -0.5 * np.log(2 * np.pi)


def score_call(system: System, observations: FloatArray) -> Score:
    """Observations (N, T)."""
    columns = [np.ascontiguousarray(column)[:, None, None] for column in observations.T]
    drifts, noises = system.drifts[:, None, :, None], system.process_covariances[:, None]

    def score() -> FloatArray:
        many, mean, covariance = _begun([system], len(observations))
        total = np.zeros(len(observations))
        for t, seen in enumerate(columns):
            if t > 0:
                many.process_noise = noises[t - 1]
                mean, covariance = many.predict_next(mean, covariance)
                mean += drifts[t - 1]
            mean, covariance, _, density = many.update(mean, covariance, seen, log_likelihood=True)
            total += density
        return total + LEFT_OUT * len(columns)

    return score


def stepper(systems: list[System]) -> Stepper:
    """An execution of D degrees of freedom, which are its series."""
    return _Steps(systems)


class _Steps:
    def __init__(self, systems: list[System]) -> None:
        self._drifts = np.stack([system.drifts for system in systems], axis=1)[..., None]
        self._noises = np.stack([system.process_covariances for system in systems], axis=1)
        self._filter, self._mean, self._covariance = _begun(systems, 1)
        self._t = 0

    def step(self, observation: FloatArray) -> float:
        t, many = self._t, self._filter
        if t > 0:
            many.process_noise = self._noises[t - 1]
            self._mean, self._covariance = many.predict_next(self._mean, self._covariance)
            self._mean += self._drifts[t - 1]
        self._t += 1
        seen = observation[:, None, None]
        self._mean, self._covariance, _, densities = many.update(self._mean, self._covariance, seen, log_likelihood=True)
        return float(densities.sum()) + LEFT_OUT * len(observation)


def _begun(systems: list[System], n_series: int) -> tuple[KalmanFilter, FloatArray, FloatArray]:
    """A filter over systems, each repeated, with the mean (S, n, 1) and covariance (S, n, n) that it starts from."""
    many = KalmanFilter(
        state_transition=np.stack([system.transition for system in systems]),
        process_noise=np.stack([system.process_covariances[0] for system in systems]),
        observation_model=np.stack([system.observation_row[None] for system in systems]),
        observation_noise=np.array([[[system.observation_variance]] for system in systems]),
    )
    mean = np.repeat(np.stack([system.initial_mean for system in systems]), n_series, axis=0)[..., None]
    covariance = np.repeat(np.stack([system.initial_covariance for system in systems]), n_series, axis=0)
    return many, mean, covariance
