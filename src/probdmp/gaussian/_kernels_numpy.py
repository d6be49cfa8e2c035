"""The kernels of probdmp.gaussian in NumPy: what `_kernels.c` does, function by function, where there is no compiler.

    s[t] = A s[t-1] + drift[t-1] + b e[t-1],  e ~ N(0, u[t-1]),    o[t] = c s[t] + v[t],  v ~ N(0, r)

All arrays are float64 and C-contiguous; the last arguments are written to. NaN marks what was not observed.
"""

import numpy as np

from probdmp.checks import LARGEST_MAGNITUDE, FloatArray
from probdmp.gaussian._augmented_numpy import augmented_step
from probdmp.gaussian._recordings_numpy import (
    least_squares,
    plain_recordings,
    points_on_lines,
    split_sums,
    window_evidence,
    window_mixtures,
)

__all__ = [
    "augmented_step",
    "filter_step",
    "filter_systems",
    "least_squares",
    "plain_recordings",
    "points_on_lines",
    "smoothed_states",
    "split_sums",
    "squared_innovations",
    "window_evidence",
    "window_mixtures",
]

LOG_2PI = float(np.log(2 * np.pi))
BLOCK = 2048
"""Series that are filtered side by side: what is known of them stays in the cache."""


def filter_systems(
    transition: FloatArray,
    input_vector: FloatArray,
    drifts: FloatArray,
    input_variances: FloatArray,
    sensor: FloatArray,
    noise: FloatArray,
    initial_mean: FloatArray,
    initial_covariance: FloatArray,
    observations: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    innovations: FloatArray,
    variances: FloatArray,
    log_likelihoods: FloatArray,
    gains: FloatArray,
) -> None:
    """Kalman filter of M independent systems of n states, each with one input and one sensor.

    Parameters
    ----------
    transition, input_vector, sensor, noise : A (M, n, n), b (M, n), c (M, n), r (M,).
    drifts, input_variances : (T-1, M, n) and (T-1, M) arrays.
    initial_mean, initial_covariance : (M, n) and (M, n, n) arrays.
    observations : (T, M) array.
    means, covariances : written, (T, M, n) and (T, M, n, n): the state after each update.
    innovations, variances, log_likelihoods : written, (T, M): NaN, S and 0 where nothing was observed.
    gains : written, (T, M, n); 0 where nothing was observed.
    """
    mean, covariance = initial_mean, initial_covariance
    for t, observed in enumerate(observations):
        if t > 0:
            mean, covariance = _predict(transition, input_vector, drifts[t - 1], input_variances[t - 1], mean, covariance)
        mean, covariance, innovations[t], variances[t], log_likelihoods[t], gains[t] = _update(
            sensor, noise, observed, mean, covariance
        )
        means[t], covariances[t] = mean, covariance


def filter_step(
    system: FloatArray, inputs: FloatArray, observation: FloatArray, before: FloatArray, after: FloatArray, step: int
) -> int:
    """One tick of D systems: update with what was observed, then predict. Each number of theirs has a row of length W >= D.

    Parameters
    ----------
    system : (n n + 2 n + 1, W) array, rows A, b, c, r.
    inputs : (T, n + 1, W) array, drift and input variance of each step.
    observation : (D,) array.
    before : (n + n n + 4, W) array, the record whose first rows are m and V of the state as predicted.
    after : written, likewise: m and V of the next tick, then innovation, its variance S and log-likelihood of this one, and the
        sum of these.
    step : which of the inputs drives the step that follows.

    Returns
    -------
    How many were observed; -1 if one is infinite, or too large to be squared, and then nothing is written.
    """
    if np.any(np.abs(observation) > LARGEST_MAGNITUDE):
        return -1
    inputs = inputs[step]
    n, width = len(inputs) - 1, inputs.shape[1]
    a, (b, c, r) = system[: n * n].T.reshape(width, n, n), np.split(system[n * n :].T, [n, 2 * n], axis=1)
    observed = np.zeros(width)
    observed[: len(observation)] = observation
    mean, covariance, innovation, variance, log_likelihood, _ = _update(
        c, r[:, 0], observed, before[:n].T, before[n : n + n * n].T.reshape(width, n, n)
    )
    mean, covariance = _predict(a, b, inputs[:n].T, inputs[n], mean, covariance)
    after[:n], after[n : n + n * n] = mean.T, covariance.reshape(width, -1).T
    log_likelihood[len(observation) :] = 0.0
    after[-4], after[-3], after[-2], after[-1] = innovation, variance, log_likelihood, log_likelihood.sum()
    return int(np.sum(~np.isnan(observation)))


