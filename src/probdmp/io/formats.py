"""Which module reads and writes which file, by suffix; folders by the file that every one of their kind has."""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path, PurePath
from typing import NamedTuple

from probdmp.demonstrations import Demonstration, trim_still_ends
from probdmp.errors import InputError
from probdmp.io.csv import read_csv, write_csv
from probdmp.io.lerobot import INFO, read_lerobot
from probdmp.io.mat import read_mat
from probdmp.io.mcap_reading import read_mcap
from probdmp.io.mcap_writing import write_mcap
from probdmp.io.npz import read_npz, write_npz
from probdmp.io.parquet import read_parquet, write_parquet
from probdmp.io.rosbag import METADATA, read_rosbag
from probdmp.io.selection import Selection

__all__ = ["FOLDERS", "FORMATS", "Format", "read_demonstrations", "write_demonstrations"]


class Format(NamedTuple):
    """How a kind of file becomes demonstrations, and back."""

    name: str
    read: Callable[[str | os.PathLike[str], Selection], list[Demonstration]]
    write: Callable[[str | os.PathLike[str], Sequence[Demonstration]], None] | None = None
    """None if it is only read."""
    has_topics: bool = False
    extra: str = ""
    """What to install for it: `pip install 'probdmp[…]'`."""


FORMATS: Mapping[str, Format] = {
    ".npz": Format("NumPy", read_npz, write_npz),
    ".csv": Format("CSV", read_csv, write_csv),
    ".parquet": Format("Parquet", read_parquet, write_parquet, extra="fleet"),
    ".mat": Format("MATLAB", read_mat),
    ".bag": Format("ROS 1", read_rosbag, has_topics=True, extra="ros"),
    ".db3": Format("ROS 2", read_rosbag, has_topics=True, extra="ros"),
    ".mcap": Format("MCAP", read_mcap, write_mcap, has_topics=True, extra="ros"),
}
"""By suffix."""

FOLDERS: Mapping[str, Format] = {
    INFO: Format("LeRobot", read_lerobot, extra="lerobot"),
    METADATA: Format("ROS 2", read_rosbag, has_topics=True, extra="ros"),
}
"""Of folders: by the file in them that says what they are."""


def read_demonstrations(
    path: str | os.PathLike[str],
    label: str | None = None,
    columns: Sequence[str] | None = None,
    dt: float | None = None,
    *,
    topic: str | None = None,
    trim: bool = False,
) -> list[Demonstration]:
    """Demonstrations from a file, or folder, of any known format.

    Parameters
    ----------
    label : keep only the demonstrations with this label; those without any get it.
    columns : names of the columns that are positions, in the order wanted; by default x, y, z and q….
    dt : seconds between samples: needed if the file has no times, otherwise what to resample to.
    topic : which topic of a file that has topics; the only one that can be a movement unless given.
    trim : whether to cut what stands still before and after each movement; `demonstrations.trim_still_ends` says how.

    Raises
    ------
    DataFileError
        If the file is damaged, hostile, or does not say which columns are positions.
    InputError, InputTypeError
        If the suffix is unknown, no demonstration has the label, the file has not the columns or the topic, or dt is needed.
    MissingExtraError
        If what reads the format is not installed.

    Warns
    -----
    RecordingWarning
        If times in the file are not even and samples had to be put in or resampled.
    """
    selection = Selection(label, columns, dt, topic)
    chosen = _format_to_read(path)
    if topic is not None and not chosen.has_topics:
        having = [key for key, known in {**FORMATS, **FOLDERS}.items() if known.has_topics]
        hint = f"Topics are in {', '.join(having)}." if having else ""
        raise InputError(f"no topic for {os.fspath(path)}, a {chosen.name} file", repr(topic), hint)
    found = chosen.read(path, selection)
    return [trim_still_ends(demonstration) for demonstration in found] if trim else found


def write_demonstrations(path: str | os.PathLike[str], demonstrations: Sequence[Demonstration]) -> None:
    """Write demonstrations in the format that the suffix names, replacing the file in one step.

    Raises
    ------
    InputError, InputTypeError
        If the suffix is unknown, or the format cannot hold the demonstrations.
    MissingExtraError
        If what writes the format is not installed.
    """
    writers = {suffix: known.write for suffix, known in FORMATS.items() if known.write is not None}
    suffix = PurePath(path).suffix.lower()
    if suffix not in writers:
        raise InputError(f"a file name that ends in {' or '.join(writers)}", repr(os.fspath(path)))
    writers[suffix](path, demonstrations)


def _format_to_read(path: str | os.PathLike[str]) -> Format:
    if os.path.isdir(path):
        for marker, known in FOLDERS.items():
            if (Path(path) / marker).is_file():
                return known
    suffix = PurePath(path).suffix.lower()
    if suffix not in FORMATS:
        hint = "Other programs, spreadsheets too, can save their tables as .csv."
        folders = "".join(f", or a folder with {marker}" for marker in FOLDERS)
        raise InputError(f"a file name that ends in {' or '.join(FORMATS)}{folders}", repr(os.fspath(path)), hint)
    return FORMATS[suffix]
