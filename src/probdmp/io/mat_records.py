"""Which fields of a struct, or variables of a file, are the samples of a recording.

    time       t, time, times or timestamp: seconds; or dt, seconds between samples, as one number
    label      label, name or class: text
    positions  pos, position, positions, p, xyz or x as a matrix; q, joints, joint_positions or theta
    numbers    every other field as long as these, such as vel or F

Time may run along rows or columns. Columns of a matrix are named by its field and their axis, `F_x`, or number from 1, `F_1`;
those of positions x, y and z, or q1, q2, ….
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations.demonstration import SHORTEST_RECORDING
from probdmp.errors import DataFileError
from probdmp.io.constant_rate import check_times
from probdmp.io.mat_file import Value
from probdmp.io.recordings import listing

__all__ = ["LABEL", "STEP", "MatRecord", "is_record", "record_of", "text_in"]

TIME = ("t", "time", "times", "timestamp", "timestamps")
STEP = ("dt", "DT", "Ts")
LABEL = ("label", "name", "class")
POINTS = ("pos", "position", "positions", "p", "xyz", "x")
JOINTS = ("q", "joints", "joint_positions", "joint_pos", "theta")
AXES = ("x", "y", "z")


class MatRecord(NamedTuple):
    """One recording."""

    columns: dict[str, FloatArray]
    """(T,) arrays."""
    clock: FloatArray | None
    """(T,) array, seconds."""
    label: str
    positions: list[str]
    groups: dict[str, list[str]]
    """By field with several columns."""


def is_record(value: Value) -> bool:
    """Whether a struct has a field that is long enough to be a recording."""
    return isinstance(value, dict) and any(_is_matrix(field) for field in value.values())


def text_in(fields: Mapping[str, Value]) -> str:
    """The label, if there is one."""
    return next((fields[key] for key in LABEL if isinstance(fields.get(key), str)), "")


def record_of(fields: Mapping[str, Value], place: str, name: str) -> MatRecord:
    """The recording in a struct.

    Parameters
    ----------
    place : "in demos(2)", for messages.
    name : of the file.

    Raises
    ------
    DataFileError
        If its matrices are not equally long, or its times do not increase.
    """
    matrices = {key: value for key, value in fields.items() if _is_matrix(value)}
    if not matrices:
        got = listing(map(repr, fields))
        raise DataFileError(f"at least {SHORTEST_RECORDING} samples {place} of {name}", f"fewer in the fields {got}")
    times = next((key for key in TIME if _is_row(fields.get(key))), None)
    main = next((key for key in (*POINTS, *JOINTS) if key in matrices and not (key == "x" and _is_row(matrices[key]))), None)
    if times is not None and times not in matrices:
        expected = f"at least {SHORTEST_RECORDING} samples {place} of {name}"
        raise DataFileError(expected, f"{times!r} of {fields[times].size}")
    first = matrices[times or main or next(iter(matrices))]
    n_samples = max(first.shape)
    tables = {key: table for key, value in matrices.items() if (table := _time_first(value, n_samples)) is not None}
    if main is not None and main not in tables:
        shapes = listing(f"{key} {value.shape}" for key, value in matrices.items())
        raise DataFileError(f"{main!r} with {n_samples} samples {place} of {name}", shapes, "One of them is cut off.")
    clock = None
    if times is not None:
        clock = tables.pop(times)[:, 0]
        check_times(clock, name, lambda i: f"{place} at sample {i + 1}")
    else:
        step = next((float(np.ravel(fields[key])[0]) for key in STEP if _is_one_number(fields.get(key))), None)
        clock = None if step is None else step * np.arange(n_samples, dtype=np.float64)
        if clock is not None:
            check_times(clock, name, lambda i: f"{place} at sample {i + 1}, from {step!r} s between them")
    if not tables:
        raise DataFileError(f"numbers besides times {place} of {name}", listing(map(repr, fields)))
    columns, groups = _columns(tables, main)
    chosen = groups.get(main, [main]) if main is not None else []
    if not chosen and len(tables) == 1:
        chosen = list(columns)
    return MatRecord(columns, clock, text_in(fields), chosen, groups)


def _columns(tables: Mapping[str, FloatArray], main: str | None) -> tuple[dict[str, FloatArray], dict[str, list[str]]]:
    """Columns by name; and the names of those of each field that has several."""
    columns: dict[str, FloatArray] = {}
    groups: dict[str, list[str]] = {}
    axes = AXES[: tables[main].shape[1]] if main is not None and main in POINTS and tables[main].shape[1] <= 3 else ()
    for key, table in tables.items():
        names = [key] if table.shape[1] == 1 else _names(key, table.shape[1], key == main, axes)
        if not set(names).isdisjoint({*columns, *tables} - {key}):
            names = [f"{key}_{i + 1}" for i in range(table.shape[1])]
        columns |= dict(zip(names, table.T, strict=True))
        groups |= {key: names} if len(names) > 1 else {}
    return columns, groups


def _names(key: str, count: int, is_main: bool, axes: Sequence[str]) -> list[str]:
    numbers = range(1, count + 1)
    if is_main:
        return list(axes) or [f"q{i}" for i in numbers]
    return [f"{key}_{axis}" for axis in axes] if len(axes) == count else [f"{key}_{i}" for i in numbers]


def _is_matrix(value: Value) -> bool:
    return (
        isinstance(value, np.ndarray) and value.ndim == 2 and min(value.shape) >= 1 and max(value.shape) >= SHORTEST_RECORDING
    )


def _is_row(value: Value) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 2 and value.size != 1 and min(value.shape) <= 1


def _is_one_number(value: Value) -> bool:
    return isinstance(value, np.ndarray) and value.size == 1


def _time_first(value: FloatArray, n_samples: int) -> FloatArray | None:
    """(T, C) array; None if it is of another length."""
    if value.shape[0] == n_samples:
        return value
    return value.T if value.shape[1] == n_samples else None