def squared_innovations(
    closed_loop: FloatArray,
    feedback: FloatArray,
    sensor: FloatArray,
    precisions: FloatArray,
    observations: FloatArray,
    paths: FloatArray,
    squares: FloatArray,
) -> None:
    """Sums over time of e^2 / S of N series that share their gains; NaN where an observation is missing.

    Parameters
    ----------
    closed_loop : F = A (I - K c), (T, D, n, n) array.
    feedback : g = A K, (T, D, n) array.
    sensor : c, (D, n) array.
    precisions : 1 / S, (T, D) array.
    observations : (N, T, D) array.
    paths : what is expected without observations, (N, T, D) array, or (1, T, D) for all alike.
    squares : written, (N, D).
    """
    with np.errstate(over="ignore", invalid="ignore"):  # what cannot be squared is looked at afterwards
        for block, y in _blocks(observations, paths):
            total = np.zeros(y.shape[1:])
            state = np.zeros((sensor.shape[1], *total.shape))
            for t, now in enumerate(y):
                innovation = now - np.einsum("dn,ndk->dk", sensor, state)
                total += innovation**2 * precisions[t, :, None]
                state = _go_on(closed_loop[t], feedback[t], now, state)
            squares[block] = total.T


def smoothed_states(
    closed_loop: FloatArray,
    feedback: FloatArray,
    sensor: FloatArray,
    precisions: FloatArray,
    observations: FloatArray,
    paths: FloatArray,
    predicted_covariances: FloatArray,
    path_states: FloatArray,
    smoothed: FloatArray,
) -> None:
    """Means of the states given the whole series; the first arguments are those of `squared_innovations`.

    Parameters
    ----------
    predicted_covariances : of the state before each update, (T, D, n, n) array.
    path_states : the states expected without observations, (T, D, n) array.
    smoothed : written, (N, T, D, n).
    """
    for block, y in _blocks(observations, paths):
        predicted = np.zeros((len(y) + 1, sensor.shape[1], *y.shape[1:]))
        for t, now in enumerate(y):
            predicted[t + 1] = _go_on(closed_loop[t], feedback[t], now, predicted[t])
        innovations = y - np.einsum("dn,tndk->tdk", sensor, predicted[:-1])
        rho = np.zeros(predicted.shape[1:])
        for t in range(len(y) - 1, -1, -1):
            weighted = innovations[t] * precisions[t, :, None]
            rho = sensor.T[..., None] * weighted + np.einsum("dkn,kdj->ndj", closed_loop[t], rho)
            corrected = predicted[t] + np.einsum("dnk,kdj->ndj", predicted_covariances[t], rho)
            smoothed[block, t] = path_states[t] + np.moveaxis(corrected, -1, 0).mT


def _blocks(observations: FloatArray, paths: FloatArray) -> "list[tuple[slice, FloatArray]]":
    """Observations less their paths, some series at a time, (T, D, k)."""
    parts = [slice(first, min(first + BLOCK, len(observations))) for first in range(0, len(observations), BLOCK)]
    of_all = len(paths) == 1
    return [
        (part, np.ascontiguousarray(np.moveaxis(observations[part] - (paths if of_all else paths[part]), 0, -1)))
        for part in parts
    ]


def _go_on(closed_loop: FloatArray, feedback: FloatArray, y: FloatArray, state: FloatArray) -> FloatArray:
    return feedback.T[..., None] * y + np.einsum("dnk,kdj->ndj", closed_loop, state)


def _predict(
    a: FloatArray, b: FloatArray, drift: FloatArray, u: FloatArray, mean: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    predicted = a @ covariance @ a.mT + u[:, None, None] * b[:, :, None] * b[:, None, :]
    return np.matmul(a, mean[..., None])[..., 0] + drift, (predicted + predicted.mT) / 2


def _update(
    c: FloatArray, r: FloatArray, observed: FloatArray, mean: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Mean, covariance in Joseph form, innovation, S, log-likelihood and gain."""
    spread = np.matmul(covariance, c[..., None])[..., 0]
    variance = r + np.sum(c * spread, axis=-1)
    innovation = observed - np.sum(c * mean, axis=-1)
    seen = ~np.isnan(innovation)
    gain = np.where(seen[:, None], spread / variance[:, None], 0.0)
    kept = np.eye(mean.shape[-1]) - gain[:, :, None] * c[:, None, :]
    updated = kept @ covariance @ kept.mT + r[:, None, None] * gain[:, :, None] * gain[:, None, :]
    log_likelihood = np.where(seen, -0.5 * (innovation**2 / variance + np.log(variance) + LOG_2PI), 0.0)
    corrected = mean + gain * np.where(seen, innovation, 0.0)[:, None]
    updated = np.where(seen[:, None, None], (updated + updated.mT) / 2, covariance)
    return corrected, updated, innovation, variance, log_likelihood, gain
