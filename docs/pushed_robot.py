"""A robot that is displaced while it executes a movement, for the pictures and tables of docs/feedback.md.

The robot is a mass with a controller of its own: its error e, where it is minus where it is told to be, goes as
e'' = -2 r e' - r^2 e, with the commanded acceleration fed forward. From `HELD[0]` to `HELD[1]` a hand holds it off its plan in
x, however it is commanded; then it lets go. What commands it is either `Inferred`, the library, or `coupled`: the movement
primitive of the plan with a coupling term, whose gain is set by hand.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from probdmp import GaussianTrajectory, ProbabilisticDMP, synthetic_letters
from probdmp.checks import FloatArray
from probdmp.dmp import linear_gaussian_model, task_for
from probdmp.execution import LinearSensor, state_sensor

__all__ = ["BY", "HELD", "LETTERS", "Controller", "Execution", "Inferred", "coupled", "displace", "plan_of", "position_sensor"]

LETTERS = synthetic_letters(20, letters="a")
HELD = (0.5, 0.7)
"""Seconds."""
DRAGGED = 0.1
"""Seconds from the first touch until the robot is off by all of `BY`."""
BY = 2.0
"""Millimetres in x."""
RATE = 40.0
"""r, 1 / s."""

Controller = Callable[[int, FloatArray], FloatArray]
"""From a tick and the (2,) position measured at it to the command for the next, (2, 3): acceleration, velocity, position."""


class Execution(NamedTuple):
    """T ticks."""

    positions: FloatArray
    """(T, 2) array, mm: where the robot was."""
    commands: FloatArray
    """(T, 2, 3) array: what it was told at each tick for the next."""
    efforts: FloatArray
    """(T, 2) array, mm/s^2: what the robot's own controller added at each tick; 0 while it was held."""


def plan_of(dmp: ProbabilisticDMP) -> GaussianTrajectory:
    """From the mean start to the mean goal, which are told."""
    return dmp.rollout(start=dmp.primitive_.start, goal=dmp.primitive_.goal)


def position_sensor(dmp: ProbabilisticDMP, std: float | None) -> list[LinearSensor] | None:
    """One of a given standard deviation, mm; None: as learned."""
    return None if std is None else [state_sensor(dmp.primitive_, "position", "position", std)]


class Inferred:
    """The library, and what its ticks have shown."""

    def __init__(self, dmp: ProbabilisticDMP, std: float | None = None) -> None:
        told = {"start": dmp.primitive_.start, "goal": dmp.primitive_.goal}
        self.run = dmp.execute(**told, sensors=position_sensor(dmp, std))
        self.steps = []

    def __call__(self, _: int, measured: FloatArray) -> FloatArray:
        step = self.run.step(measured)
        self.steps.append(step)
        return np.stack([step.acceleration, step.velocity, step.position], axis=-1)


def coupled(dmp: ProbabilisticDMP, gain: float) -> Controller:
    """The plan's movement primitive, whose acceleration gets K_c (expected - measured); the plan is what is expected.

    Parameters
    ----------
    gain : K_c, 1 / s^2; below zero it gives way.
    """
    plan, primitive = plan_of(dmp), dmp.primitive_
    system = linear_gaussian_model(primitive, task_for(primitive, primitive.start, primitive.goal), primitive.dt, 2)
    # What goal and forcing term add to the plan at each tick. B belongs to an input in units of the duration.
    drifts = plan.means[1:] - np.matmul(system.transition, plan.means[:-1, ..., None])[..., 0]
    of_acceleration = np.broadcast_to(system.input_matrix[..., 0], (2, 3)) * primitive.duration**2
    state = plan.means[0]

    def command(tick: int, measured: FloatArray) -> FloatArray:
        nonlocal state
        extra = gain * (plan.positions[tick] - measured)
        state = np.matmul(system.transition, state[..., None])[..., 0] + drifts[min(tick, len(drifts) - 1)]
        state = state + of_acceleration * extra[:, None]
        return state

    return command


def displace(dmp: ProbabilisticDMP, command: Controller, by: float = BY, noise_std: float = 0.0, seed: int = 0) -> Execution:
    """Execute the plan.

    Parameters
    ----------
    by : how far the hand holds it off, mm; 0 leaves it alone.
    noise_std : of the robot's sensor, mm. Without noise, all that one sees is the displacement.
    """
    plan, dt, rng = plan_of(dmp), dmp.primitive_.dt, np.random.default_rng(seed)
    decay = np.exp(-RATE * dt) * np.array([[1 + RATE * dt, dt], [-(RATE**2) * dt, 1 - RATE * dt]])
    robot, robots, commands, efforts = plan.means[0][:, [2, 1]].T, [], [], []  # position and velocity, (2, 2)
    for tick, due in enumerate(plan.times + dt):
        robots.append(robot)
        commands.append(command(tick, robot[0] + noise_std * rng.standard_normal(2)))
        now, then = (plan.means[min(k, len(plan.times) - 1)] for k in (tick, tick + 1))
        # The reference within a tick is off the plan by what gets it, at the commanded acceleration, to the command.
        a, v, p = (commands[-1] - then).T
        errors = robot - now[:, [2, 1]].T - np.stack([p - v * dt + a * dt**2 / 2, v - a * dt])
        efforts.append(-(RATE**2) * errors[0] - 2 * RATE * errors[1])
        robot = commands[-1][:, [2, 1]].T + decay @ errors
        if by and HELD[0] <= due < HELD[1]:
            share, efforts[-1] = min((due - HELD[0]) / DRAGGED, 1.0), np.zeros(2)
            off = [by * share**2 * (3 - 2 * share), by * 6 * share * (1 - share) / DRAGGED]
            robot = then[:, [2, 1]].T + np.outer(off, [1.0, 0.0])
    return Execution(np.array(robots)[:, 0], np.array(commands), np.array(efforts))
