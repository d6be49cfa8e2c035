"""A movement with constant, unknown parameters: the second way to carry their uncertainty.

All that is unknown of an execution is drawn once, x = (p0, theta) of every signal, which are the degrees of freedom and the
sensor channels that were learned with them, and a task tells part of it:

    x = mean + F z,  z ~ N(0, P);    state[t] = rows[t] x + d[t],    o[t] = C state[t] + v[t],  v[t] ~ N(0, R)

What is seen early in a movement says how all of it will go. d is what the parameters leave over (`probdmp.dmp.deviations`).
What is told of an execution, its goal or its start velocity, is told of rows[t] x. Inference over z and d is in
`probdmp.gaussian.augmented`. Each signal has W of the z for itself, as many as its x has independent directions: F is block
diagonal, and how signals vary together is in P, whose diagonal is 1. So what is asked of a signal takes W columns, not S W.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from probdmp.checks import BoolArray, FloatArray, frozen
from probdmp.dmp.deviations import DeviationSystem, deviation_system, lasting_variances
from probdmp.dmp.goal_handling import conditioned_part
from probdmp.dmp.path_distribution import signal_distribution, signal_factors
from probdmp.dmp.primitive import Primitive
from probdmp.dmp.responses import GOAL, LONGEST_KEPT, START_VELOCITY, parameter_responses
from probdmp.dmp.task import Task
from probdmp.dmp.transformation_system import POSITION
from probdmp.gaussian import Belief, observe
from probdmp.kept import Kept

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
MOST_KEPT_BYTES = 2**26
"""Of settings together, and of lessons together, that are kept for later executions."""


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


class _Lesson(NamedTuple):
    """What is told of a row of x teaches as much of the rest, whatever is told."""

    row: FloatArray
    """(*batch, N + 3) array."""
    covariance: FloatArray
    """Of what was expected, with a unit in place of what is not told; (*batch, S, S) array."""
    gain: FloatArray
    """How it moves x, (*batch, S (N + 3), S) array."""


class _Lessons(NamedTuple):
    """All that executions which are told the same kinds of things have in common."""

    factors: FloatArray
    """F, (*batch, S, N + 3, r) array."""
    velocity: _Lesson | None
    moved: _Lesson | None
    """Of a goal that stays where it was learned, while the start does not: it leaves z as uncertain as it was."""
    goal: _Lesson | None
    covariance: FloatArray
    """Of z, in the end."""

    @property
    def n_bytes(self) -> int:
        """About how much memory it takes."""
        return self.factors.nbytes + self.covariance.nbytes


class _Setting(NamedTuple):
    """What executions that last equally long, at one rate, have in common."""

    rows: FloatArray
    """(T, N, 3, n_basis + 3) array, read-only: each state as a function of what is unknown."""
    end_rows: FloatArray
    """(N, n_basis + 3) array, read-only: the position at the end."""
    system: DeviationSystem

    @property
    def n_bytes(self) -> int:
        """About how much memory it takes."""
        return self.rows.nbytes


_SETTINGS: Kept[_Setting] = Kept(MOST_KEPT_BYTES)
_LESSONS: Kept[_Lessons] = Kept(MOST_KEPT_BYTES)


class JointExecutions(NamedTuple):
    """A batch of N executions, ready to be observed."""

    model: JointModel
    """With the batch axis (N)."""
    rows: FloatArray
    """(T, N, 3, n_basis + 3) array: each state as a function of what is unknown."""
    system: DeviationSystem
    """With the batch axis (N)."""


def joint_model(primitive: Primitive, task: Task, end_rows: FloatArray) -> JointModel:
    """What is known about an execution before it begins; what is told moves the means of x, and the mean of z is 0.

    Parameters
    ----------
    task : one task, or a batch of tasks with leading axes `*batch`.
    end_rows : (*batch, N + 3) or (N + 3) array: the position at the end as a function of x, see `state_rows`.
    """
    batch, handling = task.start.shape[:-1], primitive.configuration.goal_handling
    untold = np.full((*batch, len(primitive.channel_names)), np.nan)  # nobody tells a channel where it has to be
    velocity = np.full(task.start.shape, np.nan) if task.start_velocity is None else task.start_velocity
    velocities = np.concatenate([velocity * task.duration[..., None], untold], axis=-1)
    # A goal that was not told stays where it was learned: from another start, the movement to it is another.
    moves = np.where(np.isnan(task.goal), primitive.start - primitive.starts(task), np.nan)
    moves, goals = (np.concatenate([values, untold], axis=-1) for values in (moves, task.goal))
    stays = ~np.isnan(moves)
    moved = stays & np.any(stays & (moves != 0))
    kinds: tuple[BoolArray, ...] = (np.isnan(task.start), ~np.isnan(velocities), moved, ~np.isnan(goals))
    if end_rows.shape[:-1] == (1,):  # what is told, and when it ends, is the same for all
        kinds = (kinds[0][:1], *(kind[:1] if np.all(kind == kind[:1]) else kind for kind in kinds[1:]))
    factors, of_velocity, of_move, of_goal, covariance = _lessons_of(primitive, end_rows, kinds)
    mean = _start_and_parameters(primitive)[0]
    means = np.array(np.broadcast_to(mean, (*batch, *mean.shape)))
    means[..., : primitive.n_dof, START] = primitive.starts(task)
    if of_velocity is not None:
        means = _told(means, of_velocity, velocities - _products(means, of_velocity.row), START_VELOCITY + 1, handling)
    if of_move is not None:
        means = _told(means, of_move, moves, GOAL + 1, handling)
    if of_goal is not None:
        means = _told(means, of_goal, goals - _products(means, of_goal.row), GOAL + 1, handling)
    return JointModel(means, factors, Belief(np.zeros((*covariance.shape[:-2], factors.shape[-1])), covariance))


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
    durations = tasks.duration[: len(dts)]
    if len(dts) == 1 and n_steps <= LONGEST_KEPT:  # executions often differ in nothing but what they are told
        key = (primitive.identity, float(durations[0]), float(dts[0]), n_steps)
        setting = _SETTINGS.get(key, lambda: _setting(primitive, durations, dts, n_steps))
    else:
        setting = _setting(primitive, durations, dts, n_steps)
    return JointExecutions(joint_model(primitive, tasks, setting.end_rows), setting.rows, setting.system)


def _setting(primitive: Primitive, durations: FloatArray, dts: FloatArray, n_steps: int) -> _Setting:
    phase_steps, configuration = dts / durations, primitive.configuration
    lasts = np.round(1 / phase_steps).astype(np.intp)
    length = max(n_steps, int(lasts.max()) + 1)
    responses = np.stack([parameter_responses(configuration, float(step), length) for step in phase_steps], axis=1)
    rows = state_rows(responses, durations)
    end_rows = rows[lasts, np.arange(len(phase_steps)), POSITION]
    system = deviation_system(primitive, durations, dts)
    if n_steps < len(rows):  # a view would keep all of them
        rows = rows[:n_steps].copy()
    for array in (rows, end_rows):
        array.setflags(write=False)
    return _Setting(rows, end_rows, system)


def mean_positions(executions: JointExecutions) -> FloatArray:
    """Expected values of all signals, (T, N, S) array."""
    return np.asarray(np.einsum("tkn,kdn->tkd", executions.rows[:, :, POSITION], executions.model.means))


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


def _lessons_of(primitive: Primitive, end_rows: FloatArray, kinds: tuple[BoolArray, ...]) -> _Lessons:
    """What is told teaches; kept where it is told of one execution, or of all alike.

    Parameters
    ----------
    kinds : whether the start is unknown, (*batch, D), and whether the start velocity is told, the goal has to be moved with the
        start, and the goal is told, (*batch, S) arrays.
    """
    if any(math.prod(kind.shape[:-1]) != 1 for kind in (end_rows, *kinds)):
        return _lessons(primitive, end_rows, *kinds)
    key = (primitive.identity, end_rows.shape, end_rows.tobytes(), *(kind.tobytes() for kind in kinds))
    return _LESSONS.get(key, lambda: _lessons(primitive, end_rows, *kinds))


def _lessons(
    primitive: Primitive, end_rows: FloatArray, unknown: BoolArray, velocity: BoolArray, moved: BoolArray, goal: BoolArray
) -> _Lessons:
    (_, learned, prior), signals = _start_and_parameters(primitive), primitive.signals
    factors = np.array(np.broadcast_to(learned, (*unknown.shape[:-1], *learned.shape)))
    factors[..., : primitive.n_dof, START, :] *= unknown[..., None]
    left_over = signals.observation_variances + lasting_variances(primitive)
    tolerances = left_over if signals.residual_variances is None else signals.residual_variances
    covariance = np.broadcast_to(prior, (*unknown.shape[:-1], *prior.shape))

    def lesson(row: FloatArray, told: BoolArray, tolerances: FloatArray) -> tuple[_Lesson | None, FloatArray]:
        if not told.any():
            return None, covariance
        design = _design(factors, row[..., None, :])[..., 0, :]
        before = Belief(np.zeros(covariance.shape[:-1]), covariance)
        seen = observe(before, np.where(told, 0.0, np.nan), design, np.diag(tolerances))
        both = told[..., :, None] & told[..., None, :]
        expected = np.where(both, seen.innovation_covariance, np.eye(len(tolerances)))
        moving = factors.reshape(*factors.shape[:-3], -1, factors.shape[-1]) @ seen.gain @ seen.whitening
        return _Lesson(row, expected, moving), seen.belief.covariance

    row = np.eye(learned.shape[-2])[START_VELOCITY + 1]
    of_velocity, covariance = lesson(row, velocity, (TOLD_TOLERANCE * signals.ranges) ** 2)
    of_move, _ = lesson(end_rows, moved, tolerances)
    of_goal, covariance = lesson(end_rows, goal, tolerances)
    for array in (factors, covariance):  # they may be in the model of every execution of the kind
        array.setflags(write=False)
    return _Lessons(factors, of_velocity, of_move, of_goal, covariance)


def _told(means: FloatArray, lesson: _Lesson, deltas: FloatArray, column: int, handling: str) -> FloatArray:
    """Means of x if a row is told to be `deltas` (*batch, S) from where it is expected, NaN where it is not told.

    As far as the model has them it is conditioned on them; the rest moves a column of x.
    """
    deltas = np.where(np.isnan(deltas), 0.0, deltas)
    inside = conditioned_part(deltas, lesson.covariance, handling)
    moved = means + _products(lesson.gain, inside).reshape(means.shape)
    moved[..., column] += deltas - inside
    return moved


def _products(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Matrices (*batch, a, b) times vectors (*batch, b), (*batch, a) array: one product where one matrix is for all."""
    if matrices.shape[:-2] == (1,):
        return vectors @ matrices[0].T
    return np.matmul(matrices, vectors[..., None])[..., 0]


def _design(factors: FloatArray, rows: FloatArray) -> FloatArray:
    """Rows (*batch, n, N + 3) of each signal as functions of z, (*batch, S, n, r)."""
    return np.matmul(rows[..., None, :, :], factors)
