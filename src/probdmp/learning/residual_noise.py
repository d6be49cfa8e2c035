"""What the parameters of the demonstrations leave over: deviations driven by white forcing noise, and the sensors' own noise.

    r_k[t] = y_k[t] - H[t] m_k = d_k[t] + v_k[t],    d[t] = A d[t-1] + B eps[t-1],  eps ~ N(0, 1 / beta),    v ~ N(0, R)

m_k is theta of demonstration k given all of it, C what is not known about it. beta and R of each signal maximise the
expected log-likelihood of the residuals under a Kalman filter,

    E ln p = -1/2 sum_kt [ln S_k[t] + (e_k[t]^2 + c_k[t]) / S_k[t]]

e the innovation of r_k, c the variance of the innovation of H theta_k, theta_k ~ N(0, C). Only the ratio of 1 / beta to R needs
a search: scaled together, they scale S, and the best scale is the mean of (e^2 + c) / S. A grid of ratios is filtered at once.
Source: Durbin & Koopman, Time Series Analysis by State Space Methods, section 2.10, the concentrated likelihood.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive, Task
from probdmp.dmp.deviations import DeviationSystem, deviation_system, lasting_variances
from probdmp.dmp.joint_model import JointExecutions, joint_executions
from probdmp.dmp.transformation_system import POSITION, VELOCITY
from probdmp.gaussian import kernels

__all__ = ["with_residual_noise"]

RATIOS = 10.0 ** np.arange(-3, 10)
"""Of the variance of a deviation that has gone on for long to R."""
FINER = 10.0 ** np.arange(-0.75, 1.0, 0.25)
LEAST_VARIANCE = 1e-12
"""Least R, as a fraction of the squared range."""
MOST_TIMES = 100
"""How many times of a demonstration tell its parameters, about; residuals closer than that are not independent."""


class _Residuals(NamedTuple):
    errors: FloatArray
    """r, (T, D, K) array, data units; NaN at the start, which is told, and after the end of a demonstration."""
    spreads: FloatArray
    """(T, D, r) array, data units: a square root of the covariance H C H^T of one demonstration, of middle length."""
    typical: int
    """Which one."""


class _Gains(NamedTuple):
    velocity: FloatArray
    """(T, G, D or 1, K) array."""
    position: FloatArray
    """(T, G, D or 1, K) array."""
    variances: FloatArray
    """S, (T, G, D or 1, K) array."""


def with_residual_noise(primitive: Primitive, tasks: Task, dts: FloatArray, observed: FloatArray) -> Primitive:
    """The primitive with beta and R of joint weights.

    Parameters
    ----------
    primitive : its R is taken for the variance of the residuals.
    tasks : of the K demonstrations.
    dts : (K) array, seconds.
    observed : (T, K, S) array of all signals; NaN after the end of a shorter demonstration.
    """
    signals = primitive.signals
    n_signals = len(signals.names)
    residuals = _residuals(primitive, joint_executions(primitive, tasks, dts, len(observed)), observed)
    unit = primitive.with_signal_noise(signals.observation_variances, np.ones(n_signals))
    system, lasting = deviation_system(unit, tasks.duration, dts), lasting_variances(unit)
    best = np.ones(1)  # one for all signals at first: they share the gains
    for finer in (RATIOS, FINER):
        ratios = finer[:, None] * best
        likelihoods, scales = _likelihoods(residuals, system, ratios / lasting[: len(best)])
        chosen = np.argmax(likelihoods, axis=0)
        best = np.broadcast_to(ratios, scales.shape)[chosen, np.arange(n_signals)]
    variances = np.maximum(scales[chosen, np.arange(n_signals)], LEAST_VARIANCE * signals.ranges**2)
    return primitive.with_signal_noise(variances, lasting / (best * variances))


def _residuals(primitive: Primitive, executions: JointExecutions, observed: FloatArray) -> _Residuals:
    """What is left of the demonstrations by their parameters, which a part of their times tells."""
    model, rows = executions.model, np.moveaxis(executions.rows[..., POSITION, :], 0, 1)[:, None]
    designs = rows @ model.factors  # (K, D, T, r)
    errors = np.nan_to_num(np.moveaxis(observed, 0, -1) - (rows @ model.means[..., None])[..., 0])
    seen = ~np.isnan(np.moveaxis(observed, 0, -1))
    seen[..., 0] = False
    (k, *_, r), step = designs.shape, -(-len(observed) // MOST_TIMES)
    weights = (seen / primitive.signals.observation_variances[:, None])[..., ::step].reshape(k, -1, 1)
    some = designs[:, :, ::step].reshape(k, -1, r)
    mean, prior = model.belief
    surprise = errors[..., ::step].reshape(k, -1, 1) - some @ mean[..., None]
    covariances = np.linalg.solve(np.eye(r) + prior @ (some.mT @ (some * weights)), prior)
    means = mean + (covariances @ (some.mT @ (weights * surprise)))[..., 0]
    left = np.where(seen, errors - np.matmul(designs, means[:, None, :, None])[..., 0], np.nan)
    lengths = observed.shape[0] - np.argmax(np.logical_or.reduce(seen, axis=1)[:, ::-1], axis=-1)
    typical = int(np.argsort(lengths)[k // 2])
    eigenvalues, vectors = np.linalg.eigh((covariances[typical] + covariances[typical].T) / 2)
    spreads = designs[typical, :, : lengths[typical]] @ (vectors * np.sqrt(np.maximum(eigenvalues, 0.0)))
    return _Residuals(left.T, np.moveaxis(spreads, 0, 1), typical)


def _likelihoods(residuals: _Residuals, system: DeviationSystem, variances: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Concentrated log-likelihood but for a constant, and the best R, (G, D) arrays.

    Parameters
    ----------
    system : of the K demonstrations, driven by unit noise.
    variances : 1 / (beta R), (G, D or 1) array.
    """
    errors, spreads, typical = residuals
    counted = ~np.isnan(errors)
    gains = _gains(system, variances, _gaps(counted))
    shared = _Gains(*(x[: len(spreads), ..., [typical]] for x in gains))
    moves = system.transition[:, 0, VELOCITY:, VELOCITY:]
    squares = _squared_innovations(np.where(counted, errors, 0.0), counted[:, None] / gains.variances, gains, moves)
    n = counted[:, 0].sum()
    per_time = _squared_spreads(spreads, shared, moves[typical]) / (len(spreads) - 1)
    scales = squares.sum(axis=-1) / n + per_time
    logs = np.sum(counted[:, None] * np.log(gains.variances), axis=(0, -1))
    return -0.5 * (n * np.log(scales) + logs), scales


