"""Rollouts of tasks of a kind: what they have in common, computed once.

How uncertain a movement is follows from the primitive, its duration, the step, and which of start, velocity and goal are told,
not from their values. With independent weights the mean is a linear function of these, and that function is kept:

    mean[t] = origin[t] + start of_start[t] + velocity of_velocity[t] + goal of_goal[t]

Where the forcing term grows with the distance to the goal, so does its part of the covariance, with the square.
"""

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from probdmp.checks import FloatArray, freeze_arrays
from probdmp.dmp import Primitive, Task, linear_gaussian_model
from probdmp.dmp.joint_model import JointExecutions
from probdmp.dmp.responses import LONGEST_KEPT
from probdmp.execution.joint_filtering import joint_covariances
from probdmp.execution.kept import Kept
from probdmp.execution.plans import planned_states
from probdmp.gaussian import GaussianSequence, filter_sequence

__all__ = ["roll_out_independent", "roll_out_joint"]

MOST_KEPT_BYTES = 2**26
"""Of each kind of plans."""


@dataclass(frozen=True, slots=True, eq=False)
class JointPlan:
    """Of tasks of a kind, each of T steps and S signals."""

    covariances: FloatArray
    """(T, 1, S, 3, 3) array."""

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def n_bytes(self) -> int:
        """How much memory it takes."""
        return self.covariances.nbytes


@dataclass(frozen=True, slots=True, eq=False)
class IndependentPlan:
    """The same, with its mean."""

    origin: FloatArray
    """(T, 1, D, 3) array: the mean from zero, without velocity, to zero."""
    responses: FloatArray
    """(3, T, 1, D, 3) array: what a unit of start, velocity and goal adds to it."""
    covariances: FloatArray
    """(T, 1, D, 3, 3) array: of an amplitude of zero, where there is amplitude scaling."""
    of_amplitudes: FloatArray | None
    """(T, 1, D, 3, 3) array: what a squared amplitude of one adds, where there is."""

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def n_bytes(self) -> int:
        """How much memory it takes."""
        arrays = (self.origin, self.responses, self.covariances, self.of_amplitudes)
        return sum(array.nbytes for array in arrays if array is not None)


_JOINT: Kept[JointPlan] = Kept(MOST_KEPT_BYTES)
_INDEPENDENT: Kept[IndependentPlan] = Kept(MOST_KEPT_BYTES)


def roll_out_joint(primitive: Primitive, tasks: Task, dt: float, executions: JointExecutions) -> GaussianSequence:
    """The states of a task, a batch of one: (T, 1, S, 3) and (T, 1, S, 3, 3).

    Parameters
    ----------
    executions : its own, before anything was seen.
    """
    key = _kind(primitive, tasks, dt, len(executions.rows))
    plan = _JOINT.get(key, lambda: JointPlan(joint_covariances(executions)))
    return GaussianSequence(planned_states(executions), plan.covariances)


def roll_out_independent(primitive: Primitive, tasks: Task, dt: float, n_steps: int) -> GaussianSequence:
    """The same of independent weights, with the axes (T, 1, D)."""
    if n_steps > LONGEST_KEPT:
        return filter_sequence(linear_gaussian_model(primitive, tasks, np.array([dt]), n_steps)).filtered
    plan = _INDEPENDENT.get(_kind(primitive, tasks, dt, n_steps), lambda: _independent_plan(primitive, tasks, dt, n_steps))
    given = tasks.start_velocity
    learned = primitive.start_velocities / tasks.duration[:, None]
    velocities = learned if given is None else np.where(np.isnan(given), learned, given)
    told = np.stack([primitive.starts(tasks), velocities, primitive.goals(tasks)])
    means, covariances = plan.origin + np.einsum("kbd,ktbds->tbds", told, plan.responses), plan.covariances
    if plan.of_amplitudes is not None:
        covariances = covariances + primitive.amplitudes(tasks)[..., None, None] ** 2 * plan.of_amplitudes
    return GaussianSequence(means, covariances)


def _kind(primitive: Primitive, tasks: Task, dt: float, n_steps: int) -> tuple[Hashable, ...]:
    told = [np.isnan(part).tobytes() for part in (tasks.start, tasks.goal, tasks.start_velocity) if part is not None]
    return primitive.identity, float(tasks.duration[0]), dt, n_steps, *told


def _independent_plan(primitive: Primitive, tasks: Task, dt: float, n_steps: int) -> IndependentPlan:
    """From rollouts of six tasks: from zero to zero, three with a range more of one of them, and two that are told as little as
    the given one, of amplitudes zero and one where there is scaling.
    """
    duration, nothing = float(tasks.duration[0]), np.zeros(primitive.n_dof)
    units = np.stack([primitive.ranges, primitive.ranges / duration, _displacements(primitive)])
    starts, velocities, goals = np.zeros((3, 6, primitive.n_dof))
    starts[1], velocities[2], goals[3] = units
    starts[4:] = np.where(np.isnan(tasks.start), np.nan, 0.0)
    velocities[4:] = np.nan if tasks.start_velocity is None else np.where(np.isnan(tasks.start_velocity), np.nan, 0.0)
    goals[4:] = primitive.starts(Task(starts[4], nothing, np.asarray(duration)))
    goals[5] += units[2]
    asked = Task(starts, goals, np.full(6, duration), velocities)
    means, covariances = filter_sequence(linear_gaussian_model(primitive, asked, np.array([dt]), n_steps)).filtered
    responses = np.moveaxis(means[:, 1:4] - means[:, :1], 1, 0)[:, :, None] / units[:, None, None, :, None]
    is_scaled = any(primitive.scaled)
    of_amplitudes = covariances[:, 5:] - covariances[:, 4:5] if is_scaled else None
    return IndependentPlan(means[:, :1].copy(), responses, covariances[:, 4:5].copy(), of_amplitudes)


def _displacements(primitive: Primitive) -> FloatArray:
    """(D,) array: of goals that make an amplitude of one; the range of what is not scaled."""
    return np.where(primitive.scaled, primitive.goal_displacements, primitive.ranges)
