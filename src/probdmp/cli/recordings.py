"""Which recordings and which primitive a command speaks of."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from probdmp.cli.exit_codes import UsageError, usage
from probdmp.errors import DataFileError

if TYPE_CHECKING:
    from probdmp.demonstrations import Demonstration
    from probdmp.estimator import PrimitiveLibrary, ProbabilisticDMP

__all__ = ["choose_primitive", "primitive_of", "read_executions", "read_files", "read_recording"]


def read_files(paths: Sequence[Path], columns: Sequence[str] | None, label: str | None = None) -> list["Demonstration"]:
    """Demonstrations from files, all or those with a label.

    Parameters
    ----------
    columns : names of the columns that are positions; as the files say unless given.
    """
    from probdmp.io import read_demonstrations

    everything: list[Demonstration] = []
    for path in paths:
        if columns is None:
            everything += read_demonstrations(path)
        else:
            with usage():
                everything += read_demonstrations(path, columns=columns)
    return _labelled(everything, label)


def read_executions(path: Path, library: "PrimitiveLibrary", label: str | None) -> list["Demonstration"]:
    """Recorded executions of the primitives of a library: all, or those with a label.

    Recordings without a label are executions of whatever primitive is asked for, and get its label.
    """
    from probdmp.io import read_demonstrations

    _, first = choose_primitive(library, label if label is not None else next(iter(library)))
    primitive = first.primitive_
    chosen = _labelled(read_demonstrations(path, columns=primitive.names), label)
    units = chosen[0].units
    if units and primitive.units and units != primitive.units:
        raise DataFileError(f"positions in {primitive.units}, as learned, in {str(path)!r}", units, "Convert them first.")
    return chosen


def read_recording(
    path: Path, library: "PrimitiveLibrary", label: str | None, index: int
) -> tuple[str, "ProbabilisticDMP", "Demonstration"]:
    """One recorded execution, the primitive it is an execution of, and the label of that."""
    chosen = read_executions(path, library, label)
    if index >= len(chosen):
        raise UsageError(f"--index from 0 to {len(chosen) - 1}", str(index), f"There are {len(chosen)} such recordings.")
    return *primitive_of(library, chosen[index]), chosen[index]


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


def _labelled(recordings: list["Demonstration"], label: str | None) -> list["Demonstration"]:
    """All recordings, or those with the label; those without any count as having it."""
    if label is None:
        return recordings
    chosen = [replace(recording, label=label) for recording in recordings if recording.label in (label, "")]
    if not chosen:
        present = ", ".join(map(repr, sorted({recording.label for recording in recordings})))
        raise UsageError(f"--label to be one of those in the file: {present}", repr(label))
    return chosen
