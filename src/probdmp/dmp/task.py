"""What is asked of one execution: from where, to where, in what time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration

__all__ = ["Task", "demonstrated_tasks"]


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """Start, goal and duration of an execution; a batch of executions has leading batch axes.

    `probdmp.dmp.primitive.task_for` makes one from what a user gives, and checks it.
    """

    start: FloatArray
    """p0, (*batch, D) array, data units."""
    goal: FloatArray
    """g, (*batch, D) array, data units."""
    duration: FloatArray
    """T_d, (*batch) array, seconds."""
    start_velocity: FloatArray | None = None
    """(*batch, D) array, data units per second, known exactly; NaN or None: as learned, with its learned variance."""


def demonstrated_tasks(demonstrations: Sequence[Demonstration]) -> Task:
    """The tasks that K recordings carried out, from first sample to last, as one batch."""
    return Task(
        start=np.stack([d.positions[0] for d in demonstrations]),
        goal=np.stack([d.positions[-1] for d in demonstrations]),
        duration=np.array([d.duration for d in demonstrations]),
    )
