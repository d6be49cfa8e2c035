"""Sensor noise R by expectation maximisation over all demonstrations at once; everything else stays fixed.

    E  smooth every demonstration with the present R: mean m[t] and covariance V[t] of the state given all of it
    M  R = sum over what was observed of [(o - C m)^2 + C V C^T] / number of observations

The log-likelihood of the demonstrations never decreases. Where R is far smaller than what the process noise explains, plain EM
creeps; so the step in ln R is lengthened as long as that goes well, and taken back when the log-likelihood would fall.
Source: Meier & Schaal 2016, "Learning Probabilistic DMPs"; Bishop, Pattern Recognition and Machine Learning, equation
13.115; Salakhutdinov & Roweis, Adaptive overrelaxed bound optimization methods, ICML 2003.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.gaussian import FilteredSequence, LinearGaussianModel, filter_sequence
from probdmp.gaussian.smoothing import smooth_filtered

__all__ = ["ObservationNoise", "estimate_observation_noise", "maximize_observation_noise"]

STEP_GROWTH = 1.5


class ObservationNoise(NamedTuple):
    """What EM found."""

    variances: FloatArray
    """R, (D,) array, data units squared."""
    log_likelihoods: FloatArray
    """(iterations,) array, nats: of all demonstrations, at the R with which each iteration began."""
    converged: bool
    """Whether the last M step would have changed every variance by less than the tolerance."""


def estimate_observation_noise(
    model: LinearGaussianModel,
    observations: FloatArray,
    guesses: Sequence[FloatArray],
    floor: FloatArray,
    max_iterations: int = 50,
    tolerance: float = 1e-3,
) -> ObservationNoise:
    """Variance of the position sensor of each degree of freedom.

    Parameters
    ----------
    model : system with batch axes (K, D): K demonstrations, each with its own task; its R is not used.
    observations : (T, K, D) array, data units; NaN where nothing was seen, as after the end of a shorter demonstration.
    guesses : (D,) arrays, data units squared: where R might be. EM begins at the likeliest, each degree of freedom by itself.
    floor : (D,) array, least R allowed.
    tolerance : relative change of R by an M step below which the iteration stops.
    """
    candidates = np.maximum(np.stack(guesses), floor)
    likelihoods = [_filter(model, observations, r)[1].log_likelihoods.sum(axis=(0, 1)) for r in candidates]
    variances = np.take_along_axis(candidates, np.argmax(likelihoods, axis=0)[None], axis=0)[0]
    best, safe, length = np.max(likelihoods, axis=0), variances, np.ones_like(variances)
    settled, history = np.zeros(len(variances), dtype=bool), list[float]()
    for _ in range(max_iterations):
        current, forward = _filter(model, observations, variances)
        reached = forward.log_likelihoods.sum(axis=(0, 1))
        fell = reached < best - 1e-9 * np.abs(best)
        if fell.any():  # the lengthened step went too far: take the plain one
            variances, length = np.where(fell, safe, variances), np.where(fell, 1.0, length)
            best = np.where(fell, best, reached)
            continue
        best = reached
        history.append(float(reached.sum()))
        safe = np.maximum(maximize_observation_noise(current, observations, forward), floor)
        settled |= np.abs(safe - variances) <= tolerance * variances
        if settled.all():
            return ObservationNoise(variances, np.array(history), True)
        safe = np.where(settled, variances, safe)  # what has settled does not move while the others do
        variances = np.maximum(variances * (safe / variances) ** length, floor)
        length = length * STEP_GROWTH
    return ObservationNoise(safe, np.array(history), False)


def maximize_observation_noise(model: LinearGaussianModel, observations: FloatArray, forward: FilteredSequence) -> FloatArray:
    """The M step: R, (D,) array, from a model, what it observed, (T, K, D), and what its filter said of it."""
    smoothed, sensor, seen = smooth_filtered(model, forward), model.observation_matrix, ~np.isnan(observations)
    means = np.matmul(sensor, smoothed.means[..., None])[..., 0, 0]
    spread = (sensor @ smoothed.covariances @ sensor.mT)[..., 0, 0]
    expected = np.where(seen, (observations - means) ** 2 + spread, 0.0)
    return np.asarray(expected.sum(axis=(0, 1)) / seen.sum(axis=(0, 1)))


def _filter(
    model: LinearGaussianModel, observations: FloatArray, variances: FloatArray
) -> tuple[LinearGaussianModel, FilteredSequence]:
    """The model with the given R, and what its filter says."""
    current = replace(model, observation_covariance=variances[:, None, None])
    return current, filter_sequence(current, observations[..., None])
