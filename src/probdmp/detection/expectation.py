"""What is expected of executions of a primitive."""

from dataclasses import dataclass

from probdmp.detection.comparison import Comparison
from probdmp.detection.innovation_watch import watched_sensors
from probdmp.detection.profile import ExecutionProfile
from probdmp.detection.trajectory_model import TrajectoryModel
from probdmp.dmp import Primitive
from probdmp.execution import SensorArray

__all__ = ["Expectation", "watched_names"]


@dataclass(frozen=True, slots=True, eq=False)
class Expectation:
    """What is expected of executions of a primitive."""

    primitive: Primitive
    profile: ExecutionProfile
    trajectory: TrajectoryModel
    """For executions that are told their goal, or for those that are not."""
    others: Comparison
    """The library that the primitive belongs to."""
    array: SensorArray
    """What observes executions."""

    @property
    def watched(self) -> tuple[str, ...]:
        """(W) names of what is judged: positions, learned channels, outputs of other sensors."""
        return watched_names(self.primitive, self.array)


def watched_names(primitive: Primitive, array: SensorArray) -> tuple[str, ...]:
    """(W) names of what is judged: positions, learned channels, outputs of other sensors."""
    others = [output for name in watched_sensors(array) for output in array.outputs[array.slices[name]]]
    return (*primitive.signals.names, *others)
