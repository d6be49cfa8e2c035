"""The kernels of probdmp.gaussian in NumPy: what `_kernels.c` does, function by function, where there is no compiler.

    s[t] = A s[t-1] + drift[t-1] + b e[t-1],  e ~ N(0, u[t-1]),    o[t] = c s[t] + v[t],  v ~ N(0, r)

All arrays are float64 and C-contiguous; the last arguments are written to. NaN marks what was not observed.
"""

import numpy as np

from probdmp.checks import LARGEST_MAGNITUDE, FloatArray, IntArray

__all__ = [
    "filter_step",
    "filter_systems",
    "least_squares",
    "smoothed_states",
    "split_sums",
    "squared_innovations",
    "window_mixtures",
]

LOG_2PI = float(np.log(2 * np.pi))
BLOCK = 2048
"""Series that are filtered side by side: what is known of them stays in the cache."""
FEW = 16
"""Executions up to which all places are multiplied at once: then the calls cost more than the numbers."""


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


def least_squares(
    values: FloatArray,
    rows: IntArray,
    maps: FloatArray,
    which: IntArray,
    ends: IntArray,
    reach: IntArray,
    wanted: IntArray,
    penalties: FloatArray,
    found: FloatArray,
) -> None:
    """Squared length of windows after linear maps, up to several of their outputs: the least over accounts of a place.

    Parameters
    ----------
    values : (M, n) array: all numbers that may be in a window, of each execution.
    rows : (G, K) which of them make up the window at each of G places.
    maps : (U, R, K) array: R outputs of a window.
    which : (P, A) the maps of each place, for A accounts of it; a place beyond the last has those of the last.
    ends : (J) increasing; sums run over outputs 0, 1, ..., end - 1.
    reach : (R) how many inputs, the first ones of a window, an output depends on; not decreasing.
    wanted : (J) at how many places, the first ones, each of the sums is asked for; not increasing.
    penalties : (A) what is added to the squares of each account.
    found : written: J arrays (wanted, n), one after the other.
    """
    sums = _squares(values, rows, maps, which, ends, reach, wanted)
    for squares, least in zip(sums, split_sums(found, wanted, values.shape[1]), strict=True):
        np.add(squares, penalties[:, None], out=squares)
        np.minimum.reduce(squares, axis=1, out=least)


def _squares(
    values: FloatArray,
    rows: IntArray,
    maps: FloatArray,
    which: IntArray,
    ends: IntArray,
    reach: IntArray,
    wanted: IntArray,
) -> list[FloatArray]:
    """J arrays (wanted, A, n)."""
    n, n_accounts = values.shape[1], which.shape[1]
    sums = [np.empty((count, n_accounts, n)) for count in wanted.tolist()]
    if n <= FEW:
        _look_at_all_places(values, rows, maps, which, ends, sums)
        return sums
    window = np.empty((maps.shape[2], n))
    outputs = np.empty((int(np.diff(ends, prepend=0).max()) * n_accounts, n))
    for place in range(int(wanted[0])):
        np.take(values, rows[place], axis=0, out=window, mode="clip")
        at_place, begin = maps[which[min(place, len(which) - 1)]], 0
        for j, (end, used) in enumerate(zip(ends, reach[ends - 1], strict=True)):
            if place >= wanted[j]:
                break
            white = outputs[: (end - begin) * n_accounts]
            np.matmul(at_place[:, begin:end, :used].reshape(len(white), used), window[:used], out=white)
            np.multiply(white, white, out=white)
            np.add.reduce(white.reshape(n_accounts, end - begin, n), axis=1, out=sums[j][place])
            if j:
                sums[j][place] += sums[j - 1][place]
            begin = end
    return sums


def window_mixtures(
    values: FloatArray,
    rows: IntArray,
    maps: FloatArray,
    which: IntArray,
    ends: IntArray,
    reach: IntArray,
    wanted: IntArray,
    scales: FloatArray,
    n_halves: IntArray,
    found: FloatArray,
    freedom: float,
) -> None:
    """ln sum_a (scale_a (1 + square_a / freedom))^-(n_halves / 2) of such sums of squares, over the accounts.

    Parameters
    ----------
    scales : (P, J, A) array, of each place and sum.
    n_halves : (J)
    found : written: J arrays (wanted, n), one after the other.
    """
    sums, mixtures = _squares(values, rows, maps, which, ends, reach, wanted), split_sums(found, wanted, values.shape[1])
    for j, (some, mixed) in enumerate(zip(sums, mixtures, strict=True)):
        own = scales[np.minimum(np.arange(len(some)), len(scales) - 1), j]
        _mix(some, own, mixed, int(n_halves[j]), freedom)


def split_sums(found: FloatArray, wanted: IntArray, n: int) -> list[FloatArray]:
    """The J arrays (wanted, n) that are written one after the other."""
    ends = np.cumsum(wanted * n).tolist()
    return [found[end - count * n : end].reshape(count, n) for end, count in zip(ends, wanted.tolist(), strict=True)]


def _mix(squares: FloatArray, scales: FloatArray, mixed: FloatArray, n_halves: int, freedom: float) -> None:
    """Mixtures (G, n) of squares (G, A, n) with scales (G, A)."""
    # A few places at a time, which stay close to the processor.
    step = max(1, 16384 // max(squares[0].size, 1)) if len(squares) else 1
    for begin in range(0, len(squares), step):
        part = slice(begin, begin + step)
        bases = squares[part] * (scales[part, :, None] / freedom)
        bases += scales[part, :, None]
        least = bases.min(axis=1)
        np.divide(least[:, None], bases, out=bases)
        np.log(_power(bases, n_halves).sum(axis=1), out=mixed[part])
        mixed[part] -= n_halves / 2 * np.log(least)


def _power(base: FloatArray, n_halves: int) -> FloatArray:
    """base^(n_halves / 2) of numbers from 0 to 1, by squaring: far faster than for any exponent."""
    power, exponent = np.sqrt(base) if n_halves % 2 else None, n_halves // 2
    while exponent:
        if exponent % 2:
            power = base.copy() if power is None else np.multiply(power, base, out=power)
        exponent //= 2
        if exponent:
            np.multiply(base, base, out=base)
    return np.ones_like(base) if power is None else power


def _look_at_all_places(
    values: FloatArray, rows: IntArray, maps: FloatArray, which: IntArray, ends: IntArray, found: list[FloatArray]
) -> None:
    count, n_accounts, end = len(found[0]), which.shape[1], int(ends[-1])
    at = maps[which[np.minimum(np.arange(count), len(which) - 1)], :end]
    white = np.matmul(at.reshape(count, n_accounts * end, maps.shape[2]), values[rows[:count]])
    np.multiply(white, white, out=white)
    sums = np.add.reduceat(white.reshape(count, n_accounts, end, values.shape[1]), [0, *ends[:-1]], axis=2)
    np.cumsum(sums, axis=2, out=sums)
    for j, own in enumerate(found):
        own[:] = sums[: len(own), :, j]


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
