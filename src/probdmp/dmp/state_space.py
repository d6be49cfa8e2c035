"""The paper's contribution: a movement primitive and a task as a linear-Gaussian system.

The state of a degree of freedom is s = (acceleration, velocity, position). The forcing term is uncertain,
f[t] ~ N(phi[t]^T mu_w, sigma_f^2[t]), and enters through the input u[t] = alpha_z beta_z g + s f[t], so

    s[t] = A s[t-1] + B (alpha_z beta_z g + s mu_f[t-1]) + e[t-1],    e[t] ~ N(0, s^2 sigma_f^2[t] B B^T)
    o[t] = C s[t] + v[t],   C = (0, 0, 1),                            v[t] ~ N(0, R)

Uncertainty about the shape of the movement becomes process noise that depends on the phase.

sigma_f^2 belongs to the phase step of the training data: white noise that is redrawn k times as often must have about k times
the variance to move the system as far, so at another step it is corrected (`Discretization.noise_variance`). Position
and velocity bands then hardly depend on the control rate. The acceleration of such a system is itself white: its band
grows as 1 / sqrt(dt).

Source: Meier & Schaal 2016, "Deriving the Probabilistic DMP Model".
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, frozen
from probdmp.demonstrations.demonstration import LONGEST_RECORDING
from probdmp.dmp.forcing_term import ForcingTerm, forcing_term
from probdmp.dmp.phase import phases_at
from probdmp.dmp.primitive import Primitive
from probdmp.dmp.responses import LONGEST_KEPT, held_features
from probdmp.dmp.task import Task
from probdmp.dmp.transformation_system import ACCELERATION, DISCRETIZATIONS, spring_matrix
from probdmp.errors import InputError
from probdmp.gaussian import LinearGaussianModel

__all__ = ["POSITION_SENSOR", "ControlInputs", "control_inputs", "linear_gaussian_model", "step_count"]

POSITION_SENSOR = np.array([[0.0, 0.0, 1.0]])
"""C of the paper's simple case: the position of each degree of freedom is measured."""


class ControlInputs(NamedTuple):
    """What drives the system, alpha_z beta_z g + s f."""

    means: FloatArray
    """u, (n, *batch, D) array, data units."""
    variances: FloatArray
    """s^2 sigma_f^2, (n, *batch, D) array, data units squared."""


def step_count(duration: float, dt: float) -> int:
    """T, the number of states from the start to the end of a movement: round(duration / dt) + 1.

    Raises
    ------
    InputError
        If the movement would have fewer than two states or more than `LONGEST_RECORDING`.
    """
    if not 0.5 < duration / dt < LONGEST_RECORDING:
        raise InputError(
            f"a duration of 1 to {LONGEST_RECORDING} steps of dt",
            f"duration {duration:g} s and dt {dt:g} s",
            "Is one of them in milliseconds?",
        )
    return round(duration / dt) + 1


def control_inputs(primitive: Primitive, task: Task, dt: FloatArray | float, steps: FloatArray) -> ControlInputs:
    """The inputs at given times, counted in steps from the start; they may lie between steps.

    Parameters
    ----------
    dt : (*batch) array or number, seconds.
    steps : (n,) array.
    """
    dt, duration = np.asarray(dt, dtype=np.float64), task.duration
    times = steps.reshape(-1, *(1,) * max(dt.ndim, duration.ndim)) * dt
    forcing = forcing_term(primitive, phases_at(times, duration))
    amplitude, configuration = primitive.amplitudes(task), primitive.configuration
    correction = _noise_correction(primitive, dt / duration)
    means = configuration.stiffness * primitive.goals(task) + amplitude * forcing.means
    return ControlInputs(means, amplitude**2 * forcing.variances * correction)


