"""Arm movements of least jerk through via-points, with their truth: for trying things in three and in seven dimensions.

A movement is a plan (`arm_plans`): points, and when to pass them. An execution varies them as `ArmVariation` says and takes the
path of least jerk through them (`minimum_jerk`), from rest to rest. Its recording differs from that by white sensor noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from probdmp.checks import FloatArray, check_choice, freeze_arrays
from probdmp.demonstrations.arm_plans import ARM_MOVEMENTS, PLANS, ArmPlan
from probdmp.demonstrations.demonstration import Demonstration
from probdmp.demonstrations.minimum_jerk import minimum_jerk_spline
from probdmp.demonstrations.synthesis import check_stds, check_synthesis
from probdmp.errors import InputError, InputTypeError

__all__ = ["ARM_MOVEMENTS", "ArmMovement", "ArmVariation", "synthetic_arm_movements"]


@dataclass(frozen=True, slots=True)
class ArmVariation:
    """How much executions differ: standard deviations, each >= 0, of each degree of freedom.

    The extent of a movement is the longest range that one of its degrees of freedom has in the plan.
    """

    start: float = 0.02
    """Of the start, extents."""
    via: float = 0.02
    """Of each via-point, extents."""
    goal: float = 0.05
    """Of the goal, extents."""
    tempo: float = 0.07
    """Of the logarithm of the duration."""
    timing: float = 0.04
    """Of the logarithm of the time from each point to the next."""
    sensor_noise: float = 0.001
    """White noise of each sample, extents."""

    def __post_init__(self) -> None:
        check_stds(self, tempo=0.5, timing=0.5)


@dataclass(frozen=True, slots=True, eq=False)
class ArmMovement:
    """One execution, and the movement behind the recording; D = 3 in metres or D = 7 in radians."""

    demonstration: Demonstration
    """The recording: positions with sensor noise."""
    positions: FloatArray
    """(T, D) array, data units, without noise."""
    velocities: FloatArray
    """(T, D) array, data units per second; 0 at both ends."""
    accelerations: FloatArray
    """(T, D) array, data units per second squared; 0 at both ends."""
    via_points: FloatArray
    """(V, D) array, data units: the start, the via-points, the goal."""
    via_times: FloatArray
    """(V,) array, seconds from the first sample: when each is passed; 0 first, the duration last."""

    def __post_init__(self) -> None:
        freeze_arrays(self)


def synthetic_arm_movements(
    n_demonstrations: int = 20,
    seed: int = 0,
    movements: Sequence[str] = ARM_MOVEMENTS,
    dt: float = 0.01,
    variation: ArmVariation = ArmVariation(),
) -> list[ArmMovement]:
    """Executions of arm movements with their truth, movement after movement.

    Of the hand: "reach", "place" and "wipe", x, y, z in metres. Of seven joints: "hand_over", "pour" and "wave", q1 to q7 in
    radians. An execution depends on the seed, its movement and its number alone.

    Parameters
    ----------
    n_demonstrations : executions of each movement.
    seed : the same seed gives the same data.
    movements : different ones out of `ARM_MOVEMENTS`, such as ("reach", "pour").
    dt : seconds between samples.

    Returns
    -------
    n_demonstrations for each movement; `[m.demonstration for m in …]` are the recordings, labelled with it.

    Raises
    ------
    InputError, InputTypeError
        If there are no movements, one is unknown or named twice, or a number is out of range.
    """
    n_demonstrations, seed, dt = check_synthesis(n_demonstrations, seed, dt)
    if not isinstance(variation, ArmVariation):
        raise InputTypeError("variation as an ArmVariation", type(variation).__name__)
    return [
        _execute(name, (seed, k, *name.encode()), dt, variation)
        for name in _check_movements(movements)
        for k in range(n_demonstrations)
    ]


def _check_movements(movements: Sequence[str]) -> Sequence[str]:
    if isinstance(movements, str) or not isinstance(movements, Sequence):
        raise InputTypeError("movements as a sequence of names", repr(movements), 'One alone: movements=("reach",).')
    for name in movements:
        check_choice(name, "each of movements", ARM_MOVEMENTS)
    if not movements or len(set(movements)) < len(movements):
        raise InputError("movements as different names, at least one", repr(movements))
    return movements


def _execute(name: str, entropy: tuple[int, ...], dt: float, variation: ArmVariation) -> ArmMovement:
    """One execution; the noise is drawn last."""
    rng = np.random.default_rng(entropy)
    plan = PLANS[name]
    extent = float(np.ptp(plan.points, axis=0).max())
    points = _draw_points(plan, extent, variation, rng)
    times = _draw_times(plan, dt, variation, rng)
    path = minimum_jerk_spline(times, points)
    instants = np.linspace(0.0, times[-1], round(times[-1] / dt) + 1)
    positions, velocities, accelerations = (np.asarray(path(instants, order)) for order in range(3))
    noisy = positions + variation.sensor_noise * extent * rng.standard_normal(positions.shape)
    demonstration = Demonstration(noisy, dt, name, plan.names, plan.units)
    return ArmMovement(demonstration, positions, velocities, accelerations, points, times)


def _draw_points(plan: ArmPlan, extent: float, variation: ArmVariation, rng: np.random.Generator) -> FloatArray:
    """(V, D) array, data units: start, via-points and goal of one execution."""
    stds = np.full(len(plan.points), variation.via)
    stds[0], stds[-1] = variation.start, variation.goal
    return plan.points + extent * stds[:, None] * plan.looseness * rng.standard_normal(plan.points.shape)


def _draw_times(plan: ArmPlan, dt: float, variation: ArmVariation, rng: np.random.Generator) -> FloatArray:
    """(V,) array, seconds: when the points are passed; the last at a sample, so that the recording ends at rest in the goal."""
    duration = plan.duration * np.exp(variation.tempo * rng.standard_normal())
    intervals = np.diff(plan.phases) * np.exp(variation.timing * rng.standard_normal(len(plan.phases) - 1))
    phases = np.concatenate([[0.0], np.cumsum(intervals) / intervals.sum()])
    phases[-1] = 1.0
    return np.asarray(phases * max(round(duration / dt), 3) * dt)
