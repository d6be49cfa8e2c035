"""pydmps: a deterministic primitive in plain NumPy, with its own equations; every movement lasts one second."""

from collections.abc import Callable

import numpy as np
from pydmps.dmp_discrete import DMPs_discrete

from probdmp.checks import FloatArray

__all__ = ["fit_call", "rollout_call"]


def fit_call(positions: FloatArray, dt: float, n_basis: int) -> Callable[[], object]:
    """Learn one demonstration, (T, D)."""
    primitive, path = _primitive(positions, n_basis), np.ascontiguousarray(positions.T)
    return lambda: primitive.imitate_path(path)


def rollout_call(positions: FloatArray, dt: float, n_basis: int) -> Callable[[], FloatArray]:
    """Roll out what one demonstration has taught: (T, D) positions."""
    primitive = _primitive(positions, n_basis)
    primitive.imitate_path(np.ascontiguousarray(positions.T))
    return lambda: primitive.rollout()[0]


def _primitive(positions: FloatArray, n_basis: int) -> DMPs_discrete:
    return DMPs_discrete(n_dmps=positions.shape[1], n_bfs=n_basis, dt=1 / len(positions))
