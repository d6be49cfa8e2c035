"""How executions lie in a Parquet file, read off its columns.

Long, one row per sample, the rows of an execution one after the other:

    execution_id   text or whole number
    primitive      text, what movement it is; optional
    t              seconds, a number that grows, or a timestamp
    x, y, …        numbers, the degrees of freedom and sensor channels; null or NaN where nothing was measured
    start_x, goal_x, …, duration    numbers, what the execution was told, the same in all its rows; optional

Dense, one row per execution: x, y, … are lists, and so is t, or there is a number dt, seconds, in its place.
"""

import json
import os
import stat
from collections.abc import Collection, Mapping
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple

from probdmp.errors import DataFileError, MissingExtraError
from probdmp.io.recordings import MOST_COLUMNS, listing

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = [
    "DURATION",
    "ID",
    "LABEL",
    "POSITIONS",
    "STEP",
    "TIME",
    "UNIT",
    "ParquetLayout",
    "is_list_of_numbers",
    "is_moment",
    "is_number",
    "is_text",
    "layout_of",
    "open_parquet",
    "positions_told",
    "require_pyarrow",
]

ID, LABEL, TIME, STEP, DURATION = "execution_id", "primitive", "t", "dt", "duration"
TASK = ("start_", "goal_")
UNIT = b"unit"
"""Key in the metadata of a column: the unit of what is in it."""
POSITIONS = b"probdmp.positions"
"""Key in the metadata of the file: JSON, which columns are positions, where their names do not say so."""


class ParquetLayout(NamedTuple):
    """Which column holds what."""

    is_dense: bool
    """Whether a row is an execution, not a sample."""
    label: str | None
    """Column with the name of the movement, if there is one."""
    has_times: bool
    """Whether there are times, not a step."""
    columns: tuple[str, ...]
    """What was measured, sample by sample."""
    told: tuple[str, ...]
    """What executions were told, one number for each."""
    units: Mapping[str, str]
    """By column, where the file says it."""
    positions: tuple[str, ...]
    """Which columns are positions, if the file says so."""


def require_pyarrow(what: str = "Parquet files", extra: str = "fleet") -> None:
    """Refuse, with the command to type, where pyarrow is not installed."""
    if find_spec("pyarrow") is None:
        raise MissingExtraError(f"pyarrow for {what}", "none installed", f"Type: pip install 'probdmp[{extra}]'")


def open_parquet(path: str | os.PathLike[str], **options: Any) -> Any:
    """A `pyarrow.parquet.ParquetFile`, whose pages are read bit by bit.

    Raises
    ------
    DataFileError
        If there is no such file, or it is not an undamaged Parquet file.
    MissingExtraError
        If pyarrow is not installed.
    """
    require_pyarrow()
    import pyarrow as pa
    import pyarrow.parquet as pq

    name = os.fspath(path)
    try:
        is_regular = stat.S_ISREG(os.stat(path).st_mode)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", str(error)).lower()
        raise DataFileError(f"a readable file at {name!r}", reason, "Check the path and its rights.") from error
    if not is_regular:
        raise DataFileError(f"a regular file at {name!r}", "a directory, pipe or device", "Give the path of a file.")
    try:
        return pq.ParquetFile(name, buffer_size=2**20, pre_buffer=False, **options)
    except (pa.ArrowException, OSError) as error:
        reason = str(error).partition("\n")[0]
        raise DataFileError(f"an undamaged Parquet file at {name!r}", reason, "Copy or write it again.") from error


def layout_of(schema: "pa.Schema", name: str, label: str = LABEL) -> ParquetLayout:
    """The layout that columns with such names and types have.

    Parameters
    ----------
    name : of the file, for messages.
    label : name of the column that says what movement an execution is.

    Raises
    ------
    DataFileError
        If a column is missing or of another type than it should be.
    """
    fields = {field.name: field for field in schema}
    if len(fields) < len(schema) or len(fields) > MOST_COLUMNS:
        raise DataFileError(f"at most {MOST_COLUMNS} columns with different names in {name}", listing(map(repr, schema.names)))
    is_dense = any(is_list_of_numbers(field.type) for field in schema)
    reserved = {ID, label, TIME, STEP}
    is_sample = is_list_of_numbers if is_dense else is_number
    sampled = [column for column, field in fields.items() if column not in reserved and is_sample(field.type)]
    told = [column for column in fields if _is_told(column, fields) and is_number(fields[column].type)]
    has_times = TIME in fields
    _check_columns(fields, is_dense, has_times, label, name)
    metadata = {column: field.metadata or {} for column, field in fields.items()}
    return ParquetLayout(
        is_dense,
        label if label in fields else None,
        has_times,
        tuple(column for column in sampled if column not in told),
        tuple(told),
        {column: own[UNIT].decode(errors="replace") for column, own in metadata.items() if UNIT in own},
        positions_told(schema, sampled),
    )


def positions_told(schema: "pa.Schema", columns: Collection[str]) -> tuple[str, ...]:
    """Which of the columns are positions, if the metadata of a file says so; none if it says anything else."""
    try:
        names = json.loads((schema.metadata or {}).get(POSITIONS, b"[]"))
    except ValueError:
        return ()
    return tuple(names) if isinstance(names, list) and all(name in columns for name in names) else ()


def _check_columns(fields: Mapping[str, Any], is_dense: bool, has_times: bool, label: str, name: str) -> None:
    known = listing(f"{column} ({field.type})" for column, field in fields.items())
    needed = {ID: "text or whole numbers"} | ({label: "text"} if label in fields else {})
    for column, kind in needed.items():
        fits = column in fields and (is_text(fields[column].type) or (column == ID and _is_integer(fields[column].type)))
        if not fits:
            hint = "Name the column that tells executions apart so." if column == ID else ""
            raise DataFileError(f"a column {column!r} of {kind} in {name}", f"the columns {known}", hint)
    if is_dense:
        fits = is_list_of_numbers(fields[TIME].type) if has_times else STEP in fields and is_number(fields[STEP].type)
        expected = f"a column {TIME!r} of lists of seconds, or {STEP!r} of seconds, in {name}"
    else:
        fits = has_times and (is_number(fields[TIME].type) or is_moment(fields[TIME].type))
        expected = f"a column {TIME!r} of seconds, numbers or timestamps, in {name}"
    if not fits:
        raise DataFileError(expected, f"the columns {known}", "Name the column with the times of the samples so.")


def _is_told(column: str, fields: Mapping[str, Any]) -> bool:
    return column == DURATION or any(column.startswith(start) and column[len(start) :] in fields for start in TASK)


def _is_integer(kind: Any) -> bool:
    import pyarrow as pa

    return bool(pa.types.is_integer(kind))


def is_number(kind: Any) -> bool:
    """Whether a column is of numbers."""
    import pyarrow as pa

    return bool(_is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind))


def is_moment(kind: Any) -> bool:
    """Whether a column is of times that are no plain numbers."""
    import pyarrow as pa

    return bool(pa.types.is_timestamp(kind) or pa.types.is_duration(kind))


def is_text(kind: Any) -> bool:
    """Whether a column is of text."""
    import pyarrow as pa

    inner = kind.value_type if pa.types.is_dictionary(kind) else kind
    return bool(pa.types.is_string(inner) or pa.types.is_large_string(inner) or pa.types.is_string_view(inner))


def is_list_of_numbers(kind: Any) -> bool:
    """Whether a column is of lists of numbers."""
    import pyarrow as pa

    types = pa.types
    is_list = types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind)
    return bool(is_list and (is_number(kind.value_type)))
