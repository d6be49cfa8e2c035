"""What every method of an estimator starts from: its learned primitive, and what observes it."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Self

from numpy.typing import ArrayLike

from probdmp.checks import check_seconds
from probdmp.demonstrations import Demonstration, Recording, as_demonstrations
from probdmp.dmp import Primitive
from probdmp.errors import NotFittedError
from probdmp.learning import FitReport
from probdmp.parameters import HasParameters

if TYPE_CHECKING:
    from probdmp.execution import Sensor, SensorArray

__all__ = ["HasPrimitive"]


class HasPrimitive(HasParameters):
    """An estimator of one movement."""

    _kind_of_estimator = "density_estimator"

    primitive_: Primitive
    fit_report_: FitReport | None

    def _learned(self) -> Primitive:
        if not hasattr(self, "primitive_"):
            raise NotFittedError("a learned primitive", "one that was not fitted", "Call fit(demonstrations) first.")
        return self.primitive_

    def _with(self, primitive: Primitive) -> Self:
        other = type(self)(**self.get_params())
        other.primitive_, other.fit_report_ = primitive, None
        return other

    def _step(self, dt: float | None) -> float:
        return self._learned().dt if dt is None else check_seconds(dt, "dt")

    def _array(self, sensors: "Sequence[Sensor] | None") -> "SensorArray":
        from probdmp.execution import SensorArray

        return SensorArray(self._learned(), sensors)

    def _recording(
        self, observations: Recording | Mapping[str, ArrayLike], dt: float | None, array: "SensorArray"
    ) -> Demonstration:
        if isinstance(observations, Mapping):
            from probdmp.execution import recording_of_readings

            return recording_of_readings(array, observations, self._step(dt))
        return as_demonstrations([observations], self._step(dt))[0]
