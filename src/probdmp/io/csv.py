"""Demonstrations in a CSV file: one row per sample, one column per measured quantity, named and with units in the first line.

    demonstration,label,time [s],x [mm],y [mm],pen_force
    0,a,0.0,1.5,2.5,0.1
    0,a,0.01,1.6,,0.1
    …

One file holds one demonstration, or several that a column tells apart: a new value in the column demonstration (or demo,
trial, …), or without one in the column label, begins the next one. `csv_header` says which names columns may have, `csv_table`
how numbers and missing ones are written, `csv_lines` which encodings and delimiters are known, `csv_clock` what is made of
the times.
"""

import csv
import io
import itertools
import os
from collections.abc import Iterator, Sequence

import numpy as np

from probdmp.demonstrations import Demonstration
from probdmp.errors import InputError
from probdmp.io.atomic import write_atomically
from probdmp.io.csv_clock import constant_rate
from probdmp.io.csv_header import CUT, LABEL, TIME, split_unit
from probdmp.io.csv_lines import LARGEST_CSV, LONGEST_LINE, REPLACEMENT
from probdmp.io.csv_table import read_blocks
from probdmp.io.recordings import Recordings, check_alike, demonstrations_of, positions_by_name
from probdmp.io.selection import EVERYTHING, Selection

__all__ = ["read_csv", "write_csv"]

PLAIN = 12
"""Significant digits of times, if dt needs no more: 0.29 rather than 0.29000000000000004."""


def read_csv(path: str | os.PathLike[str], selection: Selection = EVERYTHING) -> list[Demonstration]:
    """Demonstrations from a CSV file.

    Raises
    ------
    DataFileError
        If the file is not such a table; the message names line and column.
    InputError, InputTypeError
        If no demonstration has the label, the file has not the columns, or dt is needed.

    Warns
    -----
    RecordingWarning
        If times are not even and samples had to be put in or resampled.
    """
    name = os.fspath(path)
    header, blocks = read_blocks(path)
    step, tables = constant_rate(header, blocks, selection.dt, name)
    recordings = Recordings(
        data=np.concatenate(tables),
        offsets=[0, *itertools.accumulate(map(len, tables))],
        labels=[block.label for block in blocks],
        dt=step,
        columns=list(header.names),
        units=list(header.units),
        positions=[],
    )
    return demonstrations_of(recordings, selection, name)


def write_csv(path: str | os.PathLike[str], demonstrations: Sequence[Demonstration]) -> None:
    """Write demonstrations, replacing the file in one step; reading gives the same values back.

    Where no name says that a column is a position, reading needs to be told: `columns=`. Channels have no units.

    Raises
    ------
    InputError, InputTypeError
        If there are none, they differ in dt, names, units or channels, or a CSV file cannot hold them.
    """
    checked = check_alike(demonstrations)
    first = checked[0]
    columns = [*first.names, *first.channels]
    by_name = positions_by_name(columns)
    if by_name and by_name != list(first.names):
        hint = "Rename columns so that positions alone are named x, y, z, q… or dof0, …, or write .npz."
        raise InputError("names that say which columns are positions", f"{columns!r:.200}", hint)
    reserved = [name for name in columns if split_unit(name)[0].lower() in (*TIME, *CUT, *LABEL)]
    if reserved:
        raise InputError(
            "columns not named as time, demonstration or label are", f"{reserved!r:.200}", "Rename, or write .npz."
        )
    texts = [*columns, first.units, *(d.label for d in checked)]
    odd = [text for text in texts if _is_odd(text)] + [first.units] * any(bracket in first.units for bracket in "[]")
    if odd or "" in columns:
        expected = "names, units and labels without line breaks, outer spaces, empty names, and brackets in units"
        raise InputError(expected, f"{(odd or columns)[0]!r:.200}", "Rename, or write .npz.")
    buffer = io.StringIO()
    for line in _lines(checked):
        buffer.write(line + "\n")
        if len(line) > LONGEST_LINE or buffer.tell() > LARGEST_CSV:
            raise InputError(f"at most {LARGEST_CSV} bytes and {LONGEST_LINE} characters per line", "more", "Write .npz.")
    write_atomically(path, buffer.getvalue().encode())


def _lines(demonstrations: Sequence[Demonstration]) -> Iterator[str]:
    """The header, then a line for each sample."""
    first = demonstrations[0]
    several, labelled = len(demonstrations) > 1, any(d.label for d in demonstrations)
    titles = [_titled(name, first.units) for name in first.names] + [_titled(name, "") for name in first.channels]
    yield ",".join(map(_cell, ["demonstration"] * several + ["label"] * labelled + ["time [s]"] + titles))
    is_plain = float(f"{first.dt:.{PLAIN}g}") == first.dt
    for k, demonstration in enumerate(demonstrations):
        begin = "".join([f"{k},"] * several + [_cell(demonstration.label) + ","] * labelled)
        channels = (demonstration.channels[name] for name in first.channels)
        table = np.column_stack([demonstration.positions, *channels]).tolist()
        for time, row in zip(demonstration.times.tolist(), table, strict=True):
            clock = f"{time:.{PLAIN}g}" if is_plain else repr(time)
            yield begin + clock + "".join("," if number != number else f",{number!r}" for number in row)


def _titled(name: str, units: str) -> str:
    """A title from which name and unit are read again; an empty unit shows where the name looks as if it had one."""
    return f"{name} [{units}]" if units or split_unit(name) != (name, "") else name


def _cell(text: str) -> str:
    """Quoted where it must be, also for what would be taken for another delimiter."""
    if ";" in text or "\t" in text:
        return '"' + text.replace('"', '""') + '"'
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="").writerow([text, "."])
    return buffer.getvalue()[:-2]


def _is_odd(text: str) -> bool:
    """Whether reading would not give this text back."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return True
    return text != text.strip() or any(c in text for c in ("\n", "\r", "\0", REPLACEMENT))
