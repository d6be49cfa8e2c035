"""The plans of the built-in arm movements: which points the hand or the joints pass through, and when."""

from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray

__all__ = ["ARM_MOVEMENTS", "PLANS", "ArmPlan"]

XYZ = ("x", "y", "z")
JOINTS = ("q1", "q2", "q3", "q4", "q5", "q6", "q7")


class ArmPlan(NamedTuple):
    """One movement, before anybody's execution has varied it."""

    names: tuple[str, ...]
    """(D) names of the degrees of freedom."""
    units: str
    duration: float
    """Seconds."""
    phases: FloatArray
    """(V,) array: when each point is passed, fractions of the duration, from 0 to 1."""
    points: FloatArray
    """(V, D) array, metres or radians: the start, the via-points, the goal."""
    looseness: FloatArray
    """(D,) array: by how much more or less than others a degree of freedom varies."""


def _hand(duration: float, *rows: tuple[float, ...], looseness: tuple[float, ...] = (1, 1, 1)) -> ArmPlan:
    """Rows of phase, x, y, z."""
    table = np.array(rows, dtype=np.float64)
    return ArmPlan(XYZ, "m", duration, table[:, 0], table[:, 1:], np.array(looseness, dtype=np.float64))


def _joints(duration: float, *rows: tuple[float, ...]) -> ArmPlan:
    """Rows of phase, q1, …, q7."""
    table = np.array(rows, dtype=np.float64)
    return ArmPlan(JOINTS, "rad", duration, table[:, 0], table[:, 1:], np.ones(len(JOINTS)))


PLANS = {
    "reach": _hand(  # straight to an object on a shelf
        1.0,
        (0.00, 0.35, -0.15, 0.20),
        (1.00, 0.60, 0.20, 0.45),
    ),
    "place": _hand(  # lift, carry over an obstacle, put down; the tables stay where they are
        1.6,
        (0.00, 0.45, -0.25, 0.05),
        (0.28, 0.46, -0.20, 0.18),
        (0.70, 0.52, 0.17, 0.20),
        (1.00, 0.50, 0.25, 0.05),
        looseness=(1, 1, 0.3),
    ),
    "wipe": _hand(  # down to a table, to and fro along it, and up; the table stays where it is
        2.8,
        (0.00, 0.38, -0.21, 0.15),
        (0.18, 0.36, -0.18, 0.03),
        (0.26, 0.47, -0.15, 0.02),
        (0.34, 0.59, -0.12, 0.02),
        (0.50, 0.40, -0.02, 0.02),
        (0.66, 0.59, 0.08, 0.02),
        (0.74, 0.47, 0.11, 0.02),
        (0.82, 0.36, 0.14, 0.03),
        (1.00, 0.38, 0.17, 0.15),
        looseness=(1, 1, 0.1),
    ),
    "hand_over": _joints(  # from the ready posture to somebody on the left
        1.4,
        (0.00, 0.00, -0.78, 0.00, -2.36, 0.00, 1.57, 0.78),
        (0.45, 0.35, -0.45, -0.05, -2.25, 0.05, 1.85, 0.85),
        (1.00, 0.75, 0.25, -0.15, -1.55, 0.15, 2.05, 1.20),
    ),
    "pour": _joints(  # bring a bottle over a glass, tilt it, and right it again
        3.6,
        (0.00, -0.50, 0.15, 0.05, -2.20, 0.00, 2.30, 0.80),
        (0.35, 0.25, 0.10, 0.10, -1.85, 0.05, 2.05, 0.70),
        (0.65, 0.32, 0.20, 0.12, -1.75, 0.15, 2.00, -0.70),
        (1.00, 0.20, 0.05, 0.05, -1.95, 0.00, 2.15, 0.75),
    ),
    "wave": _joints(  # raise the forearm and wave twice
        4.4,
        (0.00, 0.00, -0.78, 0.00, -2.36, 0.00, 1.57, 0.78),
        (0.30, 0.25, -0.20, 0.30, -1.30, 0.20, 1.90, 0.78),
        (0.45, 0.25, -0.20, -0.30, -1.30, -0.25, 1.95, 0.60),
        (0.60, 0.25, -0.20, 0.32, -1.30, 0.25, 1.90, 0.95),
        (0.75, 0.25, -0.20, -0.25, -1.35, -0.20, 1.90, 0.70),
        (1.00, 0.10, -0.60, 0.00, -2.20, 0.00, 1.65, 0.78),
    ),
}
"""By name. The hand: x forward, y to the left, z up, from the base of an arm that stands on a table. The joints: of an arm with
seven of them, within the limits of a Franka Emika Panda."""

ARM_MOVEMENTS = tuple(PLANS)
"""The built-in arm movements: three of the hand, three of the joints."""
