"""What is asked of one execution: from where, to where, in what time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from probdmp.checks import SECONDS, FloatArray, IntArray, check_array, frozen, shape_text
from probdmp.demonstrations import Demonstration
from probdmp.errors import InputError

__all__ = ["Task", "demonstrated_tasks", "stack_tasks", "take_tasks", "unstack_tasks"]


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """Start, goal and duration of an execution; a batch of executions has leading batch axes.

    `probdmp.dmp.primitive.task_for` makes one from what a user gives, and checks it.
    """

    start: FloatArray
    """p0, (*batch, D) array, data units; NaN where it is not known: as learned, with its learned variance."""
    goal: FloatArray
    """g, (*batch, D) array, data units; NaN where it is not told: as learned, with joint weights uncertain."""
    duration: FloatArray
    """T_d, (*batch) array, seconds."""
    start_velocity: FloatArray | None = None
    """(*batch, D) array, data units per second, known exactly; NaN or None: as learned, with its learned variance."""

    def __post_init__(self) -> None:
        duration = check_array(self.duration, "duration", (None,) * getattr(self.duration, "ndim", 0))
        shortest, longest = SECONDS
        if not np.all((duration >= shortest) & (duration <= longest)):  # NaN is neither
            raise InputError(f"duration from {shortest:g} to {longest:g} seconds", f"{self.duration}")
        object.__setattr__(self, "duration", frozen(duration))
        axes = [*duration.shape, "D"]
        for name in ("start", "goal", "start_velocity"):
            value = getattr(self, name)
            if value is not None or name != "start_velocity":
                object.__setattr__(self, name, frozen(check_array(value, name, axes, missing=True)))
        shapes = {value.shape for value in (self.start, self.goal, self.start_velocity) if value is not None}
        if len(shapes) > 1:
            raise InputError("start, goal and start_velocity of one shape", " and ".join(map(shape_text, sorted(shapes))))


def stack_tasks(tasks: Sequence[Task]) -> Task:
    """Single tasks as one batch."""
    unknown = np.full(tasks[0].start.shape, np.nan)
    return Task(
        np.stack([t.start for t in tasks]),
        np.stack([t.goal for t in tasks]),
        np.stack([t.duration for t in tasks]),
        np.stack([unknown if t.start_velocity is None else t.start_velocity for t in tasks]),
    )


def take_tasks(tasks: Task, members: Sequence[int] | IntArray) -> Task:
    """Some of a batch (N) of tasks, as a batch."""
    velocities = None if tasks.start_velocity is None else tasks.start_velocity[members]
    return Task(tasks.start[members], tasks.goal[members], tasks.duration[members], velocities)


def unstack_tasks(tasks: Task) -> list[Task]:
    """Each of a batch (N) of tasks by itself."""
    velocities = [None] * len(tasks.duration) if tasks.start_velocity is None else tasks.start_velocity
    rows = zip(tasks.start, tasks.goal, tasks.duration, velocities, strict=True)
    return [Task(start, goal, duration, velocity) for start, goal, duration, velocity in rows]


def demonstrated_tasks(demonstrations: Sequence[Demonstration]) -> Task:
    """The tasks that K recordings carried out, from first sample to last, as one batch."""
    return Task(
        start=np.stack([d.positions[0] for d in demonstrations]),
        goal=np.stack([d.positions[-1] for d in demonstrations]),
        duration=np.array([d.duration for d in demonstrations]),
    )
