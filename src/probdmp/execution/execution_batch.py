"""Many recorded executions of one primitive as arrays: what a fleet of robots has logged, without an object for each."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from probdmp.checks import FloatArray, IntArray, check_array, check_seconds, is_plain
from probdmp.demonstrations import Demonstration
from probdmp.dmp import Task, take_tasks
from probdmp.errors import InputError
from probdmp.execution.readings import recording_of_readings
from probdmp.execution.sensor_array import SensorArray

__all__ = ["ExecutionBatch"]


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
