"""Many recorded executions of one primitive as arrays: what a fleet of robots has logged, without an object for each."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeGuard

import numpy as np

from probdmp.checks import FloatArray, IntArray, check_array, check_seconds, is_plain
from probdmp.demonstrations import Demonstration
from probdmp.demonstrations.demonstration import LONGEST_RECORDING, SHORTEST_RECORDING
from probdmp.dmp import Primitive, Task, take_tasks
from probdmp.errors import InputError
from probdmp.execution.readings import recording_of_readings
from probdmp.execution.sensor_array import SensorArray

__all__ = ["ExecutionBatch", "is_batch", "own_batch"]


@dataclass(frozen=True, slots=True, eq=False)
class ExecutionBatch:
    """N executions of equal length, side by side. A float64 array is taken as it is, and not to be written to."""

    observations: FloatArray
    """(N, T, O) array, units of the outputs of the sensors: positions, unless told otherwise; NaN where not measured."""
    tasks: Task
    """With the batch axis (N)."""
    dt: float
    """Seconds between samples."""

    def __post_init__(self) -> None:
        if not is_plain(self.observations) or self.observations.ndim != 3:
            object.__setattr__(self, "observations", check_array(self.observations, "observations", "NTO", missing=True))
        object.__setattr__(self, "dt", check_seconds(self.dt, "dt"))
        if self.tasks.duration.shape != self.observations.shape[:1]:
            raise InputError(f"one task for each of {len(self.observations)} executions", f"{self.tasks.duration.shape}")

    def __len__(self) -> int:
        return len(self.observations)

    def take(self, members: Sequence[int] | IntArray) -> "ExecutionBatch":
        """Some of them."""
        return ExecutionBatch(self.observations[members], take_tasks(self.tasks, members), self.dt)

    def recordings(self, array: SensorArray) -> Iterator[Demonstration]:
        """Each execution by itself."""
        for values in self.observations:
            yield recording_of_readings(array, {name: values[:, part] for name, part in array.slices.items()}, self.dt)


def is_batch(executions: object, primitive: Primitive) -> TypeGuard[FloatArray]:
    """Whether executions are an array (N, T, D) of positions, without gaps, of a primitive that nothing else is known of."""
    if not is_plain(executions) or executions.ndim != 3 or primitive.channel_names:
        return False
    n_executions, n_samples, n_dof = executions.shape
    is_long_enough = SHORTEST_RECORDING <= n_samples <= LONGEST_RECORDING
    return n_executions > 0 and is_long_enough and n_dof == primitive.n_dof and bool(np.isfinite(executions.sum()))


def own_batch(primitive: Primitive, executions: FloatArray, dt: float) -> ExecutionBatch:
    """Executions (N, T, D) as a batch, each told what its recording shows: where it starts, and how long it takes."""
    positions = check_array(executions, "executions", "NTD")
    durations = np.full(len(positions), (positions.shape[1] - 1) * check_seconds(dt, "dt"))
    return ExecutionBatch(positions, Task(positions[:, 0], np.full_like(positions[:, 0], np.nan), durations), dt)
