"""Demonstrations in a LeRobot dataset, a folder of versions v2.1 or v3.0: every episode is one, its task is the label.

Positions are the feature `observation.state`, by the names that the dataset gives its numbers, or another one that is chosen.
The other vectors of numbers become channels, such as `action.gripper`. Images and videos are left where they are.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError, InputError
from probdmp.io.archive import LARGEST_ARCHIVE
from probdmp.io.constant_rate import check_times
from probdmp.io.lerobot_episodes import Episode, read_episodes, read_tasks
from probdmp.io.lerobot_info import INFO, LeRobotInfo, read_info
from probdmp.io.parquet_arrays import list_lengths, numbers_of
from probdmp.io.parquet_layout import open_parquet, require_pyarrow
from probdmp.io.recordings import demonstrations_of, listing
from probdmp.io.selection import EVERYTHING, Selection
from probdmp.io.timed_recordings import Table, recordings_of

__all__ = ["INFO", "read_lerobot"]

STATE = "observation.state"
JITTER = 0.1
"""Fraction of a frame by which times may miss those of an even clock: they are kept in single precision."""
NUMBER_BYTES = 8


def read_lerobot(path: str | os.PathLike[str], selection: Selection = EVERYTHING) -> list[Demonstration]:
    """Demonstrations from the folder of a LeRobot dataset.

    Raises
    ------
    DataFileError
        If it is damaged, hostile, too large, of another version, or does not say which feature is the position.
    InputError, InputTypeError
        If no episode has the label, or the dataset has not the columns.
    MissingExtraError
        If pyarrow is not installed.

    Warns
    -----
    RecordingWarning
        If times are not even and samples had to be put in or resampled.
    """
    require_pyarrow("LeRobot datasets", "lerobot")
    name = os.fspath(path)
    info = read_info(Path(path))
    names = _column_names(info, selection, name)
    episodes = _chosen(read_episodes(info), selection.label, name)
    n_frames, width = sum(episode.n_frames for episode in episodes), sum(map(len, names.values()))
    if n_frames * width * NUMBER_BYTES > LARGEST_ARCHIVE:
        hint = "Choose a task: label=…, --label on the command line."
        raise DataFileError(f"at most {LARGEST_ARCHIVE} bytes of numbers in {name}", f"{n_frames} frames of {width}", hint)
    tasks = {} if all(episode.label is not None for episode in episodes) else read_tasks(info)
    tables = []
    for file, members in groupby(sorted(episodes, key=lambda e: (e.file, e.number)), key=lambda e: e.file):
        tables += list(_tables(file, list(members), info, names, tasks))
    ordered = [table for _, table in sorted(tables, key=lambda pair: pair[0])]
    groups = {feature: columns for feature, columns in names.items() if len(columns) > 1 or columns != (feature,)}
    main = next(iter(names))
    recordings = recordings_of(ordered, names[main], groups, selection.dt, name)
    return demonstrations_of(recordings, selection, name)


def _column_names(info: LeRobotInfo, selection: Selection, name: str) -> dict[str, tuple[str, ...]]:
    """By feature, the names of its columns; first the feature that is the position, whose names are as they are."""
    states = [STATE] if STATE in info.features else [key for key in info.features if key.startswith(STATE)]
    asked = [column for column in selection.columns or () if column in info.features]
    main = asked[0] if asked else states[0] if len(states) == 1 else None
    if main is None:
        whole = [f"{key}.{column}" for key, columns in info.features.items() for column in columns]
        if not selection.columns or not set(selection.columns) <= set(whole):
            known = listing(map(repr, info.features), 10)
            hint = "Say which feature is the position: columns=[...], or --columns on the command line."
            raise InputError(f"one feature {STATE} in {name}, or columns to be one", f"the features {known}", hint)
    others = {
        key: tuple(key if column == key else column if column.startswith(key) else f"{key}.{column}" for column in columns)
        for key, columns in info.features.items()
        if key != main
    }
    return others if main is None else {main: info.features[main], **others}


def _chosen(episodes: Sequence[Episode], label: str | None, name: str) -> list[Episode]:
    """Those that may have a label, before the data of any is read."""
    chosen = [episode for episode in episodes if label is None or episode.label in (label, "", None)]
    if not chosen:
        present = listing(sorted({repr(episode.label) for episode in episodes}))
        raise InputError(f"label to be one of the tasks in {name}: {present}", repr(label))
    return chosen


def _tables(
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
    import pyarrow as pa

    column = rows[name]
    kind = column.type
    is_list = pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind)
    number = kind.value_type if is_list else kind
    if not (pa.types.is_floating(number) or pa.types.is_integer(number)):
        raise DataFileError(f"{width} numbers in each row of {name!r} in {file}", str(kind))
    if (is_list and (column.null_count or not (list_lengths(column) == width).all())) or (not is_list and width != 1):
        raise DataFileError(f"{width} numbers in each row of {name!r} in {file}", "fewer or more in some")
    return numbers_of(column).reshape(-1, width)
