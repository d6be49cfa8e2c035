"""What is expected of executions before anything is measured."""

from collections.abc import Hashable

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive, Task
from probdmp.dmp.joint_model import JointExecutions

__all__ = ["kind_of_task", "planned_outputs", "planned_states"]


def kind_of_task(primitive: Primitive, task: Task, dt: float) -> tuple[Hashable, ...]:
    """What executions have in common that are equally uncertain before anything is measured; task may have a batch axis."""
    told = [np.isnan(part).tobytes() for part in (task.start, task.goal, task.start_velocity) if part is not None]
    return primitive.identity, float(task.duration[0]), dt, *told


def planned_states(executions: JointExecutions) -> FloatArray:
    """The states expected without observations, (T, N, S, 3) array; rows may have a batch axis of length 1."""
    model, rows = executions.model, executions.rows
    means = model.means + np.matmul(model.factors, model.belief.mean[:, None, :, None])[..., 0]
    if rows.shape[1] == 1:
        n_times, _, k, n = rows.shape  # one product of matrices for all
        states = rows.reshape(-1, n) @ means.reshape(-1, n).T
        return np.ascontiguousarray(np.moveaxis(states.reshape(n_times, k, *means.shape[:2]), 1, -1))
    return np.asarray(np.einsum("tbkn,bsn->tbsk", rows, means, optimize=True))


def planned_outputs(executions: JointExecutions, sensors: FloatArray) -> FloatArray:
    """What is expected of sensors C (O, 3 S) without observations, (N, T, O) array; rows have a batch axis of length 1."""
    model, rows = executions.model, executions.rows[:, 0]
    if len(model.factors) == 1:  # one product of matrices for all executions
        means = model.means + np.tensordot(model.belief.mean, model.factors[0], axes=(1, 2))
    else:
        means = model.means + np.matmul(model.factors, model.belief.mean[:, None, :, None])[..., 0]
    by_state = sensors.reshape(len(sensors), -1, 3)
    outputs = np.einsum("osk,tkn->tosn", by_state, rows).reshape(len(rows) * len(sensors), -1)
    return np.asarray(means.reshape(len(means), -1) @ outputs.T).reshape(-1, len(rows), len(sensors))
