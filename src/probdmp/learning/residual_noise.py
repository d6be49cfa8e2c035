"""What the parameters of the demonstrations leave over: deviations driven by white forcing noise, and the sensors' own noise.

    r_k[t] = y_k[t] - H[t] m_k = d_k[t] + v_k[t],    d[t] = A d[t-1] + B eps[t-1],  eps ~ N(0, 1 / beta),    v ~ N(0, R)

m_k is theta of demonstration k given all of it, C what is not known about it. beta and R of each signal maximise the
expected log-likelihood of the residuals under a Kalman filter,

    E ln p = -1/2 sum_kt [ln S_k[t] + (e_k[t]^2 + c_k[t]) / S_k[t]]

e the innovation of r_k, c the variance of the innovation of H theta_k, theta_k ~ N(0, C). Only the ratio of 1 / beta to R needs
a search: scaled together, they scale S, and the best scale is the mean of (e^2 + c) / S. A grid of ratios is filtered at once.
Source: Durbin & Koopman, Time Series Analysis by State Space Methods, section 2.10, the concentrated likelihood.
"""

import math
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive, Task
from probdmp.dmp.deviations import DeviationSystem, deviation_system, lasting_variances
from probdmp.dmp.joint_model import JointExecutions, joint_executions
from probdmp.dmp.transformation_system import POSITION, VELOCITY
from probdmp.gaussian import kernels
from probdmp.gaussian.scalar_systems import ScalarSystems, filter_scalar_systems

__all__ = ["with_residual_noise"]

RATIOS = 10.0 ** np.arange(-3, 10)
"""Of the variance of a deviation that has gone on for long to R."""
FINER = 10.0 ** np.arange(-0.75, 1.0, 0.25)
LEAST_VARIANCE = 1e-12
"""Least R, as a fraction of the squared range."""
MOST_TIMES = 100
"""How many times of a demonstration tell its parameters, about; residuals closer than that are not independent."""

SIDE_BY_SIDE = 256
"""Residuals that are filtered at once, about: more would not stay in the cache."""


class _Residuals(NamedTuple):
    errors: FloatArray
    """r, (T, S, K) array, data units; NaN at the start, which is told, and after the end of a demonstration."""
    spreads: FloatArray
    """(T, S, q) array, data units: a square root of the covariance H C H^T of one demonstration, of middle length."""
    typical: int
    """Which one."""


