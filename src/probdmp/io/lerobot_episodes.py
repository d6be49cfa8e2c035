"""The episodes of a LeRobot dataset: how long each is, what its task was, and in which file it is.

v2.1   meta/episodes.jsonl, meta/tasks.jsonl; a data file for each episode
v3.0   meta/episodes/…/….parquet, meta/tasks.parquet; data files with many episodes
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from probdmp.errors import DataFileError
from probdmp.io.lerobot_info import LeRobotInfo, inside
from probdmp.io.parquet_layout import open_parquet
from probdmp.io.recordings import MOST_DEMONSTRATIONS
from probdmp.io.regular_file import open_regular

__all__ = ["Episode", "read_episodes", "read_tasks"]

LARGEST_LINES = 2**28
"""Bytes of a file of JSON lines."""
MOST_TASKS = 100_000
DATA_CHUNK, DATA_FILE = "data/chunk_index", "data/file_index"


class Episode(NamedTuple):
    """One recording."""

    number: int
    n_frames: int
    label: str | None
    """Its task, several with semicolons between; None if that is only said frame by frame."""
    file: Path


def read_episodes(info: LeRobotInfo) -> list[Episode]:
    """Every episode, in their order.

    Raises
    ------
    DataFileError
        If what describes them is damaged, or there are none or too many.
    """
    rows = _json_lines(info.root, "meta/episodes.jsonl") if info.version == "v2.1" else _episode_rows(info.root)
    episodes: list[Episode] = []
    for row in rows:
        episodes.append(_episode(row, info))
        if len(episodes) > MOST_DEMONSTRATIONS:
            raise DataFileError(f"at most {MOST_DEMONSTRATIONS} episodes in {info.root}", "more")
    indices = {episode.number for episode in episodes}
    if not episodes or len(indices) < len(episodes):
        raise DataFileError(f"episodes with different numbers in {info.root}", "none" if not episodes else "two of the same")
    return sorted(episodes)


def read_tasks(info: LeRobotInfo) -> dict[int, str]:
    """Tasks by their number; none where no file says so.

    Raises
    ------
    DataFileError
        If the file is damaged.
    """
    name = "meta/tasks.jsonl" if info.version == "v2.1" else "meta/tasks.parquet"
    if not inside(info.root, name).exists():
        return {}
    rows = _json_lines(info.root, name) if info.version == "v2.1" else _rows(inside(info.root, name), None)
    tasks: dict[int, str] = {}
    for row in rows:
        index = row.get("task_index")
        texts = [value for key, value in row.items() if isinstance(value, str) and key in ("task", "__index_level_0__")]
        if not isinstance(index, int) or len(texts) != 1 or len(tasks) == MOST_TASKS:
            raise DataFileError(f"at most {MOST_TASKS} rows of task_index and task in {info.root / name}", f"{row!r:.100}")
        tasks[index] = texts[0]
    return tasks


def _episode(row: Mapping[str, Any], info: LeRobotInfo) -> Episode:
    index, length, tasks = row.get("episode_index"), row.get("length"), row.get("tasks")
    label = "; ".join(tasks) if isinstance(tasks, list) and tasks and all(isinstance(task, str) for task in tasks) else None
    if info.version == "v2.1":
        numbers = {"episode_index": index, "episode_chunk": index // info.chunks_size if isinstance(index, int) else None}
    else:
        numbers = {"chunk_index": row.get(DATA_CHUNK), "file_index": row.get(DATA_FILE)}
    known = {key: value for key, value in numbers.items() if isinstance(value, int) and value >= 0}
    if not isinstance(index, int) or not isinstance(length, int) or len(known) < len(numbers) or length < 0:
        expected = f"whole numbers episode_index, length and {' and '.join(numbers)} for each episode in {info.root}"
        raise DataFileError(expected, f"{[index, length, *numbers.values()]!r:.100}")
    return Episode(index, length, label, info.data_file(**known))


def _episode_rows(root: Path) -> Iterator[Mapping[str, Any]]:
    folder = inside(root, "meta/episodes")
    files = sorted(folder.glob("*/*.parquet"))
    if not files:
        raise DataFileError(f"Parquet files in {folder}", "none", "Was the dataset copied as a whole?")
    for file in files:
        path = inside(root, file.relative_to(root).as_posix())
        yield from _rows(path, ["episode_index", "length", "tasks", DATA_CHUNK, DATA_FILE])


def _rows(path: Path, columns: list[str] | None) -> Iterator[Mapping[str, Any]]:
    """Rows of a small table, those columns of it that there are."""
    import pyarrow as pa

    file = open_parquet(path)
    names = file.schema_arrow.names
    wanted = names if columns is None else [name for name in columns if name in names]
    try:
        for batch in file.iter_batches(2**12, columns=wanted, use_threads=False):
            yield from batch.to_pylist()
    except (pa.ArrowException, OSError, ValueError) as error:
        raise DataFileError(f"an undamaged Parquet file at {path}", str(error).partition("\n")[0], "Copy it again.") from error


def _json_lines(root: Path, name: str) -> Iterator[Mapping[str, Any]]:
    path = inside(root, name)
    with open_regular(path, LARGEST_LINES, DataFileError, follow_links=True) as file:
        for number, line in enumerate(file, 1):
            if not line.strip():
                continue
            try:
                row = json.loads(line)
            except (ValueError, RecursionError) as error:
                raise DataFileError(f"JSON on line {number} of {path}", f"{error!s:.100}", "Was it cut off?") from error
            if not isinstance(row, dict):
                raise DataFileError(f"a JSON object on line {number} of {path}", f"{row!r:.60}")
            yield row
