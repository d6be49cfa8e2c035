"""Feedforward use of a primitive: its mean with uncertainty, and draws from it. Source: Meier & Schaal 2016, Algorithm 1."""

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive, Task, linear_gaussian_model, stack_tasks, step_count
from probdmp.dmp.joint_model import joint_executions
from probdmp.dmp.transformation_system import POSITION
from probdmp.execution.joint_filtering import joint_position_covariances, roll_out_joint, sample_joint
from probdmp.execution.trajectory import GaussianTrajectory
from probdmp.gaussian import filter_sequence, sample_sequences

__all__ = ["position_covariances", "roll_out", "sample_trajectories"]


def roll_out(primitive: Primitive, task: Task, dt: float) -> GaussianTrajectory:
    """The movement as planned, from its start to the end of its duration: filtering without observations.

    Parameters
    ----------
    dt : seconds between states.
    """
    n_steps = step_count(float(task.duration), dt)
    times = np.arange(n_steps, dtype=np.float64) * dt
    if primitive.configuration.weight_uncertainty == "joint":
        means, covariances = roll_out_joint(joint_executions(primitive, stack_tasks([task]), np.array([dt]), n_steps))
        return GaussianTrajectory(times, means[:, 0], covariances[:, 0], primitive.names, primitive.units)
    rolled = filter_sequence(linear_gaussian_model(primitive, task, dt, n_steps)).filtered
    return GaussianTrajectory(times, rolled.means, rolled.covariances, primitive.names, primitive.units)


def position_covariances(primitive: Primitive, task: Task, dt: float) -> FloatArray:
    """Covariances of the positions of a rollout across degrees of freedom, (T, D, D) array, data units squared.

    Only joint weights know how degrees of freedom vary together; else the matrices are diagonal.
    """
    if primitive.configuration.weight_uncertainty == "joint":
        n_steps = step_count(float(task.duration), dt)
        return joint_position_covariances(joint_executions(primitive, stack_tasks([task]), np.array([dt]), n_steps))[:, 0]
    stds = roll_out(primitive, task, dt).position_stds
    return stds[..., None] ** 2 * np.eye(primitive.n_dof)


def sample_trajectories(
    primitive: Primitive, task: Task, dt: float, n_samples: int, rng: np.random.Generator, sensor_noise: bool
) -> list[FloatArray]:
    """Draw executions from the model.

    Parameters
    ----------
    sensor_noise : whether positions are as a sensor would record them, or as they are.

    Returns
    -------
    n_samples arrays (T, D), data units.
    """
    n_steps = step_count(float(task.duration), dt)
    if primitive.configuration.weight_uncertainty == "joint":
        executions = joint_executions(primitive, stack_tasks([task]), np.array([dt]), n_steps)
        paths = sample_joint(executions, n_samples, rng)
        noise = rng.standard_normal(paths.shape) * np.sqrt(primitive.observation_variances)
        return list(paths + noise if sensor_noise else paths)
    model = linear_gaussian_model(primitive, task, dt, n_steps)
    states, observations = sample_sequences(model, n_samples, rng)
    return list(observations[..., 0] if sensor_noise else states[..., POSITION])
