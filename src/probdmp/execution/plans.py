"""What is expected of executions before anything is measured."""

from collections.abc import Hashable

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive, Task
from probdmp.dmp.joint_model import JointExecutions

__all__ = ["kind_of_task", "planned_states"]


def kind_of_task(primitive: Primitive, task: Task, dt: float) -> tuple[Hashable, ...]:
    """What executions have in common that are equally uncertain before anything is measured.

    Parameters
    ----------
    task : a batch of those that last equally long and are told the same kinds of things.
    """
    told = [np.isnan(part[0]).tobytes() for part in (task.start, task.goal, task.start_velocity) if part is not None]
    return primitive.identity, float(task.duration[0]), dt, *told


def planned_states(executions: JointExecutions) -> FloatArray:
    """The states expected without observations, (T, N, S, 3) array; rows may have a batch axis of length 1."""
    means, rows = executions.model.means, executions.rows
    if rows.shape[1] == 1:
        n_times, _, k, n = rows.shape  # one product of matrices for all
        states = rows.reshape(-1, n) @ means.reshape(-1, n).T
        return np.ascontiguousarray(np.moveaxis(states.reshape(n_times, k, *means.shape[:2]), 1, -1))
    return np.asarray(np.einsum("tbkn,bsn->tbsk", rows, means, optimize=True))
