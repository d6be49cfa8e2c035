"""Sensors as plain values that JSON can hold, and back: what a detector keeps of the sensors that it was calibrated with.

    {"kind": "linear", "name", "matrix", "covariance", "outputs", "gate"}
    {"kind": "channel", "name", "covariance", "gate"}
    {"kind": "planar_arm", "name", "link_lengths", "covariance", "outputs", "gate", "linearization"}

Matrices are lists of rows. An infinite variance, which JSON does not know, is null; so is a gate that there is none of. Numbers
come back bit for bit.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from probdmp.checks import FloatArray, check_choice, check_names
from probdmp.dmp import Primitive
from probdmp.errors import InputError, InputTypeError
from probdmp.execution.planar_arm import PlanarArm, check_planar_arm, planar_arm_sensor
from probdmp.execution.sensor_array import SensorArray
from probdmp.execution.sensors import ChannelSensor, LinearSensor, NonlinearSensor, Sensor

__all__ = ["sensors_as_plain", "sensors_from_plain"]


def sensors_as_plain(sensors: Sequence[Sensor]) -> list[dict[str, Any]]:
    """Sensors as dicts of numbers, text, None and lists.

    Raises
    ------
    InputError
        If one has a function of the user's own, which no file can hold.
    """
    return [_as_plain(sensor) for sensor in sensors]


def sensors_from_plain(plain: object, primitive: Primitive) -> tuple[Sensor, ...]:
    """Sensors of an execution of a primitive from what `sensors_as_plain` gave.

    Parameters
    ----------
    plain : checked in full: it may come from a file.

    Raises
    ------
    InputError, InputTypeError
        If it is not that, or the sensors do not fit the primitive.
    """
    if not isinstance(plain, list) or not all(isinstance(entry, Mapping) for entry in plain):
        raise InputTypeError("sensors as a list of dicts", f"{plain!r:.100}")
    sensors = tuple(_from_plain(entry, primitive) for entry in plain)
    SensorArray(primitive, sensors)  # which checks that they fit it and each other
    return sensors


def _as_plain(sensor: Sensor) -> dict[str, Any]:
    common = {"name": sensor.name, "covariance": _plain_noise(sensor.covariance), "gate": sensor.gate}
    outputs = list(sensor.outputs)
    if isinstance(sensor, ChannelSensor):
        return {"kind": "channel", **common}
    if isinstance(sensor, LinearSensor):
        return {"kind": "linear", **common, "outputs": outputs, "matrix": sensor.matrix.tolist()}
    arm = sensor.function
    if not isinstance(arm, PlanarArm) or not _is_of_arm(sensor, arm):
        raise InputError(
            "sensors that a file can hold: linear ones, channels, and those of planar_arm_sensor",
            f"{sensor.name!r:.50}, which has a function of its own",
            "Save the model without the detector, and fit the detector again after loading.",
        )
    lengths = {"link_lengths": arm.lengths.tolist(), "linearization": sensor.linearization}
    return {"kind": "planar_arm", **common, "outputs": outputs, **lengths}


def _is_of_arm(sensor: NonlinearSensor, arm: PlanarArm) -> bool:
    """Whether a sensor is as `planar_arm_sensor` makes it."""
    return (sensor.jacobian, sensor.reads, sensor.period) == (arm.jacobian, ("position",), None)


def _plain_noise(covariance: FloatArray) -> list[list[float | None]]:
    return [[None if math.isinf(value) else value for value in row] for row in covariance.tolist()]


def _noise(rows: object, name: str) -> Any:
    """A covariance as `Sensor` takes it; what is in the rows is checked there."""
    if not isinstance(rows, list) or not all(isinstance(row, list) for row in rows):
        raise InputTypeError(f"covariance of sensor {name!r:.50} as a list of rows", f"{rows!r:.60}")
    return [[math.inf if value is None else value for value in row] for row in rows]


def _from_plain(entry: Mapping[str, Any], primitive: Primitive) -> Sensor:
    kind = KINDS[check_choice(entry.get("kind"), "the kind of a sensor", KINDS)]
    expected = {"kind", "name", "covariance", "gate", *kind.keys}
    if entry.keys() != expected:
        raise InputError(f"a sensor with {', '.join(sorted(expected))}", f"{sorted(map(str, entry))!r:.200}")
    if not isinstance(entry["name"], str) or not entry["name"]:
        raise InputTypeError("the name of a sensor as text", f"{entry['name']!r:.50}")
    if "outputs" in kind.keys:
        check_names(entry["outputs"], f"outputs of sensor {entry['name']!r:.50}")
    return kind.build(entry, _noise(entry["covariance"], entry["name"]), primitive)


def _linear(entry: Mapping[str, Any], noise: Any, primitive: Primitive) -> Sensor:
    return LinearSensor(entry["name"], entry["matrix"], noise, tuple(entry["outputs"]), entry["gate"])


def _channel(entry: Mapping[str, Any], noise: Any, primitive: Primitive) -> Sensor:
    return ChannelSensor(entry["name"], noise, entry["gate"])


def _planar_arm(entry: Mapping[str, Any], noise: Any, primitive: Primitive) -> Sensor:
    name, lengths, outputs = entry["name"], entry["link_lengths"], entry["outputs"]
    sensor = planar_arm_sensor(name, lengths, 1.0, outputs, entry["gate"], entry["linearization"])
    check_planar_arm(sensor, primitive)
    return replace(sensor, covariance=noise)


class _Kind(NamedTuple):
    keys: tuple[str, ...]
    """Beside those that every sensor has."""
    build: Callable[[Mapping[str, Any], Any, Primitive], Sensor]


KINDS = {
    "linear": _Kind(("matrix", "outputs"), _linear),
    "channel": _Kind((), _channel),
    "planar_arm": _Kind(("link_lengths", "outputs", "linearization"), _planar_arm),
}
"""By name: what can be in a file."""
