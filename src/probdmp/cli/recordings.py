"""Which recordings and which primitive a command speaks of."""

import re
import sys
import warnings
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from probdmp.cli.exit_codes import UsageError, usage
from probdmp.cli.sensor_file import read_sensor_file
from probdmp.errors import DataFileError, InputError, RecordingWarning

if TYPE_CHECKING:
    from probdmp.demonstrations import Demonstration
    from probdmp.estimator import PrimitiveLibrary, ProbabilisticDMP
    from probdmp.execution import Sensor

__all__ = [
    "choose_primitive",
    "label_of_file",
    "primitive_of",
    "read_executions",
    "read_files",
    "read_recording",
    "read_sensed",
]


def read_files(paths: Sequence[Path], label: str | None = None, **wanted: Any) -> list["Demonstration"]:
    """Demonstrations from files, all or those with a label.

    In several files, recordings without a label are named by their file: those of reach_03.csv are labelled reach.

    Parameters
    ----------
    wanted : of `read_demonstrations`: columns, dt, topic, trim.
    """
    asked = any(value is not None and value is not False for value in wanted.values())
    with usage() if asked else nullcontext():
        found = _read(paths, wanted)
    if label is not None:
        return [d for _, d in _labelled(found, label)]
    return [replace(d, label=label_of_file(path)) if len(paths) > 1 and not d.label else d for path, d in found]


def read_executions(
    paths: Sequence[Path],
    library: "PrimitiveLibrary",
    label: str | None,
    dt: float | None = None,
    outputs: Sequence[str] = (),
) -> list[tuple[Path, "Demonstration"]]:
    """Recorded executions of the primitives of a library, with the files they are from: all, or those with a label.

    Recordings without a label are executions of whatever primitive is asked for, and get its label; unless one is, of the
    primitive that their file is named after, if there is one.

    Parameters
    ----------
    outputs : names of what sensors measure; a file that has them need not have positions, which are then missing.
    """
    _, first = choose_primitive(library, label if label is not None else next(iter(library)))
    primitive = first.primitive_
    with nullcontext() if dt is None else usage():
        found = _read(paths, {"columns": primitive.names, "dt": dt}, outputs)
    chosen = _labelled(found, label) if label is not None else [(path, _named_by(path, d, library)) for path, d in found]
    units = next((d.units for _, d in chosen if d.units != primitive.units), "")
    if units and primitive.units:
        place = " and ".join(repr(str(path)) for path in paths)
        raise DataFileError(f"positions in {primitive.units}, as learned, in {place}", units, "Convert them first.")
    return chosen


def read_recording(
    path: Path,
    library: "PrimitiveLibrary",
    label: str | None,
    index: int,
    dt: float | None = None,
    outputs: Sequence[str] = (),
) -> tuple[str, "ProbabilisticDMP", "Demonstration"]:
    """One recorded execution, the primitive it is an execution of, and the label of that; arguments as above."""
    chosen = read_executions([path], library, label, dt, outputs)
    if index >= len(chosen):
        raise UsageError(f"--index from 0 to {len(chosen) - 1}", str(index), f"There are {len(chosen)} such recordings.")
    recording = chosen[index][1]
    return *primitive_of(library, recording), recording


def read_sensed(
    path: Path, library: "PrimitiveLibrary", label: str | None, index: int, dt: float | None, sensors: Path | None
) -> tuple[str, "ProbabilisticDMP", "Demonstration", "tuple[Sensor, ...] | None"]:
    """The same with the sensors that have observed it.

    Parameters
    ----------
    sensors : the file that says which; positions and learned channels unless given.
    """
    if sensors is None:
        return *read_recording(path, library, label, index, dt), None
    file, first = read_sensor_file(sensors), next(iter(library.values()))
    outputs = file.outputs_for((first if label is None else choose_primitive(library, label)[1]).primitive_)
    name, learned, recording = read_recording(path, library, label, index, dt, outputs)
    return name, learned, recording, file.sensors_for(learned.primitive_)


