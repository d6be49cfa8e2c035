"""Many recorded executions of one primitive as arrays: what a fleet of robots has logged, without an object for each."""

from collections.abc import Iterator
from dataclasses import dataclass

from probdmp.checks import FloatArray, check_array, check_seconds
from probdmp.demonstrations import Demonstration
from probdmp.dmp import Primitive, Task, unstack_tasks
from probdmp.errors import InputError
from probdmp.execution.readings import recording_of_readings
from probdmp.execution.recordings import score_recordings
from probdmp.execution.sensor_array import SensorArray

__all__ = ["ExecutionBatch", "score_batch"]


@dataclass(frozen=True, slots=True, eq=False)
class ExecutionBatch:
    """N executions of equal length, side by side."""

    observations: FloatArray
    """(N, T, O) array, units of the outputs of the sensors: positions, unless told otherwise; NaN where not measured."""
    tasks: Task
    """With the batch axis (N)."""
    dt: float
    """Seconds between samples."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "observations", check_array(self.observations, "observations", "NTO", missing=True))
        object.__setattr__(self, "dt", check_seconds(self.dt, "dt"))
        if self.tasks.duration.shape != self.observations.shape[:1]:
            raise InputError(f"one task for each of {len(self.observations)} executions", f"{self.tasks.duration.shape}")

    def __len__(self) -> int:
        return len(self.observations)

    def recordings(self, array: SensorArray) -> Iterator[Demonstration]:
        """Each execution by itself."""
        for values in self.observations:
            yield recording_of_readings(array, {name: values[:, part] for name, part in array.slices.items()}, self.dt)


def score_batch(primitive: Primitive, batch: ExecutionBatch, sensors: SensorArray | None = None) -> FloatArray:
    """Total log-likelihood of each execution given its task, (N,) array, nats."""
    array = SensorArray(primitive) if sensors is None else sensors
    return score_recordings(primitive, unstack_tasks(batch.tasks), list(batch.recordings(array)), array)
