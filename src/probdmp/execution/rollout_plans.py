"""Rollouts of tasks of a kind: what they have in common, computed once.

How uncertain a movement is follows from the primitive, its duration, the step, and which of start, velocity and goal are told,
not from their values.
"""

from dataclasses import dataclass

from probdmp.checks import FloatArray, freeze_arrays
from probdmp.dmp import Primitive, Task
from probdmp.dmp.joint_model import JointExecutions
from probdmp.execution.joint_filtering import joint_covariances
from probdmp.execution.plans import kind_of_task, planned_states
from probdmp.gaussian import GaussianSequence
from probdmp.kept import Kept

__all__ = ["roll_out_joint"]

MOST_KEPT_BYTES = 2**26
"""Of all plans together."""


@dataclass(frozen=True, slots=True, eq=False)
class RolloutPlan:
    """Of tasks of a kind, each of T steps and S signals."""

    covariances: FloatArray
    """(T, 1, S, 3, 3) array."""

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def n_bytes(self) -> int:
        """How much memory it takes."""
        return self.covariances.nbytes


_KEPT: Kept[RolloutPlan] = Kept(MOST_KEPT_BYTES)


def roll_out_joint(primitive: Primitive, tasks: Task, dt: float, executions: JointExecutions) -> GaussianSequence:
    """The states of a task, a batch of one: (T, 1, S, 3) and (T, 1, S, 3, 3).

    Parameters
    ----------
    executions : its own, before anything was seen.
    """
    key = (*kind_of_task(primitive, tasks, dt), len(executions.rows))
    plan = _KEPT.get(key, lambda: RolloutPlan(joint_covariances(executions)))
    return GaussianSequence(planned_states(executions), plan.covariances)
