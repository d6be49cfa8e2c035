"""The frames of episodes in a data file of a LeRobot dataset."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from probdmp.checks import FloatArray
from probdmp.errors import DataFileError
from probdmp.io.archive import LARGEST_ARCHIVE
from probdmp.io.constant_rate import check_times
from probdmp.io.lerobot_episodes import Episode
from probdmp.io.lerobot_info import LeRobotInfo
from probdmp.io.parquet_arrays import list_lengths, numbers_of
from probdmp.io.parquet_layout import is_list_of_numbers, is_number, open_parquet
from probdmp.io.recordings import listing
from probdmp.io.timed_recordings import Table

__all__ = ["NUMBER_BYTES", "episode_tables"]

JITTER = 0.1
"""Fraction of a frame by which times may miss those of an even clock: they are kept in single precision."""
NUMBER_BYTES = 8


def episode_tables(
    file: Path, episodes: Sequence[Episode], info: LeRobotInfo, names: Mapping[str, tuple[str, ...]], tasks: Mapping[int, str]
) -> Iterator[tuple[int, Table]]:
    """The episodes in a file, with their numbers."""
    rows = _read(file, [*names, "timestamp", "episode_index", "task_index"], [*names, "episode_index"])
    which = _column(rows, "episode_index", 1, file)[:, 0]
    features = {key: _column(rows, key, len(columns), file) for key, columns in names.items()}
    times = _column(rows, "timestamp", 1, file)[:, 0] if "timestamp" in rows.column_names else None
    numbers = _column(rows, "task_index", 1, file)[:, 0] if "task_index" in rows.column_names else None
    for episode in episodes:
        own = np.flatnonzero(which == episode.number)
        place = f"in episode {episode.number}"
        if len(own) != episode.n_frames:
            raise DataFileError(f"{episode.n_frames} frames {place} of {file}", str(len(own)), "Copy the dataset again.")
        columns = {column: features[key][own, i] for key, several in names.items() for i, column in enumerate(several)}
        label = episode.label
        if label is None:
            told = [] if numbers is None else dict.fromkeys(numbers[own].tolist())
            label = "; ".join(tasks[number] for number in told if number in tasks)
        clock = _clock(None if times is None else times[own], len(own), info.fps, place, file)
        yield episode.number, Table(columns, clock, label, place)


def _clock(times: FloatArray | None, n_frames: int, fps: float, place: str, file: Path) -> FloatArray:
    """(T,) array, seconds: those of an even clock where times are its own but for rounding."""
    even = np.arange(n_frames, dtype=np.float64) * (1 / fps)
    if times is None or not n_frames:
        return even
    check_times(times, str(file), lambda i: f"{place} at frame {i}")
    since = times - times[0]
    return even if np.abs(since - even).max() <= JITTER / fps else since


def _read(file: Path, wanted: Sequence[str], needed: Sequence[str]) -> Any:
    import pyarrow as pa

    opened = open_parquet(file)
    present = opened.schema_arrow.names
    missing = [name for name in needed if name not in present]
    if missing:
        raise DataFileError(f"the columns {listing(map(repr, missing))} in {file}", listing(map(repr, present), 20))
    if opened.metadata.num_rows * len(wanted) * NUMBER_BYTES > LARGEST_ARCHIVE:
        raise DataFileError(f"at most {LARGEST_ARCHIVE} bytes of numbers in {file}", f"{opened.metadata.num_rows} rows")
    try:
        return opened.read([name for name in wanted if name in present], use_threads=False)
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = str(error).partition("\n")[0]
        raise DataFileError(f"an undamaged Parquet file at {file}", reason, "Copy the dataset again.") from error


def _column(rows: Any, name: str, width: int, file: Path) -> FloatArray:
    """(T, width) array."""
    column = rows[name]
    is_list = is_list_of_numbers(column.type)
    if not (is_list or is_number(column.type)):
        raise DataFileError(f"{width} numbers in each row of {name!r} in {file}", str(column.type))
    if (is_list and (column.null_count or not (list_lengths(column) == width).all())) or (not is_list and width != 1):
        raise DataFileError(f"{width} numbers in each row of {name!r} in {file}", "fewer or more in some")
    return numbers_of(column).reshape(-1, width)
