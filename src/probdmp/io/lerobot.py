"""Demonstrations in a LeRobot dataset, a folder of versions v2.1 or v3.0: every episode is one, its task is the label.

Positions are the feature `observation.state`, by the names that the dataset gives its numbers, or another one that is chosen.
The other vectors of numbers become channels, such as `action.gripper`. Images and videos are left where they are.
"""

import os
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError, InputError
from probdmp.io.archive import LARGEST_ARCHIVE
from probdmp.io.lerobot_episodes import Episode, read_episodes, read_tasks
from probdmp.io.lerobot_frames import NUMBER_BYTES, episode_tables
from probdmp.io.lerobot_info import INFO, LeRobotInfo, read_info
from probdmp.io.parquet_layout import require_pyarrow
from probdmp.io.recordings import demonstrations_of, listing
from probdmp.io.selection import EVERYTHING, Selection
from probdmp.io.timed_recordings import recordings_of

__all__ = ["INFO", "read_lerobot"]

STATE = "observation.state"


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
        tables += list(episode_tables(file, list(members), info, names, tasks))
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
