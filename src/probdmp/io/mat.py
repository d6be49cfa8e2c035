"""Demonstrations in a MATLAB file.

What is understood: an array of structs or a cell of them, one for each demonstration; a cell of matrices; plain variables; and
the published Character Trajectories. `mat_records` says which fields are what.
"""

import os
from collections.abc import Iterator, Mapping

import numpy as np

from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError
from probdmp.io.character_trajectories import NAMES, are_characters, character_tables
from probdmp.io.mat_file import Value, read_variables
from probdmp.io.mat_records import JOINTS, LABEL, POINTS, STEP, MatRecord, is_record, record_of, text_in
from probdmp.io.recordings import demonstrations_of, listing
from probdmp.io.selection import EVERYTHING, Selection
from probdmp.io.timed_recordings import Table, recordings_of

__all__ = ["read_mat"]

UNIT_HINT = "Times in milliseconds? Divide them by 1000 and save the file again; or say what is right, with dt or --dt."


def read_mat(path: str | os.PathLike[str], selection: Selection = EVERYTHING) -> list[Demonstration]:
    """Demonstrations from a MATLAB file, version 5 to 7.

    Raises
    ------
    DataFileError
        If the file is damaged, too large, of version 7.3, or holds nothing that is understood.
    InputError, InputTypeError
        If no demonstration has the label, the file has not the columns, or dt is needed.

    Warns
    -----
    RecordingWarning
        If times are not even and samples had to be put in or resampled.
    """
    name = os.fspath(path)
    variables = read_variables(path)
    if are_characters(variables):
        recordings = recordings_of(character_tables(variables, name), NAMES[:2], {}, selection.dt, name)
        return demonstrations_of(recordings, selection, name)
    found = list(_records(variables, name))
    tables = [Table(record.columns, record.clock, record.label, place) for place, record in found]
    first = found[0][1]
    recordings = recordings_of(tables, first.positions, first.groups, selection.dt, name, UNIT_HINT)
    return demonstrations_of(recordings, selection, name)


def _records(variables: Mapping[str, Value], name: str) -> Iterator[tuple[str, MatRecord]]:
    """Every recording, with where it is."""
    lists = {key: records for key, value in variables.items() if (records := _listed(value))}
    shared = {key: variables[key] for key in (*STEP, *LABEL) if isinstance(variables.get(key), str | np.ndarray)}
    if not lists:
        if not is_record(variables):
            got = listing(f"{key} ({_kind(value)})" for key, value in variables.items())
            hint = "Save a struct array with fields such as pos, 3 × T, and t; or a matrix T × D."
            raise DataFileError(f"recordings in {name}", got or "nothing", hint)
        yield "in its variables", record_of(variables, "in its variables", name)
        return
    beside = [key for key in (*POINTS, *JOINTS) if isinstance(variables.get(key), np.ndarray)]
    if beside:
        got = listing(map(repr, [*lists, *beside]))
        raise DataFileError(f"recordings in structs, or in variables, in {name}", f"both: {got}", "Save one of them alone.")
    for key, records in lists.items():
        for i, fields in enumerate(records):
            place = f"in {key} {i + 1}"
            record = record_of({**_steps(shared), **fields}, place, name)
            yield place, record._replace(label=record.label or text_in(shared) or (key if len(lists) > 1 else ""))


def _steps(shared: Mapping[str, Value]) -> dict[str, Value]:
    return {key: value for key, value in shared.items() if key in STEP}


def _listed(value: Value) -> list[Mapping[str, Value]]:
    """The structs of recordings in a variable, or in the only field of it that has them."""
    if is_record(value):
        return [value]
    if isinstance(value, list):
        if value and all(isinstance(item, np.ndarray) for item in value):
            wrapped: list[Mapping[str, Value]] = [{"data": item} for item in value]
            return wrapped if all(map(is_record, wrapped)) and _one_width(value) else []
        if any(map(is_record, value)):
            return [item for item in value if isinstance(item, dict)]
        return [record for item in value if isinstance(item, dict) for record in _listed(item)]
    if isinstance(value, dict):
        inner = [_listed(item) for item in value.values() if isinstance(item, dict | list)]
        found = [records for records in inner if records]
        return found[0] if len(found) == 1 else []
    return []


def _one_width(matrices: list[Value]) -> bool:
    """Whether matrices, time along the longer axis, all have as many columns."""
    return len({min(matrix.shape) for matrix in matrices}) == 1


def _kind(value: Value) -> str:
    if isinstance(value, np.ndarray):
        return " × ".join(map(str, value.shape))
    kinds: dict[type, str] = {dict: "struct", list: "cell or structs", str: "text"}
    return kinds.get(type(value), "something else")
