"""What a primitive says about recorded executions: filter, smoother, likelihood.

The task of a recording is what its user says it was; what is not said is read off the recording (its first row and its length)
or taken as learned (the goal). Source: Meier & Schaal 2016, Algorithm 2.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, shape_text
from probdmp.demonstrations import Demonstration
from probdmp.dmp import Primitive, Task, stack_tasks, task_for
from probdmp.errors import InputError, InputTypeError
from probdmp.execution.inference import INFERENCES, Inference
from probdmp.execution.joint_filtering import FilteredRecordings
from probdmp.execution.readings import stack_readings
from probdmp.execution.rollout import trajectory_parts
from probdmp.execution.sensor_array import SensorArray
from probdmp.execution.trajectory import GaussianTrajectory, TrackedTrajectory
from probdmp.gaussian import GaussianSequence

__all__ = [
    "BATCH_SIZE",
    "check_recordings",
    "check_tasks",
    "filter_recordings",
    "smooth_recording",
    "smooth_recordings",
    "task_of_recording",
    "track_recording",
]

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
    check_recordings(primitive, [recording])
    start = recording.positions[0] if start is None else start
    return task_for(primitive, start, goal, recording.duration if duration is None else duration, start_velocity)


def track_recording(
    primitive: Primitive, task: Task, recording: Demonstration, sensors: SensorArray | None = None
) -> TrackedTrajectory:
    """Kalman filter over a recorded execution; NaN marks what was not measured, and is predicted.

    Parameters
    ----------
    sensors : what has measured; positions and learned channels unless given.
    """
    array = SensorArray(primitive) if sensors is None else sensors
    forward = filter_recordings(primitive, [task], [recording], array)
    contributions = forward.log_likelihoods[:, 0]
    return TrackedTrajectory(
        **trajectory_parts(primitive, recording.times, forward.filtered),
        log_likelihoods=contributions.sum(axis=-1),
        contributions=contributions,
        innovations=forward.innovations[:, 0],
        innovation_covariances=forward.innovation_covariances[:, 0],
        fused=forward.fused[:, 0],
        array=array,
    )


def smooth_recording(
    primitive: Primitive, task: Task, recording: Demonstration, sensors: SensorArray | None = None
) -> GaussianTrajectory:
    """The state at each time given the whole recording, before and after; arguments as for `track_recording`."""
    array = SensorArray(primitive) if sensors is None else sensors
    smoothed = smooth_recordings(primitive, [task], [recording], array)
    return GaussianTrajectory(**trajectory_parts(primitive, recording.times, smoothed))


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


def filter_recordings(
    primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration], sensors: SensorArray | None = None
) -> FilteredRecordings:
    """Kalman filter over N recordings side by side: arrays (T, N, …); after the end of a recording nothing is seen."""
    inference = INFERENCES[primitive.configuration.weight_uncertainty]
    return inference.filter(*_observed(inference, primitive, tasks, recordings, sensors))


def smooth_recordings(
    primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration], sensors: SensorArray | None = None
) -> GaussianSequence:
    """Smoother over N recordings side by side: the states of all signals, (T, N, S, 3), and their covariances."""
    inference = INFERENCES[primitive.configuration.weight_uncertainty]
    return inference.smooth(*_observed(inference, primitive, tasks, recordings, sensors))


def _observed(
    inference: Inference,
    primitive: Primitive,
    tasks: Sequence[Task],
    recordings: Sequence[Demonstration],
    sensors: SensorArray | None,
) -> tuple[Any, FloatArray, SensorArray]:
    """The executions before they begin, what was measured, (T, N, O), and by what."""
    check_recordings(primitive, recordings)
    array = SensorArray(primitive) if sensors is None else sensors
    measured, dts = stack_readings(array, recordings), np.array([r.dt for r in recordings])
    return inference.prepare(primitive, stack_tasks(tasks), dts, len(measured)), measured, array


def check_recordings(primitive: Primitive, recordings: Sequence[Demonstration]) -> None:
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
