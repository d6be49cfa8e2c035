"""What the forcing term must have been for the system to make a recorded movement.

The velocity row of s[t] = A s[t-1] + B u[t-1], solved for the input:

    u[t-1] = (p'[t] - A_vv p'[t-1] - A_vp p[t-1]) / B_v,    s f[t-1] = u[t-1] - alpha_z beta_z g

The scheme is inverted as it will be run, so a movement that the scheme itself has made gives back its own forcing term, to
rounding error, in both discretisations. For recordings the velocities come from the smoothed path. Semi-implicit Euler knows
no velocity but (p[t] - p[t-1]) / dt, and is given that one. Inverting the exact scheme from positions alone would ring: its
transfer function from input to position has a zero near -1.
"""

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import SmoothPath
from probdmp.dmp import Configuration
from probdmp.dmp.transformation_system import DISCRETIZATIONS, VELOCITY

__all__ = ["forcing_targets", "scheme_velocities"]


def scheme_velocities(path: SmoothPath, dt: float, discretization: str) -> FloatArray:
    """Velocities as the scheme understands them, (T, D) array, data units per second."""
    if discretization == "exact":
        return path.velocities
    backward = np.diff(path.positions, axis=0) / dt
    return np.concatenate([2 * backward[:1] - backward[1:2], backward])  # the first one extrapolated


def forcing_targets(
    positions: FloatArray, velocities: FloatArray, goal: FloatArray, dt: float, configuration: Configuration
) -> FloatArray:
    """Forcing term of a movement at every step, times its amplitude s.

    Parameters
    ----------
    positions, velocities : (T, D) arrays, data units and data units per second, as the scheme understands them.
    goal : (D,) array, data units.
    dt : seconds.

    Returns
    -------
    (T - 1, D) array, data units; entry t-1 drives state t-1 to state t.
    """
    duration = np.asarray((len(positions) - 1) * dt)
    scheme = DISCRETIZATIONS[configuration.discretization]
    system = scheme.step(configuration.alpha_z, duration, np.asarray(dt))
    _, from_velocity, from_position = system.transition[VELOCITY]
    free = from_velocity * velocities[:-1] + from_position * positions[:-1]
    return (velocities[1:] - free) / system.input_vector[VELOCITY] - configuration.stiffness * goal
