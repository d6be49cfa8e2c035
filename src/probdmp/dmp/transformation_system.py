"""The spring-damper system of a DMP, discretised in time.

    p'' = tau^2 (alpha_z (beta_z (g - p) - p'/tau) + s f),   tau = 1 / duration,   beta_z = alpha_z / 4

With a1 = -alpha_z tau, a0 = -alpha_z beta_z tau^2 and u = alpha_z beta_z g + s f this is p'' = a1 p' + a0 p + tau^2 u. Both
schemes turn it into s[t] = A s[t-1] + B u[t-1] on the state s = (p'', p', p):

`semi_implicit_euler` is the paper's: the new acceleration drives the new velocity, the new velocity the new position.

        | 0        a1          a0      |                |  1   |
    A = | 0   1 + a1 dt      a0 dt     |,   B = tau^2   |  dt  |,   f at the phase of the step's start
        | 0   dt + a1 dt^2   1+a0 dt^2 |                | dt^2 |

`exact` is the zero-order-hold solution (p', p)[t] = Phi (p', p)[t-1] + Gamma u. The acceleration is the mean over the step,
(p'[t] - p'[t-1]) / dt. What is held is not quite f at the middle of the step: the position answers to held values h as to
h + dt^2 h'' / 24, so h = f - dt^2 f'' / 24 with f'' from the values at both ends. The first step holds dt f' / 12 less: the
velocity that goes with held values is not quite the true one, with which a movement starts, but differs from it by -dt^2 / 12
times the jerk. The path then hardly depends on dt.

The paper prints B = (1, 0, 0)^T and an A on the previous velocity; docs/paper.md says why that cannot be meant.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.errors import InputError

__all__ = [
    "ACCELERATION",
    "DISCRETIZATIONS",
    "POSITION",
    "VELOCITY",
    "DiscreteSystem",
    "Discretization",
    "spring_matrix",
]

ACCELERATION, VELOCITY, POSITION = 0, 1, 2
"""The order of the state, in every array that has one."""

STABILITY_LIMIT = float(np.sqrt(32) - 4)
"""Semi-implicit Euler is unstable for alpha_z tau dt beyond this, about 1.66."""
STIFFNESS_LIMIT = 40.0
"""Of alpha_z tau dt in the exact scheme: by the end of a longer step nothing is left of the velocity that it caused."""


class DiscreteSystem(NamedTuple):
    """One step of the transformation system."""

    transition: FloatArray
    """A, (*batch, 3, 3), on the state (acceleration, velocity, position)."""
    input_vector: FloatArray
    """B, (*batch, 3), carries tau^2."""


@dataclass(frozen=True)
class Discretization:
    """A way to step the transformation system."""

    step: Callable[[float, FloatArray, FloatArray], DiscreteSystem]
    """(alpha_z, duration (*batch), dt (*batch)) to the matrices of one step."""
    forcing_stencil: tuple[tuple[float, float], ...]
    """What is held over a step: the mean forcing term at places in it, in steps after its start, each with its weight."""
    first_stencil: tuple[tuple[float, float], ...]
    """The same for the first step of a movement, before which nothing was held."""
    noise_offset: float
    """Where in a step the variance of the forcing term is evaluated, in steps after its start."""
    noise_variance: Callable[[FloatArray], FloatArray]
    """From alpha_z dt / duration: variance, but for a factor, of noise held over a step that does what white noise of a given
    density does. It decides how the variance of the forcing term depends on the control rate."""


def spring_matrix(alpha_z: float, duration: FloatArray) -> FloatArray:
    """(a1, a0): how velocity and position accelerate, (*batch, 2) array in 1/s and 1/s^2."""
    rate = 1 / duration
    return np.stack([-alpha_z * rate, -(alpha_z**2) / 4 * rate**2], axis=-1)


def _semi_implicit_euler(alpha_z: float, duration: FloatArray, dt: FloatArray) -> DiscreteSystem:
    stiffness = alpha_z * dt / duration
    if np.any(stiffness > STABILITY_LIMIT):
        raise InputError(
            f"alpha_z dt / duration <= {STABILITY_LIMIT:.3f}, where semi-implicit Euler is stable",
            f"{np.max(stiffness):.3g}",
            'Use a smaller dt, or discretization="exact", which is stable.',
        )
    a1, a0 = np.moveaxis(spring_matrix(alpha_z, duration), -1, 0)
    zero, one = np.zeros_like(a1), np.ones_like(a1)
    acceleration = _rows([zero, a1, a0])
    velocity = _rows([zero, one, zero]) + acceleration * dt[..., None]
    position = _rows([zero, zero, one]) + velocity * dt[..., None]
    powers = _rows([one, dt * one, dt**2 * one])
    return DiscreteSystem(np.stack([acceleration, velocity, position], axis=-2), powers / duration[..., None] ** 2)


def _exact(alpha_z: float, duration: FloatArray, dt: FloatArray) -> DiscreteSystem:
    # Critical damping: a double pole at -k, k = alpha_z tau / 2, so the matrix exponential is exp(-k dt) (1 + ... dt).
    pole = alpha_z / (2 * duration)
    y = pole * dt
    if np.any(2 * y > STIFFNESS_LIMIT):
        raise InputError(
            f"alpha_z dt / duration <= {STIFFNESS_LIMIT:g}, where what is held over a step still moves the velocity at its end",
            f"{np.max(2 * y):.3g}",
            "Use a smaller dt or a smaller alpha_z.",
        )
    decay, decayed = np.exp(-y), -np.expm1(-y)
    zero = np.zeros_like(y)
    velocity = _rows([zero, decay * (1 - y), -pole * y * decay])
    position = _rows([zero, decay * dt, decay * (1 + y)])
    acceleration = _rows([zero, -(decayed + y * decay) / dt, -(pole**2) * decay])
    gamma_velocity = decay * dt / duration**2
    gamma_position = (decayed - y * decay) / (duration * pole) ** 2
    inputs = _rows([gamma_velocity / dt, gamma_velocity, gamma_position])
    return DiscreteSystem(np.stack([acceleration, velocity, position], axis=-2), inputs)


def _rows(entries: list[FloatArray]) -> FloatArray:
    return np.stack(np.broadcast_arrays(*entries), axis=-1)


def _exact_noise_variance(stiffness: FloatArray) -> FloatArray:
    """What gives a first-order lag of the velocity's damping the stationary variance that white noise would.

    x' = -a x + noise, a = alpha_z / duration: white noise of density S leaves S / (2 a), and noise of variance v held over
    steps leaves v tanh(a dt / 2) / a^2.
    """
    return 1 / np.tanh(stiffness / 2)


DISCRETIZATIONS = {
    "exact": Discretization(
        _exact,
        forcing_stencil=((0.0, -1 / 6), (0.5, 8 / 6), (1.0, -1 / 6)),
        first_stencil=((0.0, -1 / 12), (0.5, 8 / 6), (1.0, -3 / 12)),
        noise_offset=0.5,
        noise_variance=_exact_noise_variance,
    ),
    "semi_implicit_euler": Discretization(
        _semi_implicit_euler,
        forcing_stencil=((0.0, 1.0),),
        first_stencil=((0.0, 1.0),),
        noise_offset=0.0,
        noise_variance=np.reciprocal,
    ),
}
