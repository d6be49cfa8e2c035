"""Demonstrations out of a file of many executions: some of each movement, spread over all of it."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from probdmp.checks import IntArray, check_count
from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError, InputError
from probdmp.fleet.plan import parts_of, repeated_ids
from probdmp.io import Executions, ExecutionTable, ParquetExecutions
from probdmp.io.parquet_layout import ID
from probdmp.io.recordings import positions_by_name

__all__ = ["MOST_DEMONSTRATIONS", "Teaching", "teaching_executions"]

MOST_DEMONSTRATIONS = 100
"""Of each movement: more teach hardly more, and cost time and memory."""


@dataclass(slots=True)
class Teaching:
    """What a file has to teach."""

    demonstrations: dict[str, list[Demonstration]] = field(default_factory=dict)
    """By label, in the order of the file."""
    available: Counter[str] = field(default_factory=Counter)
    """By label, how many executions the file has."""
    left_out: Counter[str] = field(default_factory=Counter)
    """By reason, how many of the chosen ones cannot be used."""


def teaching_executions(
    path: str | Path,
    by: str = "primitive",
    *,
    most: int = MOST_DEMONSTRATIONS,
    columns: Sequence[str] | None = None,
    label: str | None = None,
    on_part: Callable[[str, int], None] = lambda name, parts: None,
) -> Teaching:
    """Demonstrations by label, evenly spread over the executions of each: no more are kept in memory.

    Parameters
    ----------
    by : name of the column with the labels.
    most : of each label.
    columns : names of the columns that are positions; unless given, those that the file says, or x, y, z and q….
    label : of this one only.
    on_part : called after each part with the name of the file and the number of parts.

    Raises
    ------
    DataFileError
        If the file cannot be used, or no execution of a label can.
    InputError
        If it has not the columns, or no execution has the label.
    """
    check_count(most, "most")
    file = ParquetExecutions(path, by)
    names = _positions(file, columns)
    if file.layout.label is None:
        raise InputError(f"a column of {file.path}, text, that says what movement an execution is", repr(by))
    executions = file.executions()
    chosen = _spread(executions, most, label)
    parts = [p for p in parts_of(file, executions) if np.any((chosen >= p.first) & (chosen < p.first + p.n_executions))]
    taught = Teaching(available=Counter(executions.labels[code] for code in executions.codes.tolist() if code >= 0))
    for part in parts:
        position = part.first
        for table in file.read(part.span, file.layout.columns):
            inside = chosen[(chosen >= position) & (chosen < position + len(table))]
            for i in (inside - position).tolist():
                _take(table, i, file, names, taught)
            position += len(table)
        on_part(file.path, len(parts))
    lacking = sorted(taught.available.keys() - taught.demonstrations.keys()) if label is None else []
    if lacking or not taught.demonstrations:
        reasons = "; ".join(taught.left_out) or "executions without a label"
        raise DataFileError(f"executions of {', '.join(map(repr, lacking)) or 'anything'} in {file.path}", reasons)
    return taught


def _positions(file: ParquetExecutions, columns: Sequence[str] | None) -> tuple[str, ...]:
    known = file.layout.columns
    names = tuple(columns or file.layout.positions or positions_by_name(known))
    if not names or len(set(names)) < len(names) or not set(names) <= set(known):
        hint = "Say which columns are positions: --columns."
        raise InputError(f"positions to be different ones of {', '.join(known)} in {file.path}", repr(list(names)), hint)
    return names


def _spread(executions: Executions, most: int, label: str | None) -> IntArray:
    """Places of at most so many executions of each label, in the order of the file."""
    if label is not None and label not in executions.labels:
        raise InputError(f"label to be one of {', '.join(map(repr, executions.labels[:40]))}", repr(label))
    once = ~repeated_ids(executions)
    chosen = []
    for code in range(len(executions.labels)) if label is None else [executions.labels.index(label)]:
        own = np.flatnonzero((executions.codes == code) & once)
        if len(own):
            chosen.append(own[np.unique(np.linspace(0, len(own) - 1, min(most, len(own))).round().astype(np.int64))])
    return np.sort(np.concatenate(chosen)) if chosen else np.empty(0, dtype=np.int64)


def _take(table: ExecutionTable, i: int, file: ParquetExecutions, names: tuple[str, ...], taught: Teaching) -> None:
    if table.problems[i]:
        taught.left_out[table.problems[i]] += 1
        return
    columns = table.execution(i)
    positions = np.column_stack([columns.pop(name) for name in names])
    label, units = table.labels[table.codes[i]], file.layout.units.get(names[0], "")
    try:
        demonstration = Demonstration(positions, float(table.steps[i]), label, names, units, columns)
    except InputError as error:
        raise DataFileError(
            f"{error.expected} in {ID} {table.ids[i].as_py()!r} of {file.path}", error.got, error.hint
        ) from error
    taught.demonstrations.setdefault(label, []).append(demonstration)