def primitive_of(library: "PrimitiveLibrary", recording: "Demonstration") -> tuple[str, "ProbabilisticDMP"]:
    """The primitive that a recording is an execution of: the only one, or the one with its label."""
    return choose_primitive(library, None if len(library) == 1 else recording.label)


def choose_primitive(library: "PrimitiveLibrary", label: str | None) -> tuple[str, "ProbabilisticDMP"]:
    """The primitive with a label; one that is alone need not be named, and one without a label goes by any.

    Raises
    ------
    UsageError
        If there is none, or several and no label.
    """
    alone = next(iter(library)) if len(library) == 1 else None
    chosen = alone if label is None or alone == "" else label
    if chosen is None or chosen not in list(library):  # a label from a stream may be of any kind
        labels = ", ".join(map(repr, library))
        raise UsageError(f"--label to be one of those in the model: {labels}", "none" if label is None else repr(label))
    return chosen, library[chosen]


def label_of_file(path: Path) -> str:
    """What a file is named after, without the number of the recording: reach for reach_03.csv."""
    return re.sub(r"[\s_.-]*(\d+|\(\d+\))?$", "", path.stem)


def _named_by(path: Path, recording: "Demonstration", library: "PrimitiveLibrary") -> "Demonstration":
    """A recording without a label with that of its file, if it is one of the library."""
    name = label_of_file(path)
    return replace(recording, label=name) if not recording.label and name in library else recording


def _read(paths: Sequence[Path], wanted: Mapping[str, Any], outputs: Sequence[str] = ()) -> list[tuple[Path, "Demonstration"]]:
    """Every recording with its file; what had to be done to its samples is said on standard error."""
    found: list[tuple[Path, Demonstration]] = []
    for path in paths:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", RecordingWarning)
            found += [(path, d) for d in _recordings(path, wanted, outputs)]
        for warning in caught:
            print(f"probdmp: {warning.message}", file=sys.stderr)
    return found


def _recordings(path: Path, wanted: Mapping[str, Any], outputs: Sequence[str]) -> list["Demonstration"]:
    """Those of a file; if it has outputs of sensors, but not all positions, these are missing, unless they are outputs too."""
    from probdmp.io import read_demonstrations

    try:
        return read_demonstrations(path, **wanted)
    except InputError:
        columns = wanted.get("columns") or ()
        needed = {*outputs} & {*columns}
        for output in outputs:
            with suppress(InputError):
                found = read_demonstrations(path, **{**wanted, "columns": [output]})
                if all(needed <= {*d.names, *d.channels} for d in found):
                    return [_as_seen(d, columns) for d in found]
        raise


def _as_seen(recording: "Demonstration", names: Sequence[str]) -> "Demonstration":
    """A recording whose positions are those of its columns that have the names, and missing where it has none."""
    import numpy as np

    from probdmp.demonstrations import Demonstration

    columns = dict(zip(recording.names, recording.positions.T, strict=True)) | dict(recording.channels)
    unseen = np.full(recording.n_samples, np.nan)
    positions = np.column_stack([columns.pop(name, unseen) for name in names])
    return Demonstration(positions, recording.dt, recording.label, tuple(names), channels=columns)


def _labelled(found: Sequence[tuple[Path, "Demonstration"]], label: str) -> list[tuple[Path, "Demonstration"]]:
    """Those with the label; those without any count if their files are named after it, or if no file is."""
    names = [d.label or label_of_file(path) for path, d in found]
    by_file = any(name == label and not d.label for name, (_, d) in zip(names, found, strict=True))
    chosen = [
        (path, replace(d, label=label))
        for name, (path, d) in zip(names, found, strict=True)
        if name == label or not (d.label or by_file)
    ]
    if not chosen:
        present = ", ".join(map(repr, sorted({d.label for _, d in found})))
        raise UsageError(f"--label to be one of those in the file: {present}", repr(label))
    return chosen