class _Filtered(NamedTuple):
    """Of G ratios, and residuals as above, without NaN."""

    squares: FloatArray
    """Sums of e^2 / S, (G, S, K) array."""
    logs: FloatArray
    """Sums of ln S, (G, S, K) array."""
    gains: FloatArray
    """Of velocity and position of the typical demonstration, (T, G, S, 2) array."""
    variances: FloatArray
    """S of the same, (T, G, S) array."""


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
    (offsets, factors, (mean, prior)), rows = executions.model, np.moveaxis(executions.rows[..., POSITION, :], 0, 1)
    (k, *_, r), step = factors.shape, -(-len(observed) // MOST_TIMES)
    values = np.moveaxis(observed, 0, -1)  # (K, S, T)
    seen = ~np.isnan(values)
    seen[..., 0] = False
    errors = np.nan_to_num(values) - (offsets + np.matmul(factors, mean[:, None, :, None])[..., 0]) @ rows.mT
    weights, some = (seen / primitive.signals.observation_variances[:, None])[..., ::step], rows[:, ::step]
    of_parameters = (some.mT[:, None] * weights[..., None, :]) @ some[:, None]  # what is seen of those of each signal
    all_factors = factors.reshape(k, -1, r)
    information = all_factors.mT @ (of_parameters @ factors).reshape(k, -1, r)
    score = all_factors.mT @ ((weights * errors[..., ::step]) @ some).reshape(k, -1, 1)
    inverse = np.eye(r) + prior @ information
    moved = np.matmul(factors, np.linalg.solve(inverse, prior @ score)[:, None])[..., 0]  # (K, S, N + 3)
    left = np.where(seen, errors - moved @ rows.mT, np.nan)
    lengths = observed.shape[0] - np.argmax(np.logical_or.reduce(seen, axis=1)[:, ::-1], axis=-1)
    typical = int(np.argsort(lengths)[k // 2])
    covariance = np.linalg.solve(inverse[typical], prior[typical if len(prior) > 1 else 0])
    return _Residuals(left.T, _path_roots(rows[typical, : lengths[typical]], factors[typical], covariance), typical)


def _path_roots(rows: FloatArray, factors: FloatArray, covariance: FloatArray) -> FloatArray:
    """Square roots of the covariances of paths of each signal, (T, S, q) array, q at most N + 3.

    Parameters
    ----------
    rows : (T, N + 3) array.
    factors : of each signal, (S, N + 3, r) array.
    covariance : of z, (r, r) array.
    """
    orthogonal, upper = np.linalg.qr(rows)
    designs = upper @ factors
    of_paths = designs @ covariance @ designs.mT
    eigenvalues, vectors = np.linalg.eigh((of_paths + of_paths.mT) / 2)
    return np.moveaxis(orthogonal @ (vectors * np.sqrt(np.maximum(eigenvalues, 0.0))[:, None]), 0, 1)


def _likelihoods(residuals: _Residuals, system: DeviationSystem, variances: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Concentrated log-likelihood but for a constant, and the best R, (G, S) arrays.

    Parameters
    ----------
    system : of the K demonstrations, driven by unit noise.
    variances : 1 / (beta R), (G, S or 1) array.
    """
    errors, spreads, typical = residuals
    n_ratios, (_, n_signals, k) = len(variances), errors.shape
    variances = np.broadcast_to(variances, (n_ratios, n_signals))
    together = max(1, SIDE_BY_SIDE // (n_signals * k))
    parts = [_filtered(errors, system, variances[g : g + together], typical) for g in range(0, n_ratios, together)]
    filtered = _Filtered(*(np.concatenate(x, axis=a) for x, a in zip(zip(*parts, strict=True), (0, 0, 1, 1), strict=True)))
    n, move = np.sum(~np.isnan(errors[:, 0])), system.transition[typical, 0, VELOCITY:, VELOCITY:]
    scales = filtered.squares.sum(axis=-1) / n + _squared_spreads(spreads, filtered, move) / (len(spreads) - 1)
    return -0.5 * (n * np.log(scales) + filtered.logs.sum(axis=-1)), scales


def _filtered(errors: FloatArray, system: DeviationSystem, variances: FloatArray, typical: int) -> _Filtered:
    """Residuals filtered for a sensor of unit variance and inputs of the given variances, (G, S)."""
    n_times, n_signals, k = errors.shape
    shape = (len(variances), n_signals, k)
    m = math.prod(shape)

    def of_all(array: FloatArray, *core: int) -> FloatArray:
        return np.ascontiguousarray(np.broadcast_to(array, (*shape, *core))).reshape(m, *core)

    systems = ScalarSystems(
        of_all(system.transition[:, 0, VELOCITY:, VELOCITY:], 2, 2),
        of_all(system.input_vector[:, 0, VELOCITY:], 2),
        np.zeros((n_times - 1, m, 2)),
        np.tile(of_all(variances[..., None] * system.variances[:, 0]), (n_times - 1, 1)),
        np.tile([0.0, 1.0], (m, 1)),
        np.ones(m),
        np.zeros((m, 2)),
        np.zeros((m, 2, 2)),
    )
    observed = np.broadcast_to(errors[:, None], (n_times, *shape)).reshape(n_times, m)
    found = filter_scalar_systems(systems, observed)
    counted = ~np.isnan(observed)
    squares = np.sum(np.where(counted, found.innovations, 0.0) ** 2 / found.variances, axis=0).reshape(shape)
    logs = np.sum(np.log(found.variances), axis=0, where=counted).reshape(shape)
    gains, spread = found.gains.reshape(n_times, *shape, 2), found.variances.reshape(n_times, *shape)
    return _Filtered(squares, logs, gains[..., typical, :], spread[..., typical])


def _squared_spreads(spreads: FloatArray, filtered: _Filtered, move: FloatArray) -> FloatArray:
    """The same sums of all columns of `spreads`, (T, S, q), which share the gains of the typical demonstration: (G, S) array.

    Parameters
    ----------
    move : A of velocity and position, (2, 2).
    """
    n_times, n_signals, n_columns = spreads.shape
    series = np.ascontiguousarray(np.moveaxis(spreads[1:], -1, 0))
    planned, squares = np.zeros((1, n_times - 1, n_signals)), np.empty((n_columns, n_signals))
    sensor = np.tile([0.0, 1.0], (n_signals, 1))
    sums = []
    for g in range(filtered.gains.shape[1]):
        feedback = filtered.gains[1:n_times, g] @ move.T
        closed_loop = move - feedback[..., None] * sensor[:, None, :]
        precisions = 1 / filtered.variances[1:n_times, g]
        kernels.squared_innovations(closed_loop, feedback, sensor, precisions, series, planned, squares)
        sums.append(squares.sum(axis=0))
    return np.stack(sums)
