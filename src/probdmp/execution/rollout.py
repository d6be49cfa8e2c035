"""Feedforward use of a primitive: its mean with uncertainty, and draws from it. Source: Meier & Schaal 2016, Algorithm 1."""

from typing import Any

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration
from probdmp.dmp import Primitive, Task, linear_gaussian_model, stack_tasks, step_count
from probdmp.dmp.joint_model import joint_executions
from probdmp.dmp.transformation_system import POSITION
from probdmp.execution.joint_filtering import joint_position_covariances, sample_joint
from probdmp.execution.readings import recording_of_readings
from probdmp.execution.rollout_plans import roll_out_joint
from probdmp.execution.sensor_array import SensorArray
from probdmp.execution.trajectory import GaussianTrajectory, channels_of
from probdmp.gaussian import GaussianSequence, filter_sequence, sample_sequences

__all__ = ["position_covariances", "roll_out", "sample_recordings", "sample_states", "sample_trajectories", "trajectory_parts"]


def roll_out(primitive: Primitive, task: Task, dt: float) -> GaussianTrajectory:
    """The movement as planned, from its start to the end of its duration: filtering without observations.

    Parameters
    ----------
    dt : seconds between states.
    """
    n_steps = step_count(float(task.duration), dt)
    times = np.arange(n_steps, dtype=np.float64) * dt
    tasks = stack_tasks([task])
    if primitive.configuration.weight_uncertainty == "joint":
        rolled = roll_out_joint(primitive, tasks, dt, joint_executions(primitive, tasks, np.array([dt]), n_steps))
    else:
        rolled = filter_sequence(linear_gaussian_model(primitive, tasks, np.array([dt]), n_steps)).filtered
    return GaussianTrajectory(**trajectory_parts(primitive, times, rolled))


def trajectory_parts(primitive: Primitive, times: FloatArray, states: GaussianSequence) -> dict[str, Any]:
    """Arguments of a `GaussianTrajectory` from the states of all signals of one execution, (T, 1, S, 3)."""
    d, means, covariances = primitive.n_dof, states.means[:, 0], states.covariances[:, 0]
    return {
        "times": times,
        "means": means[:, :d],
        "covariances": covariances[:, :d],
        "names": primitive.names,
        "units": primitive.units,
        "channels": channels_of(primitive, means, covariances),
    }


def position_covariances(primitive: Primitive, task: Task, dt: float) -> FloatArray:
    """Covariances of the positions of a rollout across degrees of freedom, (T, D, D) array, data units squared.

    Only joint weights know how degrees of freedom vary together; else the matrices are diagonal.
    """
    if primitive.configuration.weight_uncertainty == "joint":
        n_steps = step_count(float(task.duration), dt)
        executions = joint_executions(primitive, stack_tasks([task]), np.array([dt]), n_steps)
        return joint_position_covariances(executions)[:, 0, : primitive.n_dof, : primitive.n_dof]
    stds = roll_out(primitive, task, dt).position_stds
    return stds[..., None] ** 2 * np.eye(primitive.n_dof)


def sample_states(primitive: Primitive, task: Task, dt: float, n_samples: int, rng: np.random.Generator) -> FloatArray:
    """Draw the states of executions, of all signals: (n_samples, T, S, 3) array; of channels the last is the value."""
    n_steps = step_count(float(task.duration), dt)
    if primitive.configuration.weight_uncertainty == "joint":
        return sample_joint(joint_executions(primitive, stack_tasks([task]), np.array([dt]), n_steps), n_samples, rng)
    return sample_sequences(linear_gaussian_model(primitive, task, dt, n_steps), n_samples, rng)[0]


def sample_trajectories(
    primitive: Primitive, task: Task, dt: float, n_samples: int, rng: np.random.Generator, sensor_noise: bool
) -> list[FloatArray]:
    """Draw paths from the model.

    Parameters
    ----------
    sensor_noise : whether positions are as a sensor would record them, or as they are.

    Returns
    -------
    n_samples arrays (T, D), data units.
    """
    paths = sample_states(primitive, task, dt, n_samples, rng)[..., : primitive.n_dof, POSITION]
    noise = rng.standard_normal(paths.shape) * np.sqrt(primitive.observation_variances)
    return list(paths + noise if sensor_noise else paths)


def sample_recordings(
    primitive: Primitive, task: Task, dt: float, n_samples: int, rng: np.random.Generator, array: SensorArray
) -> list[Demonstration]:
    """Draw executions as sensors would record them; positions that none of them measures are missing."""
    states = sample_states(primitive, task, dt, n_samples, rng)
    readings = array.draw(states.reshape(*states.shape[:2], -1), rng)
    of_sensors = [{name: values[:, part] for name, part in array.slices.items()} for values in readings]
    return [recording_of_readings(array, given, dt) for given in of_sensors]
