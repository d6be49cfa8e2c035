"""The phase x: it starts at 1 and decays exponentially while the movement lasts.

    x(t) = exp(-alpha_x t / T_d),   x(T_d) = 0.01

After T_d it goes on decaying, so that the forcing term fades and the goal attracts.
Source: Ijspeert et al., Dynamical Movement Primitives, Neural Computation 25 (2013), canonical system; Meier & Schaal 2016.
"""

import math

import numpy as np

from probdmp.checks import FloatArray

__all__ = ["ALPHA_X", "phase_at", "phases_at"]

ALPHA_X = math.log(100)
"""Decay rate of the phase per movement: x = 0.01 at the end."""


def phases_at(times: FloatArray, duration: FloatArray | float) -> FloatArray:
    """Phase at given times.

    Parameters
    ----------
    times : array, seconds from the start of the movement.
    duration : T_d, array that broadcasts against `times`, seconds.

    Returns
    -------
    Array of phases, dimensionless.
    """
    return np.exp(-ALPHA_X * times / duration)


def phase_at(time: float, duration: float) -> float:
    """The same of one time, fast enough for a control loop."""
    return math.exp(-ALPHA_X * time / duration)