def linear_gaussian_model(
    primitive: Primitive, task: Task, dt: FloatArray | float, n_steps: int, first_step: int = 0
) -> LinearGaussianModel:
    """The system that executes a task.

    Parameters
    ----------
    task : one task, or a batch of tasks with leading axes `*batch`.
    dt : seconds between states, a number or (*batch) array.
    n_steps : T states, hence T - 1 transitions; u[t-1] drives state t-1 to state t.
    first_step : how many steps of the movement are over; the inputs are those of the steps that follow, and the initial
        state, which belongs to the start of the movement, is of no use then.

    Returns
    -------
    LinearGaussianModel with batch axes (*batch, D): degrees of freedom are independent.
    """
    dt = np.asarray(dt, dtype=np.float64)
    scheme = DISCRETIZATIONS[primitive.configuration.discretization]
    system = scheme.step(primitive.configuration.alpha_z, task.duration, dt)
    amplitude, configuration = primitive.amplitudes(task), primitive.configuration
    held = _held_forcing(primitive, dt / task.duration, n_steps - 1, first_step)
    correction = _noise_correction(primitive, dt / task.duration)
    means = configuration.stiffness * primitive.goals(task) + amplitude * held.means
    variances = amplitude**2 * held.variances * correction
    mean, covariance = _initial_state(primitive, task, control_inputs(primitive, task, dt, np.zeros(1)))
    return LinearGaussianModel(
        transition=system.transition[..., None, :, :],
        input_matrix=system.input_vector[..., None, :, None],
        inputs=means[..., None],
        input_covariances=variances[..., None, None],
        observation_matrix=POSITION_SENSOR,
        observation_covariance=primitive.observation_variances[:, None, None],
        initial_mean=mean,
        initial_covariance=covariance,
    )


def _held_forcing(primitive: Primitive, phase_steps: FloatArray, n_steps: int, first_step: int) -> ForcingTerm:
    """The forcing term that is held over each step, (n, *batch, D); batch axes are of length 1 where all steps are alike."""
    different, where = np.unique(phase_steps, return_inverse=True)
    compute = _kept_forcing_at if n_steps <= LONGEST_KEPT else _held_forcing_at
    alike = [compute(primitive, float(step), n_steps, first_step) for step in different]
    shape = (n_steps, *(phase_steps.shape if len(alike) > 1 else (1,) * phase_steps.ndim), primitive.n_dof)

    def of_batch(parts: list[FloatArray]) -> FloatArray:
        return np.stack(parts, axis=1)[:, where.ravel() if len(parts) > 1 else slice(None)].reshape(shape)

    return ForcingTerm(of_batch([part.means for part in alike]), of_batch([part.variances for part in alike]))


def _held_forcing_at(primitive: Primitive, phase_step: float, n_steps: int, first_step: int) -> ForcingTerm:
    """The same for one dt / T_d, (n, D)."""
    offset = DISCRETIZATIONS[primitive.configuration.discretization].noise_offset
    steps = first_step + np.arange(n_steps, dtype=np.float64) + offset
    means = held_features(primitive.configuration, phase_step, n_steps, first_step) @ primitive.weight_means.T
    return ForcingTerm(frozen(means), frozen(forcing_term(primitive, phases_at(steps * phase_step, 1.0)).variances))


_kept_forcing_at = lru_cache(maxsize=64)(_held_forcing_at)
"""Executions often differ in nothing but their start and goal."""


def _noise_correction(primitive: Primitive, phase_steps: FloatArray) -> FloatArray:
    """Of the variance of the forcing term, from the step of the training data to others, (*batch, 1) array."""
    variance_at = DISCRETIZATIONS[primitive.configuration.discretization].noise_variance
    alpha_z = primitive.configuration.alpha_z
    return (variance_at(alpha_z * phase_steps) / variance_at(np.asarray(alpha_z * primitive.phase_step)))[..., None]


def _initial_state(primitive: Primitive, task: Task, first: ControlInputs) -> tuple[FloatArray, FloatArray]:
    """s[0]: velocity and position as learned or given, the acceleration from the differential equation.

    Returns
    -------
    Mean (*batch, D, 3) and covariance (*batch, D, 3, 3).
    """
    duration = task.duration[..., None]
    given = np.full(task.start.shape, np.nan) if task.start_velocity is None else task.start_velocity
    velocity = np.where(np.isnan(given), primitive.start_velocities / duration, given)
    # What is known has no variance.
    scale = np.stack([np.where(np.isnan(given), 1 / duration, 0.0), np.where(np.isnan(task.start), 1.0, 0.0)], axis=-1)
    covariance = primitive.start_covariances * scale[..., :, None] * scale[..., None, :]
    spring = spring_matrix(primitive.configuration.alpha_z, task.duration)[..., None, :]
    lift = np.concatenate([spring[..., None, :], np.broadcast_to(np.eye(2), (*spring.shape[:-1], 2, 2))], axis=-2)
    mean = np.matmul(lift, np.stack([velocity, primitive.starts(task)], axis=-1)[..., None])[..., 0]
    full = lift @ covariance @ lift.mT
    mean[..., ACCELERATION] += first.means[0] / duration**2
    full[..., ACCELERATION, ACCELERATION] += first.variances[0] / duration**4
    return mean, full
