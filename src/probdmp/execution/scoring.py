"""Log-likelihoods of many executions, those that are alike side by side.

Executions that last equally long, are told the same kinds of things and are measured completely share their gains, so that a
score is a linear function of readings, squared. The others are filtered one by one.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.demonstrations import Demonstration
from probdmp.dmp import Primitive, Task, linear_gaussian_model, stack_tasks, take_tasks, unstack_tasks
from probdmp.dmp.joint_model import joint_executions
from probdmp.errors import InputError
from probdmp.execution.complete_readings import CompleteReadings, complete_readings
from probdmp.execution.execution_batch import ExecutionBatch
from probdmp.execution.gain_schedule import gain_schedule, kind_of
from probdmp.execution.independent_filtering import sensed_system
from probdmp.execution.plans import planned_states
from probdmp.execution.readings import stack_readings
from probdmp.execution.recordings import BATCH_SIZE, check_recordings, check_tasks, filter_recordings
from probdmp.execution.sensor_array import SensorArray
from probdmp.gaussian import score_series, shared_gains, shifted_paths
from probdmp.kept import Kept

__all__ = ["score_batch", "score_recordings"]

FEW = 4
"""Executions for which it does not pay to compute gains once for all."""
LARGEST_GAUSSIAN = 1024
"""Readings of outputs that look at the same signals up to which all of them together are one draw from a Gaussian."""
MOST_KEPT_BYTES = 2**27
"""Of what is kept of complete readings for later executions."""
_KEPT: Kept[CompleteReadings] = Kept(MOST_KEPT_BYTES)


def score_recordings(
    primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration], sensors: SensorArray | None = None
) -> FloatArray:
    """Total log-likelihood of each recording given its task, (N,) array, nats."""
    check_tasks(tasks, recordings)
    array = SensorArray(primitive) if sensors is None else sensors
    lengths: dict[tuple[int, float], list[int]] = {}
    for k, recording in enumerate(recordings):
        lengths.setdefault((recording.n_samples, recording.dt), []).append(k)
    scores = np.empty(len(recordings))
    for (_, dt), members in lengths.items():
        own = [recordings[k] for k in members]
        check_recordings(primitive, own)
        batch = ExecutionBatch(stack_readings(array, own).swapaxes(0, 1), stack_tasks([tasks[k] for k in members]), dt)
        scores[members] = score_batch(primitive, batch, array)
    return scores


def score_batch(primitive: Primitive, batch: ExecutionBatch, sensors: SensorArray | None = None) -> FloatArray:
    """Total log-likelihood of each execution given its task, (N,) array, nats."""
    array = SensorArray(primitive) if sensors is None else sensors
    if batch.observations.shape[2] != len(array.outputs):
        raise InputError(
            f"executions of {len(array.outputs)} outputs of sensors ({', '.join(array.outputs)})",
            f"{batch.observations.shape[2]}",
        )
    score, scores = _score_for(primitive, array), np.full(len(batch), np.nan)
    if score is not None:
        for members in _alike(batch):
            if len(members) >= FEW:
                own = batch if len(members) == len(batch) else batch.take(members)
                scores[members] = score(primitive, own, array)
    rest = np.flatnonzero(np.isnan(scores))
    if len(rest):
        scores[rest] = _score_singly(primitive, batch.take(rest), array)
    return scores


def _alike(batch: ExecutionBatch) -> Iterator[IntArray]:
    """Which complete executions last equally long and are told the same kinds of things."""
    complete = np.flatnonzero(np.isfinite(np.einsum("nto->n", batch.observations)))
    task = batch.tasks
    told = [np.isnan(part) for part in (task.start, task.goal, task.start_velocity) if part is not None]
    keys = np.column_stack([task.duration, *told])[complete]
    if len(keys) and np.all(keys == keys[0]):
        yield complete
        return
    _, kinds = np.unique(keys, axis=0, return_inverse=True)
    for kind in range(int(kinds.max(initial=-1)) + 1):
        yield complete[kinds == kind]


def _score_for(
    primitive: Primitive, array: SensorArray
) -> Callable[[Primitive, ExecutionBatch, SensorArray], FloatArray] | None:
    """How executions that are alike are scored; None: not otherwise than by themselves."""
    if array.is_adaptive:
        return None
    if primitive.configuration.weight_uncertainty == "joint":
        return _score_joint
    is_shared = array.is_plain and not array.is_coupled and not array.silent.any() and primitive.configuration.scaling == "none"
    return _score_independent if is_shared else None


def _score_joint(primitive: Primitive, batch: ExecutionBatch, array: SensorArray) -> FloatArray:
    n_executions, n_ticks, n_outputs = batch.observations.shape
    executions = joint_executions(primitive, batch.tasks, np.array([batch.dt]), n_ticks)
    together = array.matrix.shape[1]
    if (array.is_coupled or together > 1) and n_ticks * together > LARGEST_GAUSSIAN:
        plan = planned_states(executions).reshape(n_ticks, n_executions, -1)
        seen = np.ones((n_ticks, n_outputs), dtype=np.bool_)
        schedule = gain_schedule(primitive, take_tasks(batch.tasks, [0]), batch.dt, array, seen)
        return schedule.log_likelihoods(batch.observations - (plan @ array.dense_matrix.T).swapaxes(0, 1))
    key = (*kind_of(primitive, batch.tasks, batch.dt, array), n_ticks)
    complete = _KEPT.get(key, lambda: complete_readings(executions, array))
    return complete.log_likelihoods(batch.observations, executions.model.means)


def _score_independent(primitive: Primitive, batch: ExecutionBatch, array: SensorArray) -> FloatArray:
    n_steps, first = batch.observations.shape[1], unstack_tasks(batch.take([0]).tasks)[0]
    gains = shared_gains(sensed_system(linear_gaussian_model(primitive, first, batch.dt, n_steps), array))
    starts = linear_gaussian_model(primitive, batch.tasks, batch.dt, 2)  # forcing terms are alike: one input tells of all
    return score_series(gains, batch.observations, paths=shifted_paths(gains, starts.initial_mean, starts.inputs[0, ..., 0]))


def _score_singly(primitive: Primitive, batch: ExecutionBatch, array: SensorArray) -> FloatArray:
    tasks, recordings = unstack_tasks(batch.tasks), list(batch.recordings(array))
    parts = [slice(i, i + BATCH_SIZE) for i in range(0, len(recordings), BATCH_SIZE)]
    forward = [filter_recordings(primitive, tasks[part], recordings[part], array) for part in parts]
    return np.concatenate([part.log_likelihoods.sum((0, -1)) for part in forward])
