"""What a primitive says about recorded executions: filter, smoother, likelihood.

The task of a recording is what its user says it was; what is not said is read off the recording (its first row and its length)
or taken as learned (the goal). Source: Meier & Schaal 2016, Algorithm 2.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, shape_text
from probdmp.demonstrations import Demonstration, stack_positions
from probdmp.dmp import Primitive, Task, linear_gaussian_model, stack_tasks, task_for
from probdmp.dmp.joint_model import joint_executions
from probdmp.errors import InputError, InputTypeError
from probdmp.execution.joint_filtering import FilteredRecordings, filter_joint, smooth_joint
from probdmp.execution.trajectory import GaussianTrajectory, TrackedTrajectory
from probdmp.gaussian import filter_sequence, smooth_sequence

__all__ = ["check_tasks", "filter_recordings", "score_recordings", "smooth_recording", "task_of_recording", "track_recording"]

BATCH_SIZE = 256
"""Recordings that are filtered side by side; more would only cost memory."""


def task_of_recording(
    primitive: Primitive,
    recording: Demonstration,
    start: ArrayLike | None = None,
    goal: ArrayLike | None = None,
    duration: float | None = None,
    start_velocity: ArrayLike | None = None,
) -> Task:
    """The task of a recorded execution.

    Parameters
    ----------
    start : (D,) array, data units; the first row of the recording unless given; unknown where that row is missing.
    goal : (D,) array, data units; as learned unless given.
    duration : seconds; the length of the recording unless given.
    start_velocity : (D,) array, data units per second; as learned, with its variance, unless given.
    """
    _check_recordings(primitive, [recording])
    start = recording.positions[0] if start is None else start
    return task_for(primitive, start, goal, recording.duration if duration is None else duration, start_velocity)


def track_recording(primitive: Primitive, task: Task, recording: Demonstration) -> TrackedTrajectory:
    """Kalman filter over a recorded execution; NaN marks what was not measured, and is predicted."""
    forward = filter_recordings(primitive, [task], [recording])
    contributions = forward.log_likelihoods[:, 0]
    return TrackedTrajectory(
        times=recording.times,
        means=forward.filtered.means[:, 0],
        covariances=forward.filtered.covariances[:, 0],
        names=primitive.names,
        units=primitive.units,
        log_likelihoods=contributions.sum(axis=-1),
        contributions=contributions,
        innovations=forward.innovations[:, 0, :, 0],
        innovation_variances=forward.innovation_covariances[:, 0, :, 0, 0],
    )


def smooth_recording(primitive: Primitive, task: Task, recording: Demonstration) -> GaussianTrajectory:
    """The state at each time given the whole recording, before and after."""
    _check_recordings(primitive, [recording])
    if primitive.configuration.weight_uncertainty == "joint":
        executions = joint_executions(primitive, stack_tasks([task]), np.array([recording.dt]), recording.n_samples)
        means, covariances = smooth_joint(primitive, executions, recording.positions[:, None])
        return GaussianTrajectory(recording.times, means[:, 0], covariances[:, 0], primitive.names, primitive.units)
    model = linear_gaussian_model(primitive, task, recording.dt, recording.n_samples)
    smoothed = smooth_sequence(model, recording.positions[..., None])
    return GaussianTrajectory(recording.times, *smoothed, primitive.names, primitive.units)


def score_recordings(primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration]) -> FloatArray:
    """Total log-likelihood of each recording given its task, (N,) array, nats."""
    check_tasks(tasks, recordings)
    batches = range(0, len(recordings), BATCH_SIZE)
    return np.concatenate(
        [
            filter_recordings(primitive, tasks[i : i + BATCH_SIZE], recordings[i : i + BATCH_SIZE]).log_likelihoods.sum((0, -1))
            for i in batches
        ]
    )


def check_tasks(tasks: Sequence[Task], recordings: Sequence[Demonstration]) -> Sequence[Task]:
    """One task for each recording, or an error."""
    if not isinstance(tasks, list | tuple) or not all(isinstance(task, Task) for task in tasks):
        raise InputTypeError("tasks as a list of Task", f"{tasks!r:.100}", "task_for(primitive, …) in probdmp.dmp makes them.")
    if len(tasks) != len(recordings):
        raise InputError(f"one task for each of {len(recordings)} recordings", f"{len(tasks)}")
    for task, recording in zip(tasks, recordings, strict=True):
        if task.start.shape != (recording.n_dof,):
            raise InputError(f"tasks of {recording.n_dof} degrees of freedom", f"one of shape {shape_text(task.start.shape)}")
    return tasks


def filter_recordings(primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration]) -> FilteredRecordings:
    """Kalman filter over N recordings side by side: arrays (T, N, D, …); after the end of a recording nothing is seen."""
    _check_recordings(primitive, recordings)
    observed = stack_positions(recordings)
    dts = np.array([r.dt for r in recordings])
    if primitive.configuration.weight_uncertainty == "joint":
        return filter_joint(primitive, joint_executions(primitive, stack_tasks(tasks), dts, len(observed)), observed)
    forward = filter_sequence(linear_gaussian_model(primitive, stack_tasks(tasks), dts, len(observed)), observed[..., None])
    return FilteredRecordings(forward.filtered, forward.innovations, forward.innovation_covariances, forward.log_likelihoods)


def _check_recordings(primitive: Primitive, recordings: Sequence[Demonstration]) -> None:
    """Refuse recordings of other degrees of freedom, in another order, or in other units than the primitive has."""
    for recording in recordings:
        if recording.n_dof != primitive.n_dof or (recording.has_names and recording.names != primitive.names):
            raise InputError(
                f"recordings of {primitive.n_dof} degrees of freedom ({', '.join(primitive.names)})",
                f"one with {recording.n_dof} ({', '.join(recording.names)})",
                "Time goes first: (T, D). Bring the columns into the order that was learned.",
            )
        if recording.units and primitive.units and recording.units != primitive.units:
            raise InputError(f"recordings in {primitive.units}", f"one in {recording.units}", "Convert them first.")
