"""A movement with constant, unknown parameters: the second way to carry their uncertainty.

All that is unknown of an execution is drawn once, x = (p0, theta) of every signal, which are the degrees of freedom and the
sensor channels that were learned with them, and a task tells part of it:

    x = mean + F z,  z ~ N(0, P);    state[t] = rows[t] x + d[t],    o[t] = C state[t] + v[t],  v[t] ~ N(0, R)

What is seen early in a movement says how all of it will go. d is what the parameters leave over (`probdmp.dmp.deviations`).
What is told of an execution, its goal or its start velocity, is told of rows[t] x. Inference over z and d is in
`probdmp.gaussian.augmented`. Each signal has W of the z for itself, as many as its x has independent directions: F is block
diagonal, and how signals vary together is in P, whose diagonal is 1. So what is asked of a signal takes W columns, not S W.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, frozen
from probdmp.dmp.deviations import DeviationSystem, deviation_system, lasting_variances
from probdmp.dmp.goal_handling import conditioned_part
from probdmp.dmp.path_distribution import signal_distribution, signal_factors
from probdmp.dmp.primitive import Primitive
from probdmp.dmp.responses import GOAL, START_VELOCITY, parameter_responses
from probdmp.dmp.task import Task
from probdmp.dmp.transformation_system import POSITION
from probdmp.gaussian import Belief, linear_moments, observe

__all__ = [
    "JointExecutions",
    "JointModel",
    "joint_executions",
    "joint_model",
    "mean_positions",
    "state_designs",
    "state_rows",
]

START = 0
"""Where p0 is in x; the parameters follow, each one place further than in theta."""
TOLD_TOLERANCE = 1e-6
"""Standard deviation of a start velocity that was told, as a fraction of the range."""


class JointModel(NamedTuple):
    """x = means + factors z, and what is known about z; all arrays may have batch axes in front."""

    means: FloatArray
    """(*batch, S, N + 3) array, units of each signal."""
    factors: FloatArray
    """F, (*batch, S, N + 3, r) array, units of each signal, r = S W; 0 but for a signal's own W columns."""
    belief: Belief
    """Of z, (*batch, r)."""

    @property
    def blocks(self) -> FloatArray:
        """F without its zeros, (*batch, S, N + 3, W) array."""
        *batch, n_signals, n, r = self.factors.shape
        own = np.diagonal(self.factors.reshape(*batch, n_signals, n, n_signals, r // n_signals), axis1=-4, axis2=-2)
        return np.ascontiguousarray(np.moveaxis(own, -1, -3))

    def observed(self, rows: FloatArray, values: FloatArray, variances: FloatArray) -> "JointModel":
        """Given values (*batch, S) of rows (*batch, N + 3) of each signal; NaN where nothing was seen."""
        design = _design(self.factors, rows[..., None, :])[..., 0, :]
        return self._replace(belief=observe(self.belief, values - _along(self.means, rows), design, np.diag(variances)).belief)


class JointExecutions(NamedTuple):
    """A batch of N executions, ready to be observed."""

    model: JointModel
    """With the batch axis (N)."""
    rows: FloatArray
    """(T, N, 3, n_basis + 3) array: each state as a function of what is unknown."""
    system: DeviationSystem
    """With the batch axis (N)."""


def joint_model(primitive: Primitive, task: Task, end_rows: FloatArray) -> JointModel:
    """What is known about an execution before it begins.

    Parameters
    ----------
    task : one task, or a batch of tasks with leading axes `*batch`.
    end_rows : (*batch, N + 3) or (N + 3) array: the position at the end as a function of x, see `state_rows`.
    """
    batch, handling = task.start.shape[:-1], primitive.configuration.goal_handling
    mean, factor, prior = _start_and_parameters(primitive)
    unknown = np.isnan(task.start)
    if end_rows.shape[:-1] == (1,):  # what is told, and when it ends, is the same for all
        unknown = unknown[:1]
    factors = np.array(np.broadcast_to(factor, (*unknown.shape[:-1], *factor.shape)))
    factors[..., : primitive.n_dof, START, :] *= unknown[..., None]
    means = np.array(np.broadcast_to(mean, (*batch, *mean.shape)))
    means[..., : primitive.n_dof, START] = primitive.starts(task)
    belief = Belief(np.zeros((*unknown.shape[:-1], len(prior))), np.broadcast_to(prior, (*unknown.shape[:-1], *prior.shape)))
    model = JointModel(means, factors, belief)
    signals, n_untold = primitive.signals, len(primitive.channel_names)

    def of_signals(told: FloatArray) -> FloatArray:  # nobody tells a channel where it has to be
        return np.concatenate([told, np.full((*told.shape[:-1], n_untold), np.nan)], axis=-1)

    if task.start_velocity is not None:
        told = of_signals(task.start_velocity * task.duration[..., None])
        row = np.eye(mean.shape[-1])[START_VELOCITY + 1]
        model = _told(model, row, told, (TOLD_TOLERANCE * signals.ranges) ** 2, START_VELOCITY + 1, handling)
    left_over = signals.observation_variances + lasting_variances(primitive)
    tolerances = left_over if signals.residual_variances is None else signals.residual_variances
    # A goal that was not told stays where it was learned: from another start, the movement to it is another.
    moved = np.where(np.isnan(task.goal), primitive.start - primitive.starts(task), np.nan)
    model = _moved(model, end_rows, of_signals(moved), tolerances, GOAL + 1, handling)
    return _told(model, end_rows, of_signals(task.goal), tolerances, GOAL + 1, handling)


def state_rows(responses: FloatArray, duration: FloatArray) -> FloatArray:
    """Acceleration, velocity and position as linear functions of x.

    Parameters
    ----------
    responses : (*shape, 3, N + 2) array, in phase units; see `probdmp.dmp.responses`.
    duration : T_d, an array that broadcasts against `shape`, seconds.

    Returns
    -------
    (*shape, 3, N + 3) array.
    """
    scale = np.stack([duration**-2.0, duration**-1.0, np.ones_like(duration)], axis=-1)
    start = np.broadcast_to(np.eye(3)[POSITION][:, None], (*responses.shape[:-1], 1))
    return np.concatenate([start, responses * scale[..., None]], axis=-1)


def state_designs(model: JointModel, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values of one time as functions of z: offsets (*batch, S, k) and designs (*batch, S, k, r).

    Parameters
    ----------
    rows : (*batch, k, N + 3) array, of `state_rows`, or some of them.
    """
    return np.matmul(model.means, rows.mT), _design(model.factors, rows)


def joint_executions(primitive: Primitive, tasks: Task, dts: FloatArray, n_steps: int) -> JointExecutions:
    """What is known about executions before they begin.

    With one dt for all of them they last equally long and are told the same kinds of things: then all but the means is
    common to them, and has a batch axis of length 1.

    Parameters
    ----------
    tasks : a batch (N) of tasks.
    dts : (N) or (1) array, seconds.
    n_steps : T.
    """
    durations, configuration = tasks.duration[: len(dts)], primitive.configuration
    steps = dts / durations
    lasts = np.round(1 / steps).astype(np.intp)
    length = max(n_steps, int(lasts.max()) + 1)
    responses = np.stack([parameter_responses(configuration, float(step), length) for step in steps], axis=1)
    rows = state_rows(responses, durations)
    end_rows = rows[lasts, np.arange(len(steps)), POSITION]
    system = deviation_system(primitive, durations, dts)
    if n_steps < len(rows):  # a view would keep all of them
        rows = rows[:n_steps].copy()
    return JointExecutions(joint_model(primitive, tasks, end_rows), rows, system)


def mean_positions(executions: JointExecutions) -> FloatArray:
    """Expected values of all signals, (T, N, S) array."""
    model, positions = executions.model, executions.rows[:, :, POSITION]
    means = model.means + np.matmul(model.factors, model.belief.mean[:, None, :, None])[..., 0]
    return np.asarray(np.einsum("tkn,kdn->tkd", positions, means))


@lru_cache(maxsize=32)
def _start_and_parameters(primitive: Primitive) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean of x (S, N + 3), F (S, N + 3, r) and P (r, r) of executions whose start is not known; kept, since read-only."""
    d, n = primitive.n_dof, primitive.configuration.n_basis + 3
    mean, parameters = signal_distribution(primitive)
    mean[:d, START] = primitive.start
    covariance, own = parameters.reshape(len(mean), n, len(mean), n), np.arange(d)
    covariance[own, START, own, START] = primitive.start_covariances[:, 1, 1]
    covariance[own, START, own, START_VELOCITY + 1] = primitive.start_covariances[:, 0, 1]
    covariance[own, START_VELOCITY + 1, own, START] = primitive.start_covariances[:, 0, 1]
    blocks, prior = signal_factors(parameters, len(mean))
    factors = np.zeros((len(mean), n, len(mean), blocks.shape[-1]))
    factors[np.arange(len(mean)), :, np.arange(len(mean))] = blocks
    return frozen(mean), frozen(factors.reshape(len(mean), n, -1)), frozen(prior)


def _told(
    model: JointModel, row: FloatArray, values: FloatArray, tolerances: FloatArray, column: int, handling: str
) -> JointModel:
    """Given values (*batch, S) of one row of x, as far as the model has them; the rest moves a column of x."""
    expected, covariance = _expected(model, row, values, tolerances)
    delta = np.where(np.isnan(values), 0.0, values - expected)
    inside = conditioned_part(delta, covariance, handling)
    told = model.observed(row, np.where(np.isnan(values), np.nan, expected + inside), tolerances)
    means = told.means.copy()
    means[..., column] += delta - inside
    return told._replace(means=means)


def _moved(
    model: JointModel, row: FloatArray, deltas: FloatArray, tolerances: FloatArray, column: int, handling: str
) -> JointModel:
    """The mean as if the row were told to be `deltas` from where it is, (*batch, S); as uncertain as before."""
    if not np.any(deltas > 0) and not np.any(deltas < 0):
        return model
    expected, _ = _expected(model, row, deltas, tolerances)
    told = _told(model, row, expected + deltas, tolerances, column, handling)
    return told._replace(belief=Belief(told.belief.mean, model.belief.covariance))


def _expected(model: JointModel, row: FloatArray, values: FloatArray, tolerances: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (*batch, S) of one row of x, and its covariance, with a unit in place of what has no value."""
    mean, covariance = linear_moments(model.belief, _design(model.factors, row[..., None, :])[..., 0, :])
    seen = ~np.isnan(values)
    full = covariance + tolerances[..., None] * np.eye(len(tolerances))
    both = seen[..., :, None] & seen[..., None, :]
    return _along(model.means, row) + mean, np.where(both, full, np.eye(len(tolerances)))


def _along(means: FloatArray, row: FloatArray) -> FloatArray:
    return np.asarray(np.sum(means * row[..., None, :], axis=-1))


def _design(factors: FloatArray, rows: FloatArray) -> FloatArray:
    """Rows (*batch, n, N + 3) of each signal as functions of z, (*batch, S, n, r)."""
    return np.matmul(rows[..., None, :, :], factors)
