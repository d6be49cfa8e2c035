"""Sensors from a TOML file: what observes executions.

    [[sensor]]
    name = "encoder"
    measures = "position"            # or "velocity", "acceleration", or ["velocity:x", "position:y"]
    stds = 0.002                     # for all outputs, or one for each; or covariance = [[4e-6, 0], [0, 4e-6]]
    outputs = ["enc_x", "enc_y"]     # columns of recordings; optional
    gate = 5                         # standard deviations from which a reading is rejected; optional

    [[sensor]]
    name = "mix"
    matrix = [[0, 0, 1, 0, 0, -1]]   # on acceleration, velocity, position of the first degree of freedom, then of the next
    stds = 0.01

    [[sensor]]
    name = "camera"
    kind = "planar_arm"              # the tool of an arm in the plane, whose joint angles are the positions
    link_lengths = [0.4, 0.3]
    stds = 0.005

    [[sensor]]
    name = "pen_force"               # a learned channel; it need not be here to be measured
    gate = 4                         # stds as learned unless given

inf, which TOML has, is the std of an output that says nothing.
"""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from probdmp.errors import DataFileError, InputError, InputTypeError

if TYPE_CHECKING:
    from probdmp.dmp import Primitive
    from probdmp.execution import Sensor

__all__ = ["SensorFile", "read_sensor_file"]

LARGEST_FILE = 1_000_000
"""Bytes."""
MOST_SENSORS = 100
EXAMPLE = 'A sensor looks like [[sensor]] name = "encoder" measures = "position" stds = 0.002, on lines of their own.'
LEARNED = "a channel that was learned with the movement has no more than a name, stds or covariance, and a gate."


@dataclass(frozen=True, slots=True)
class SensorFile:
    """What a file says of its sensors; whether they fit is known when there is a primitive."""

    path: Path
    entries: tuple[Mapping[str, Any], ...]

    def sensors_for(self, primitive: "Primitive") -> "tuple[Sensor, ...]":
        """The sensors of executions of a primitive.

        Raises
        ------
        DataFileError
            If one is not described well, or does not fit; with the file and its name.
        """
        from probdmp.execution import SensorArray

        sensors = tuple(self._built(entry, primitive) for entry in self.entries)
        try:
            SensorArray(primitive, sensors)
        except (InputError, InputTypeError) as error:
            raise DataFileError(f"{error.expected} in {self.path}", error.got, error.hint) from error
        return sensors

    def outputs_for(self, primitive: "Primitive") -> tuple[str, ...]:
        """Names of all that is measured in executions of a primitive, learned channels too."""
        from probdmp.execution import SensorArray

        return SensorArray(primitive, self.sensors_for(primitive)).outputs

    def sensors_for_all(self, primitives: "Mapping[str, Primitive]") -> "tuple[Sensor, ...]":
        """The sensors of executions of any of several primitives, by label.

        Raises
        ------
        DataFileError
            If those of one are not those of another.
        """
        from probdmp.execution import sensors_as_plain

        by_label = {label: self.sensors_for(primitive) for label, primitive in primitives.items()}
        first, *others = by_label
        for label in others:
            if sensors_as_plain(by_label[label]) != sensors_as_plain(by_label[first]):
                hint = (
                    "Degrees of freedom have to be the same, and channels need stds of their own, or what was learned differs."
                )
                raise DataFileError(f"the same sensors for all movements in {self.path}", f"others for {label!r}", hint)
        return by_label[first]

    def _built(self, entry: Mapping[str, Any], primitive: "Primitive") -> "Sensor":
        name = entry["name"]
        try:
            return KINDS[_kind(entry)].build(entry, primitive)
        except (InputError, InputTypeError) as error:
            place = f"{self.path}" if repr(name) in error.expected else f"sensor {name!r:.50} of {self.path}"
            raise DataFileError(f"{error.expected} in {place}", error.got, error.hint) from error


def read_sensor_file(path: Path) -> SensorFile:
    """A file of sensors, checked as far as that is possible without a primitive.

    Raises
    ------
    DataFileError
        If there is no such file, it is no TOML, or a sensor has keys that none has.
    """
    from probdmp.io.regular_file import open_regular

    with open_regular(path, LARGEST_FILE, DataFileError, follow_links=True) as file:
        payload = file.read(LARGEST_FILE + 1)
    try:
        document = tomllib.loads(payload.decode())
    except (ValueError, RecursionError) as error:
        raise DataFileError(f"TOML in {path}", f"something else ({error!s:.200})", EXAMPLE) from error
    entries = document.get("sensor")
    if document.keys() != {"sensor"} or not isinstance(entries, list) or not 0 < len(entries) <= MOST_SENSORS:
        got = f"{', '.join(map(repr, document)) or 'nothing'}"
        raise DataFileError(f"tables [[sensor]], in two brackets, and nothing else in {path}", f"{got:.200}", EXAMPLE)
    for number, entry in enumerate(entries, start=1):
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str) or not entry["name"]:
            raise DataFileError(f"a name as text of sensor {number} in {path}", f"{entry!r:.100}", EXAMPLE)
        _check_keys(entry, path)
    return SensorFile(path, tuple(entries))


