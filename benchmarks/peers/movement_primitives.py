"""movement_primitives: a deterministic primitive with its own equations, by its fastest step functions, compiled ones."""

from collections.abc import Callable

import numpy as np
from movement_primitives.dmp import DMP

from probdmp.checks import FloatArray

__all__ = ["fit_call", "rollout_call"]

STEP = "rk4-cython"


def fit_call(positions: FloatArray, dt: float, n_basis: int) -> Callable[[], object]:
    """Learn one demonstration, (T, D)."""
    times = np.arange(len(positions)) * dt
    primitive = _primitive(positions, dt, n_basis)
    return lambda: primitive.imitate(times, positions)


def rollout_call(positions: FloatArray, dt: float, n_basis: int) -> Callable[[], FloatArray]:
    """Roll out what one demonstration has taught: (T, D) positions."""
    primitive = _primitive(positions, dt, n_basis)
    primitive.imitate(np.arange(len(positions)) * dt, positions)
    return lambda: primitive.open_loop(step_function=STEP)[1][: len(positions)]


def _primitive(positions: FloatArray, dt: float, n_basis: int) -> DMP:
    return DMP(positions.shape[1], execution_time=(len(positions) - 1) * dt, dt=dt, n_weights_per_dim=n_basis)
