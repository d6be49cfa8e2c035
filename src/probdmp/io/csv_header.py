"""The first line of a CSV file: what each column is, from its name and the unit behind it.

    time     t, time or timestamp: seconds unless a unit says otherwise, as in "time [ms]"
    cut      demonstration, demo, trial, episode, execution or recording: a new value begins a new demonstration
    label    label or class: what movement it is
    numbers  all others with a name, "x [mm]" or "y (mm)"

Case does not matter but for numbers. Columns without a name, such as the row numbers that pandas writes, are left out.
"""

import re
from collections.abc import Sequence
from typing import NamedTuple

from probdmp.errors import DataFileError
from probdmp.io.recordings import MOST_COLUMNS, listing

__all__ = ["CUT", "EXAMPLE", "LABEL", "PER_SECOND", "TIME", "Header", "only_of_kind", "parse_header", "split_unit"]

TIME = ("time", "t", "timestamp")
CUT = ("demonstration", "demo", "trial", "episode", "execution", "recording")
LABEL = ("label", "class")
EXAMPLE = "The first line names the columns, such as: demonstration,label,time [s],x [mm],y [mm]"

PER_SECOND = {
    "": 1.0,
    **dict.fromkeys(("s", "sec", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "millisecond", "milliseconds"), 1e3),
    **dict.fromkeys(("us", "µs", "μs", "microseconds"), 1e6),
    **dict.fromkeys(("ns", "nanoseconds"), 1e9),
}


class Header(NamedTuple):
    """Which column is what; columns by their places from 0."""

    titles: tuple[str, ...]
    """As they stand in the file."""
    time: int | None
    time_unit: str
    cut: int | None
    label: int | None
    numbers: tuple[int, ...]
    names: tuple[str, ...]
    """Of the numbers."""
    units: tuple[str, ...]
    """Of the numbers."""

    @property
    def measured(self) -> tuple[int, ...]:
        """Places of all columns that hold numbers, the time first."""
        return self.numbers if self.time is None else (self.time, *self.numbers)

    @property
    def per_second(self) -> float:
        """How many units of the time column make a second."""
        return PER_SECOND[self.time_unit]


def split_unit(title: str) -> tuple[str, str]:
    """Name and unit of a title such as `x [mm]` or `x (mm)`; the unit is empty if there is none."""
    match = re.fullmatch(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))", title)
    return (match[1], (match[2] or match[3] or "").strip()) if match and match[1] else (title, "")


def parse_header(titles: Sequence[str], place: str) -> Header:
    """What the columns are.

    Parameters
    ----------
    titles : cells of the first line.
    place : "on line 1 of f.csv", for messages.

    Raises
    ------
    DataFileError
        If the line has no names, has them twice, or time has an unknown unit.
    """
    if len(titles) > MOST_COLUMNS:
        raise DataFileError(f"at most {MOST_COLUMNS} columns {place}", f"{len(titles)}", "Is it a table of samples?")
    if all(_is_number(title) for title in titles if title):
        raise DataFileError(f"names of columns {place}", f"numbers: {listing(map(repr, titles), 5)}", EXAMPLE)
    pairs = [split_unit(title) for title in titles]
    names = [name for name, _ in pairs if name]
    if len(set(names)) < len(names):
        twice = listing(repr(name) for name in dict.fromkeys(names) if names.count(name) > 1)
        raise DataFileError(f"different names of columns {place}", f"{twice} more than once", EXAMPLE)
    time, cut, label = (only_of_kind(kind, [name for name, _ in pairs], place) for kind in (TIME, CUT, LABEL))
    time_unit = "" if time is None else pairs[time][1].lower()
    if time_unit not in PER_SECOND:
        raise DataFileError(f"time in s, ms, us or ns {place}", repr(time_unit), "Convert it to seconds: time [s].")
    numbers = tuple(i for i, (name, _) in enumerate(pairs) if name and i not in (time, cut, label))
    return Header(
        titles=tuple(titles),
        time=time,
        time_unit=time_unit,
        cut=cut,
        label=label,
        numbers=numbers,
        names=tuple(pairs[i][0] for i in numbers),
        units=tuple(pairs[i][1] for i in numbers),
    )


def only_of_kind(kind: Sequence[str], names: Sequence[str], place: str) -> int | None:
    """The place of the column of a kind, if there is one.

    Raises
    ------
    DataFileError
        If there are several.
    """
    found = [i for i, name in enumerate(names) if name.lower() in kind]
    if len(found) > 1:
        got = listing(repr(names[i]) for i in found)
        raise DataFileError(f"one column of the kind of {kind[0]} {place}", got, "Leave one of them out, or rename it.")
    return found[0] if found else None


def _is_number(title: str) -> bool:
    try:
        float(title.replace(",", "."))
    except ValueError:
        return False
    return True
