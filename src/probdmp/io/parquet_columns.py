"""Which columns of a Parquet file that others have written are what, and their numbers; `parquet_foreign` has the names."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from probdmp.checks import FloatArray
from probdmp.errors import DataFileError
from probdmp.io import csv_header
from probdmp.io.csv_header import PER_SECOND, only_of_kind, split_unit
from probdmp.io.parquet_arrays import list_lengths, numbers_of
from probdmp.io.parquet_layout import ID, LABEL, UNIT, is_list_of_numbers, is_moment, is_number, is_text, layout_of
from probdmp.io.recordings import listing

__all__ = ["Roles", "columns_of", "roles_of"]

CUT = (*csv_header.CUT, ID, "episode_index")
LABELS = (*csv_header.LABEL, LABEL)


class Roles(NamedTuple):
    """Titles of the columns by what they are for."""

    time: str | None
    cut: str | None
    label: str | None
    numbers: tuple[str, ...]


def roles_of(schema: Any, name: str) -> Roles:
    """What each column is for, by its name and type.

    Raises
    ------
    DataFileError
        If names are there twice, or the time is no time.
    """
    titles = list(schema.names)
    if len(set(titles)) < len(titles):
        raise DataFileError(f"different names of columns in {name}", listing(map(repr, titles)))
    plain = [split_unit(title)[0] for title in titles]
    places = (only_of_kind(kind, plain, f"in {name}") for kind in (csv_header.TIME, CUT, LABELS))
    time, cut, label = (None if place is None else titles[place] for place in places)
    types = {title: schema.field(title).type for title in titles}
    if time is not None and not (is_number(types[time]) or is_moment(types[time])):
        raise DataFileError(f"numbers or timestamps in the column {time!r} of {name}", str(types[time]))
    if time is not None and split_unit(time)[1].lower() not in PER_SECOND:
        raise DataFileError(f"time in s, ms, us or ns in {name}", repr(time), "Convert it to seconds: time [s].")
    if label is not None and not is_text(types[label]):
        label = None  # such as a number of classes: a column like any other
    told = layout_of(schema, name).told if ID in titles else ()
    numbers = [
        t for t in titles if t not in (time, cut, label, *told) and (is_number(types[t]) or is_list_of_numbers(types[t]))
    ]
    return Roles(time, cut, label, tuple(numbers))


def columns_of(
    rows: Any, titles: Sequence[str], schema: Any, name: str
) -> tuple[dict[str, FloatArray], dict[str, list[str]], dict[str, str]]:
    """Columns of numbers by name, names of those that come from lists, and units.

    Raises
    ------
    DataFileError
        If two have the same name, or lists differ in length.
    """
    columns: dict[str, FloatArray] = {}
    groups: dict[str, list[str]] = {}
    units: dict[str, str] = {}
    for title in titles:
        plain, unit = split_unit(title)
        unit = unit or (schema.field(title).metadata or {}).get(UNIT, b"").decode(errors="replace")
        found = dict(_unpacked(rows[title], plain, name))
        if not found.keys().isdisjoint(columns):
            raise DataFileError(f"different names of columns in {name}", listing(map(repr, found)))
        columns |= found
        units |= dict.fromkeys(found, unit)
        groups |= {plain: list(found)} if plain not in found else {}
    return columns, groups, units


def _unpacked(column: Any, plain: str, name: str) -> Iterator[tuple[str, FloatArray]]:
    if not is_list_of_numbers(column.type):
        yield plain, numbers_of(column)
        return
    lengths = set(list_lengths(column).tolist())
    if len(lengths) != 1 or lengths == {0} or column.null_count:
        raise DataFileError(f"lists of one length in the column {plain!r} of {name}", listing(sorted(lengths), 5))
    width = lengths.pop()
    for i, values in enumerate(numbers_of(column).reshape(-1, width).T):
        yield f"{plain}_{i}", values