def _gaps(counted: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Where nothing was measured before the end of a demonstration, (T, D, K); (T, 1, 1) if that never was."""
    ahead = np.logical_or.accumulate(counted[::-1])[::-1]
    gaps = ahead & ~counted
    return gaps if gaps[1:].any() else gaps[:, :1, :1]


def _gains(system: DeviationSystem, variances: FloatArray, gaps: NDArray[np.bool_]) -> _Gains:
    """Kalman gains for a sensor of unit variance and inputs of the given variances, (G, D or 1)."""
    (a, b), (c, e) = np.moveaxis(system.transition[:, 0, VELOCITY:, VELOCITY:], 0, -1)
    noise_v, noise_p = system.input_vector[:, 0, VELOCITY:].T
    q = variances[..., None] * system.variances[:, 0]
    q_vv, q_vp, q_pp = q * noise_v**2, q * noise_v * noise_p, q * noise_p**2
    vv = vp = pp = np.zeros(np.broadcast_shapes(q.shape, gaps.shape[1:]))
    steps = [(vp, pp, pp + 1)]
    for gap in gaps[1:]:
        av, ap, cv, cp = a * vv + b * vp, a * vp + b * pp, c * vv + e * vp, c * vp + e * pp
        vv, vp, pp = a * av + b * ap + q_vv, c * av + e * ap + q_vp, c * cv + e * cp + q_pp
        s = pp + 1
        weight = np.where(gap, 0.0, 1 / s)
        gain_v, gain_p = vp * weight, pp * weight
        steps.append((gain_v, gain_p, s))
        vv, vp, pp = vv - gain_v * vp, vp - gain_v * pp, pp - gain_p * pp
    return _Gains(*(np.stack(x) for x in zip(*steps, strict=True)))


def _squared_innovations(paths: FloatArray, weights: FloatArray, gains: _Gains, moves: FloatArray) -> FloatArray:
    """Weighted sums over time of squared innovations, (G, D, C) array.

    Parameters
    ----------
    paths : (T, D, C) array, what is filtered.
    weights : (T, G, D or 1, C or 1) array.
    moves : A of velocity and position, (C or 1, 2, 2).
    """
    (a, b), (c, e) = np.moveaxis(moves, 0, -1)
    v = p = np.zeros(np.broadcast_shapes(weights.shape[1:], paths.shape[1:]))
    squares = np.zeros_like(v)
    for path, weight, gain_v, gain_p in zip(paths[1:], weights[1:], gains.velocity[1:], gains.position[1:], strict=True):
        expected = c * v + e * p
        innovation = path - expected
        v = a * v + b * p + gain_v * innovation
        p = expected + gain_p * innovation
        squares += weight * innovation**2
    return squares


def _squared_spreads(spreads: FloatArray, gains: _Gains, move: FloatArray) -> FloatArray:
    """The same sums of all columns of `spreads`, (T, D, C), which share their gains, (T, G, D or 1, 1): (G, D) array.

    Parameters
    ----------
    move : A of velocity and position, (2, 2).
    """
    n_times, n_dof, n_columns = spreads.shape
    series = np.ascontiguousarray(np.moveaxis(spreads[1:], -1, 0))
    planned, squares = np.zeros((1, n_times - 1, n_dof)), np.empty((n_columns, n_dof))
    sensor = np.tile([0.0, 1.0], (n_dof, 1))
    sums = []
    for g in range(gains.variances.shape[1]):
        own = np.stack([gains.velocity[1:, g, :, 0], gains.position[1:, g, :, 0]], axis=-1)
        feedback = np.broadcast_to(own @ move.T, (n_times - 1, n_dof, 2))
        closed_loop = move - feedback[..., None] * sensor[:, None, :]
        precisions = np.broadcast_to(1 / gains.variances[1:, g, :, 0], planned.shape[1:])
        shared = (np.ascontiguousarray(closed_loop), np.ascontiguousarray(feedback), sensor, np.ascontiguousarray(precisions))
        kernels.squared_innovations(*shared, series, planned, squares)
        sums.append(squares.sum(axis=0))
    return np.stack(sums)