def _kind(entry: Mapping[str, Any]) -> str:
    """As it says, or by the key that only one kind has; else it is a learned channel."""
    from probdmp.checks import check_choice

    if "kind" in entry:
        return check_choice(entry["kind"], "kind", KINDS)
    return next((name for name, kind in KINDS.items() if kind.marker in entry), "channel")


def _check_keys(entry: Mapping[str, Any], path: Path) -> None:
    place = f"sensor {entry['name']!r:.50} of {path}"
    try:
        name = _kind(entry)
    except InputError as error:
        raise DataFileError(f"{error.expected} in {place}", error.got, error.hint) from error
    kind = KINDS[name]
    known = ("name", "kind", "stds", "covariance", "gate", *kind.keys)
    unknown = [key for key in entry if key not in known]
    if unknown:
        markers = [other.marker for other in KINDS.values() if other.marker]
        expected = f"one of {', '.join(markers)}" if name == "channel" and "kind" not in entry else f"only {', '.join(known)}"
        raise DataFileError(f"{expected} in {place}", ", ".join(map(repr, unknown)), f"Misspelt? Else: {LEARNED}")
    if kind.marker and kind.marker not in entry:
        raise DataFileError(f"{kind.marker} in {place}", f"{', '.join(map(repr, entry))}")
    noise = entry.keys() & {"stds", "covariance"}
    if len(noise) > 1 or (not noise and name != "channel"):
        hint = "They say how far readings stray from what they measure."
        raise DataFileError(f"either stds or covariance in {place}", "both" if noise else "neither", hint)


def _names(entry: Mapping[str, Any]) -> list[str] | None:
    from probdmp.checks import check_names

    return None if "outputs" not in entry else check_names(entry["outputs"], "outputs")


def _noisy(sensor: "Sensor", entry: Mapping[str, Any]) -> "Sensor":
    """A sensor with the noise that is given, if it is."""
    from probdmp.execution.sensors import variances_from_stds

    if "covariance" in entry:
        return replace(sensor, covariance=entry["covariance"])
    if "stds" in entry:
        return replace(sensor, covariance=variances_from_stds(entry["stds"], sensor.n_outputs, sensor.name))
    return sensor


def _state(entry: Mapping[str, Any], primitive: "Primitive") -> "Sensor":
    from probdmp.execution import state_sensor

    measures = entry["measures"]
    if not isinstance(measures, str) and not (isinstance(measures, list) and all(isinstance(m, str) for m in measures)):
        hint = 'Such as "position", or ["velocity:x", "position:y"].'
        raise InputTypeError("measures as text or a list of texts", f"{measures!r:.60}", hint)
    return _noisy(state_sensor(primitive, entry["name"], measures, 1.0, _names(entry), entry.get("gate")), entry)


def _linear(entry: Mapping[str, Any], primitive: "Primitive") -> "Sensor":
    import numpy as np

    from probdmp.checks import check_array
    from probdmp.execution import LinearSensor

    matrix = check_array(entry["matrix"], f"matrix of sensor {entry['name']!r:.50}", ("O", "3 D"))
    names = tuple(_names(entry) or ())
    return _noisy(LinearSensor(entry["name"], matrix, np.ones(len(matrix)), names, entry.get("gate")), entry)


def _planar_arm(entry: Mapping[str, Any], primitive: "Primitive") -> "Sensor":
    from probdmp.execution import planar_arm_sensor
    from probdmp.execution.planar_arm import check_planar_arm

    name, how = entry["name"], entry.get("linearization", "extended")
    sensor = planar_arm_sensor(name, entry["link_lengths"], 1.0, _names(entry), entry.get("gate"), how)
    check_planar_arm(sensor, primitive)
    return _noisy(sensor, entry)


def _channel(entry: Mapping[str, Any], primitive: "Primitive") -> "Sensor":
    import numpy as np

    from probdmp.execution import ChannelSensor, default_sensors

    learned = {sensor.name: sensor.covariance for sensor in default_sensors(primitive)[1:]}
    # Where it was not learned, that is said when all sensors are put together.
    variance = learned.get(entry["name"], np.eye(1))
    return _noisy(ChannelSensor(entry["name"], variance, entry.get("gate")), entry)


class _Kind(NamedTuple):
    marker: str
    """The key that only this kind has; it must be there."""
    keys: tuple[str, ...]
    """Beside those that every sensor has."""
    build: "Callable[[Mapping[str, Any], Primitive], Sensor]"


KINDS = {
    "state": _Kind("measures", ("measures", "outputs"), _state),
    "linear": _Kind("matrix", ("matrix", "outputs"), _linear),
    "planar_arm": _Kind("link_lengths", ("link_lengths", "outputs", "linearization"), _planar_arm),
    "channel": _Kind("", (), _channel),
}
