"""From what a user has to what an array of sensors has observed."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array
from probdmp.demonstrations import Demonstration
from probdmp.errors import InputError, InputTypeError
from probdmp.execution.sensor_array import SensorArray
from probdmp.execution.sensors import ChannelSensor

__all__ = ["observation_of", "readings_of", "recording_of_readings", "stack_readings"]


def readings_of(array: SensorArray, recording: Demonstration) -> FloatArray:
    """What a recording holds of all outputs, (T, O) array; NaN where it holds nothing.

    Raises
    ------
    InputError
        If it has not the columns of a sensor. Channels that were learned may be missing: they are then never measured.
    """
    names = recording.names if recording.has_names else array.dof_names  # bare arrays fit any names
    columns = dict(zip(names, recording.positions.T, strict=False)) | dict(recording.channels)
    for sensor in array.sensors:
        missing = [output for output in sensor.outputs if output not in columns]
        if missing and not isinstance(sensor, ChannelSensor):
            raise InputError(
                f"recordings with the columns {', '.join(sensor.outputs)} of sensor {sensor.name!r}",
                f"one without {', '.join(missing)}",
                "The outputs of a sensor are named as the channels of a demonstration, or as the columns of a file.",
            )
    unseen = np.full(recording.n_samples, np.nan)
    return np.column_stack([columns.get(output, unseen) for output in array.outputs])


def stack_readings(array: SensorArray, recordings: Sequence[Demonstration]) -> FloatArray:
    """Of N recordings side by side, (T, N, O) array; the shorter ones end in NaN, as if nothing more was measured."""
    longest = max(r.n_samples for r in recordings)
    stacked = np.full((longest, len(recordings), len(array.outputs)), np.nan)
    for k, recording in enumerate(recordings):
        stacked[: recording.n_samples, k] = readings_of(array, recording)
    return stacked


def observation_of(array: SensorArray, given: ArrayLike | Mapping[str, ArrayLike | None] | None) -> FloatArray:
    """What is given at one tick as an observation, (O,) array; NaN where nothing was measured.

    Parameters
    ----------
    given : readings by name of their sensors; an array, if it is of the first sensor alone or of all outputs; None: nothing.
    """
    values = np.full(len(array.outputs), np.nan)
    if given is None:
        return values
    if isinstance(given, Mapping):
        for name, reading in given.items():
            part = _outputs_of(array, name)
            if reading is not None:
                values[part] = check_array(
                    np.atleast_1d(reading), f"reading of {name!r}", (part.stop - part.start,), missing=True
                )
        return values
    count = array.sensors[0].n_outputs
    if np.ndim(given) == 1 and np.size(given) == len(values):
        count = len(values)
    values[:count] = check_array(given, "observation", (count,), missing=True)
    return values


def recording_of_readings(array: SensorArray, given: Mapping[str, ArrayLike], dt: float) -> Demonstration:
    """Readings (T, O) by name of their sensors as a recording; positions that no sensor measures are missing.

    Raises
    ------
    InputError, InputTypeError
        If there are none, a name is no sensor's, or they are not equally long.
    """
    if not given:
        raise InputError(f"readings of the sensors {', '.join(map(repr, array.names))}", "none")
    columns: dict[str, FloatArray] = {}
    for name, values in given.items():
        part = _outputs_of(array, name)
        count = part.stop - part.start
        shape = ("T",) if np.ndim(values) == count == 1 else ("T", count)
        table = check_array(values, f"readings of {name!r}", shape, missing=True)
        columns |= zip(array.outputs[part], table.reshape(-1, count).T, strict=True)
    lengths = {len(column) for column in columns.values()}
    if len(lengths) > 1:
        hint = "A sensor that measures less often has NaN in between; probdmp.demonstrations.channel_from_times puts it there."
        raise InputError("readings of all sensors at the same times", f"{sorted(lengths)} of them", hint)
    unseen = np.full(lengths.pop(), np.nan)
    positions = np.column_stack([columns.pop(name, unseen) for name in array.dof_names])
    unread = {output: unseen for output in array.outputs if output not in array.dof_names and output not in columns}
    return Demonstration(positions, dt, names=array.dof_names, channels=columns | unread)


def _outputs_of(array: SensorArray, name: object) -> slice:
    if not isinstance(name, str):
        raise InputTypeError("readings by name of their sensors", f"{name!r:.50}")
    if name not in array.slices:
        raise InputError(f"readings of the sensors {', '.join(map(repr, array.names))}", f"one of {name!r:.50}")
    return array.slices[name]
