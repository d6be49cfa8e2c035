"""What every demonstration file holds, whatever its format: a table of samples, cut into demonstrations.

Columns named x, y, z, q… or dof0, dof1, … are positions unless the file or the user says otherwise; the others are sensor
channels.
"""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from probdmp.demonstrations import Demonstration, as_demonstrations
from probdmp.errors import DataFileError, InputError, InputTypeError
from probdmp.io.selection import Selection

__all__ = [
    "MOST_COLUMNS",
    "MOST_DEMONSTRATIONS",
    "Recordings",
    "check_alike",
    "demonstrations_of",
    "listing",
    "positions_by_name",
]

MOST_DEMONSTRATIONS = 100_000
MOST_COLUMNS = 1000


class Recordings(NamedTuple):
    """The checked content of a file."""

    data: NDArray[Any]
    """(sum T, C) numbers, data units; NaN where a sample is missing."""
    offsets: list[int]
    """(n + 1): demonstration i is `data[offsets[i]:offsets[i + 1]]`."""
    labels: list[str]
    """(n)"""
    dt: float
    """Seconds."""
    columns: list[str]
    """(C) names, all different."""
    units: list[str]
    """(C)"""
    positions: list[str]
    """Which columns are positions, if the file says so."""
    groups: Mapping[str, Sequence[str]] = MappingProxyType({})
    """Names that stand for several columns, such as that of a field with a column for each axis."""


def demonstrations_of(recordings: Recordings, selection: Selection, name: str) -> list[Demonstration]:
    """Demonstrations from the content of a file.

    Parameters
    ----------
    selection : which; its label and columns count here.
    name : of the file, for messages.

    Raises
    ------
    DataFileError
        If the file does not say which columns are positions, or they are in several units, or cannot be demonstrations.
    InputError, InputTypeError
        If no demonstration has the label, or the file has not the columns.
    """
    label = selection.label
    names = _position_columns(recordings, selection.columns, name)
    by_name = dict(zip(recordings.columns, recordings.units, strict=True))
    units = {column: by_name[column] for column in names}
    if len(set(units.values())) > 1:
        hint = "Convert them to one unit, or choose those that have it with columns=[...], --columns on the command line."
        raise DataFileError(f"positions in one unit in {name}", listing(f"{c} in {u!r}" for c, u in units.items()), hint)
    counts = Counter(recordings.labels)
    if label is not None and label not in counts and "" not in counts:
        present = listing(f"{known!r} ({count})" for known, count in counts.items())
        raise InputError(f"label to be one of those in {name}: {present}", repr(label))
    wanted = [i for i, other in enumerate(recordings.labels) if label is None or other in (label, "")]
    return [_demonstration(recordings, i, label, names, name) for i in wanted]


def positions_by_name(columns: Iterable[str]) -> list[str]:
    """The columns whose names say that they are positions."""
    return [column for column in columns if re.fullmatch(r"x|y|z|q.*|dof\d+", column)]


def listing(items: Iterable[object], most: int = 40) -> str:
    """Items for a message, the first few of many."""
    texts = list(map(str, items))
    return ", ".join(texts[:most]) + (f" and {len(texts) - most} more" if len(texts) > most else "")


def check_alike(demonstrations: Sequence[Demonstration]) -> list[Demonstration]:
    """Demonstrations that one file can hold.

    Raises
    ------
    InputError, InputTypeError
        If there are none or too many, they differ in dt, names, units or channels, or two columns have the same name.
    """
    checked = as_demonstrations(demonstrations)
    first = checked[0]
    for k, other in enumerate(checked):
        for what, wanted, got in (
            ("dt", first.dt, other.dt),
            ("units", first.units, other.units),
            ("channels", sorted(first.channels), sorted(other.channels)),
        ):
            if got != wanted:
                expected = f"demonstrations with the same {what} in one file, {wanted!r}"
                raise InputError(expected, f"{got!r} in demonstration {k}", "Write those that differ to another file.")
    columns = [*first.names, *first.channels]
    if len(set(columns)) < len(columns) or len(columns) > MOST_COLUMNS or len(checked) > MOST_DEMONSTRATIONS:
        raise InputError(
            f"at most {MOST_DEMONSTRATIONS} demonstrations and {MOST_COLUMNS} columns with different names",
            f"{len(checked)} demonstrations with columns {listing(map(repr, columns))}",
        )
    return checked


def _position_columns(recordings: Recordings, columns: Sequence[str] | None, name: str) -> tuple[str, ...]:
    known = listing(map(repr, recordings.columns))
    if columns is None:
        chosen = recordings.positions or positions_by_name(recordings.columns)
        if not chosen:
            hint = "Say which are positions: columns=[...], or --columns on the command line."
            raise DataFileError(f"columns named x, y, z or q… in {name}", known or "none of numbers", hint)
        return tuple(chosen)
    chosen = [
        c for given in columns for c in ([given] if given in recordings.columns else recordings.groups.get(given, [given]))
    ]
    if not chosen or len(set(chosen)) < len(chosen) or not set(chosen) <= set(recordings.columns):
        groups = f"; or all of {listing(map(repr, recordings.groups))}" if recordings.groups else ""
        raise InputError(f"columns to be different ones of {known} in {name}{groups}", repr(list(columns)))
    return tuple(chosen)


def _demonstration(recordings: Recordings, i: int, label: str | None, names: tuple[str, ...], name: str) -> Demonstration:
    rows = recordings.data[recordings.offsets[i] : recordings.offsets[i + 1]]
    by_column = dict(zip(recordings.columns, rows.T, strict=True))
    positions = np.column_stack([by_column.pop(column) for column in names])
    units = recordings.units[recordings.columns.index(names[0])]
    own = recordings.labels[i]
    try:
        return Demonstration(positions, recordings.dt, own or label or "", names, units, by_column)
    except (InputError, InputTypeError) as error:
        raise DataFileError(f"{error.expected} in demonstration {i} ({own!r}) of {name}", error.got, error.hint) from error
