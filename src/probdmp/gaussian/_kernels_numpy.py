"""The kernels of probdmp.gaussian in NumPy: what `_kernels.c` does, function by function, where there is no compiler.

    s[t] = A s[t-1] + drift[t-1] + b e[t-1],  e ~ N(0, u[t-1]),    o[t] = c s[t] + v[t],  v ~ N(0, r)

All arrays are float64 and C-contiguous; the last arguments are written to. NaN marks what was not observed.
"""

import numpy as np

from probdmp.checks import LARGEST_MAGNITUDE, FloatArray, is_plain
from probdmp.gaussian._augmented_numpy import augmented_step
from probdmp.gaussian._recordings_numpy import plain_recordings, points_on_lines, whiten
from probdmp.gaussian._windows_numpy import least_squares, split_sums, window_evidence, window_ratios, window_sums

__all__ = [
    "PreparedSteps",
    "augmented_step",
    "filter_systems",
    "least_squares",
    "plain_recordings",
    "points_on_lines",
    "smooth_backwards",
    "smoothed_states",
    "split_sums",
    "squared_innovations",
    "whiten",
    "window_evidence",
    "window_ratios",
    "window_sums",
]

LOG_2PI = float(np.log(2 * np.pi))
BLOCK = 2048
"""Series that are filtered side by side: what is known of them stays in the cache."""
GROUP = 128
"""Series of one product of matrices, padded to it: many, to be fast, but few enough for BLAS not to split it among threads, and
always as many, so that each is rounded alike whatever it is beside."""
STEPS = 32
"""Steps that are taken at once, as one product of matrices: many cost arithmetic, few cost calls."""


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


