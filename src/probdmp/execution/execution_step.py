"""What one tick of an execution gives to its controller."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import BoolArray, FloatArray
from probdmp.dmp import Primitive
from probdmp.dmp.phase import phase_at
from probdmp.dmp.transformation_system import ACCELERATION, POSITION, VELOCITY
from probdmp.execution.sensed_ticks import SensedTick
from probdmp.execution.sensor_array import SensorArray
from probdmp.execution.sensor_reports import SensorTrack, sensor_tracks
from probdmp.execution.trajectory import GaussianChannel, channels_of

__all__ = ["ExecutionStep", "Judgement", "Plan"]

Array = TypeVar("Array", bound=NDArray[Any])


class Judgement(Protocol):
    """What every verdict says."""

    @property
    def failed(self) -> bool: ...
    @property
    def time(self) -> float: ...
    @property
    def phase(self) -> float: ...
    @property
    def test_ratio(self) -> float: ...
    @property
    def contributions(self) -> FloatArray: ...


class Plan(NamedTuple):
    """What all ticks of an execution have in common."""

    primitive: Primitive
    array: SensorArray
    """The sensors."""
    duration: float
    """Seconds."""
    dt: float
    """Seconds."""


class ExecutionStep(NamedTuple):
    """What the controller is to reach at the next tick, and what this tick has shown; arrays are read-only."""

    step: int
    """Ticks since the start, of the observation."""
    test_ratio: float
    """Statistic over threshold of the detector, above 1 for an alarm; NaN without a detector."""
    verdict: Judgement | None
    """What the detector says so far; None without a detector."""
    seen: SensedTick
    """What the filter of all sensors has found."""
    commanded: SensedTick
    """What the filter of the sensors that modulate the command has found: mostly the same."""
    held: FloatArray | None
    """(D, 3) array: what is commanded instead after an alarm with `on_alarm="hold"`."""
    plan: Plan
    """What was to be executed."""

    def __repr__(self) -> str:
        due = ", ".join(f"{name} {value:.4g}" for name, value in zip(self.primitive.names, self.position, strict=True))
        ratio = "" if np.isnan(self.test_ratio) else f"; test ratio {self.test_ratio:.2f}"
        failed = "; failed" if self.verdict is not None and self.verdict.failed else ""
        held = "; held" if self.held is not None else ""
        return f"<ExecutionStep due at {self.time:.3f} s: {due}{ratio}{failed}{held}>"

    @property
    def time(self) -> float:
        """Seconds since the start at which the desired state is due."""
        return (self.step + 1) * self.plan.dt

    @property
    def phase(self) -> float:
        """x of the observation."""
        return phase_at(self.step * self.plan.dt, self.plan.duration)

    @property
    def primitive(self) -> Primitive:
        """What is executed."""
        return self.plan.primitive

    @property
    def array(self) -> SensorArray:
        """The sensors."""
        return self.plan.array

    @property
    def position(self) -> FloatArray:
        """(D,) array, data units."""
        return self._desired(POSITION)

    @property
    def velocity(self) -> FloatArray:
        """(D,) array, data units per second."""
        return self._desired(VELOCITY)

    @property
    def acceleration(self) -> FloatArray:
        """(D,) array, data units per second squared."""
        return self._desired(ACCELERATION)

    @property
    def covariance(self) -> FloatArray:
        """(D, 3, 3) array over acceleration, velocity, position."""
        return _read_only(self.commanded.covariance[: self.primitive.n_dof])

    @property
    def log_likelihood(self) -> float:
        """Nats: density of the observation given the past; 0 without one."""
        return self.seen.log_likelihood

    @property
    def contributions(self) -> FloatArray:
        """(O,) array, nats: the share of each output of the sensors in the log-likelihood."""
        return _read_only(self.seen.contributions)

    @property
    def innovations(self) -> FloatArray:
        """(O,) array, units of the outputs: measured minus predicted; NaN where not seen."""
        return _read_only(self.seen.innovations)

    @property
    def innovation_covariance(self) -> FloatArray:
        """(O, O) array, units of the outputs multiplied: covariance of the innovations, seen or not."""
        return _read_only(self.seen.innovation_covariance)

    @property
    def fused(self) -> BoolArray:
        """(O,) array: what was seen and believed."""
        return _read_only(self.seen.fused)

    @property
    def channels(self) -> Mapping[str, GaussianChannel]:
        """What the learned channels should read at the next tick, by name, of one time each."""
        return channels_of(self.primitive, self.commanded.mean[None], self.commanded.covariance[None])

    @property
    def signals(self) -> GaussianChannel:
        """Desired position of each degree of freedom, then what each learned channel should read, at the next tick: (S,)."""
        own, d = self.commanded, self.primitive.n_dof
        means = own.mean[:, POSITION].copy()
        means[:d] = self.position
        return GaussianChannel(means, np.sqrt(np.maximum(own.covariance[:, POSITION, POSITION], 0.0)))

    @property
    def sensors(self) -> dict[str, SensorTrack]:
        """By name of each sensor: its innovation at this tick, how surprising it was, whether it was rejected."""
        seen = self.seen
        return sensor_tracks(self.array, seen.innovations[None], seen.innovation_covariance[None], seen.fused[None])

    def _desired(self, row: int) -> FloatArray:
        state = self.commanded.mean if self.held is None else self.held
        return _read_only(state[: self.primitive.n_dof, row])


def _read_only(array: Array) -> Array:
    """A view: it may be of the filter's own."""
    view = array.view()
    view.flags.writeable = False
    return view