class PreparedSteps:
    """D systems, ready to be filtered tick by tick: each number of theirs has a row of length W >= D.

    Parameters
    ----------
    system : (n n + 2 n + 1, W) array, rows A, b, c, r.
    inputs : (T, n + 1, W) array, drift and input variance of each step.
    n_outputs : D.
    """

    def __init__(self, system: FloatArray, inputs: FloatArray, n_outputs: int) -> None:
        n, width = inputs.shape[1] - 1, inputs.shape[2]
        self._transition = system[: n * n].T.reshape(width, n, n)
        self._b, self._c, r = np.split(system[n * n :].T, [n, 2 * n], axis=1)
        self._r, self._inputs, self._n_outputs = r[:, 0], inputs, n_outputs

    def take(self, observation: object, before: bytes, step: int) -> tuple[int, int, float, bytes] | None:
        """One tick: update with what was observed, then predict.

        Parameters
        ----------
        observation : anything; a contiguous float64 array (D,) is taken.
        before : the record whose first rows are m and V of the state as predicted.
        step : which of the inputs drives the step that follows.

        Returns
        -------
        How many of D outputs were observed, D, their log-likelihood, and a record, a float64 array (n + n n + 3, W) as bytes:
        m and V of the next tick, then innovation, its variance S and log-likelihood of each output at this one. None if the
        observation is not what can be taken, or one of its numbers is infinite or too large to be squared.
        """
        if not is_plain(observation) or observation.shape != (self._n_outputs,):
            return None
        if np.any(np.abs(observation) > LARGEST_MAGNITUDE):
            return None
        width, n = self._c.shape
        rows, now, d = np.frombuffer(before).reshape(-1, width), self._inputs[step], self._n_outputs
        observed = np.zeros(width)
        observed[:d] = observation
        mean, covariance, *told, _ = _update(self._c, self._r, observed, rows[:n].T, rows[n : n + n * n].T.reshape(width, n, n))
        mean, covariance = _predict(self._transition, self._b, now[:n].T, now[n], mean, covariance)
        record = np.concatenate([mean.T, covariance.reshape(width, -1).T, told])
        return int(np.sum(~np.isnan(observation))), d, float(record[-1, :d].sum()), record.tobytes()


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
    n_times, n_dof, n = feedback.shape
    responses = _responses(closed_loop, feedback, sensor, precisions)
    with np.errstate(over="ignore", invalid="ignore"):  # what cannot be squared is looked at afterwards
        for block in _parts(len(observations), max(1, BLOCK // n_dof)):
            observed = np.moveaxis(observations[block], -1, 0)
            expected = np.moveaxis(paths if len(paths) == 1 else paths[block], -1, 0)
            k, groups = observed.shape[1], -(-observed.shape[1] // GROUP)
            total = np.zeros((n_dof, groups, GROUP))
            before = np.zeros((*total.shape, n + STEPS))  # states, and what is observed from there on
            one_by_one = before.reshape(n_dof, -1, n + STEPS)[:, :k]
            for times, response in zip(_parts(n_times, STEPS), responses, strict=True):
                used = n + times.stop - times.start
                np.subtract(observed[..., times], expected[..., times], out=one_by_one[..., n:used])
                after = response[:, None, :used, :used] @ before[..., :used].mT
                before[..., :n] = after[..., :n, :].mT
                after = after[..., n:, :]
                total += np.einsum("dgtk,dgtk->dgk", after, after)
            squares[block] = total.reshape(n_dof, -1)[:, :k].T


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
    for block in _parts(len(observations), BLOCK):
        y = np.ascontiguousarray(np.moveaxis(observations[block] - (paths if len(paths) == 1 else paths[block]), 0, -1))
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


def smooth_backwards(
    transition: FloatArray,
    scores: FloatArray,
    informations: FloatArray,
    retentions: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    smoothed_means: FloatArray,
    smoothed_covariances: FloatArray,
) -> None:
    """What the observations after each time say of its states, for M independent systems that have been filtered.

    Parameters
    ----------
    transition : A, (M, n, n) array.
    scores, informations, retentions : C^T S^-1 e, C^T S^-1 C and I - K C, (T, M, n) and (T, M, n, n) arrays.
    means, covariances : of the filter, (T, M, n) and (T, M, n, n) arrays.
    smoothed_means, smoothed_covariances : written, likewise.
    """
    score, information = np.zeros_like(means[0]), np.zeros_like(covariances[0])
    for t in range(len(means) - 1, -1, -1):
        v, kept = covariances[t], retentions[t]
        correction = v @ information @ v
        smoothed_means[t] = means[t] + np.matmul(v, score[..., None])[..., 0]
        smoothed_covariances[t] = v - (correction + correction.mT) / 2
        told = scores[t] + np.matmul(kept.mT, score[..., None])[..., 0]
        score = np.matmul(transition.mT, told[..., None])[..., 0]
        information = transition.mT @ (informations[t] + kept.mT @ information @ kept) @ transition


def _responses(closed_loop: FloatArray, feedback: FloatArray, sensor: FloatArray, precisions: FloatArray) -> FloatArray:
    """What STEPS steps at a time make of states and observations, in this order: the states that follow and e / sqrt(S).

    Returns (T / STEPS, D, n + STEPS, n + STEPS): the recursion, of all such stretches side by side, of one number that is 1.
    """
    n_times, n_dof, n = feedback.shape
    n_stretches = -(-n_times // STEPS)

    def in_stretches(array: FloatArray) -> FloatArray:
        padded = np.zeros((n_stretches * STEPS, *array.shape[1:]))
        padded[:n_times] = array
        return padded.reshape(n_stretches, STEPS, *array.shape[1:])

    closed, gains, roots = in_stretches(closed_loop), in_stretches(feedback), in_stretches(np.sqrt(precisions))
    responses = np.empty((n_stretches, n_dof, n + STEPS, n + STEPS))
    state = np.zeros((n_stretches, n_dof, n, n + STEPS))
    state[..., :n] = np.eye(n)
    for t in range(STEPS):
        innovation = -np.matmul(sensor[:, None], state)[..., 0, :]
        innovation[..., n + t] += 1
        responses[..., n + t, :] = innovation * roots[:, t, :, None]
        state = closed[:, t] @ state
        state[..., n + t] += gains[:, t]
    responses[..., :n, :] = state
    return responses


def _parts(length: int, size: int) -> list[slice]:
    return [slice(first, min(first + size, length)) for first in range(0, length, size)]


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
