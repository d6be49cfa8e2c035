"""Folders as LeRobot writes them, versions v2.1 and v3.0, without it."""

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

__all__ = ["FPS", "MOTORS", "TASKS", "episodes", "write_v21", "write_v30"]

FPS = 50
MOTORS = ["shoulder.pos", "elbow.pos", "gripper.pos"]
TASKS = ["Pick the cube.", "Wave."]
PATHS = {
    "v2.1": "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
    "v3.0": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
}


def episodes(seed=0):
    """State of each of five episodes, (T, 3), single precision, and its task by number."""
    rng = np.random.default_rng(seed)
    states = [np.cumsum(rng.standard_normal((n, 3)), axis=0).astype(np.float32) for n in (30, 25, 40, 20, 35)]
    return list(zip(states, [0, 1, 0, 0, 1], strict=True))


def info(version, names, **changed):
    vector = {"dtype": "float32", "shape": [3], "names": names}
    scalar = {"shape": [1], "names": None}
    camera = {"dtype": "video", "shape": [480, 640, 3], "names": ["height", "width", "channels"]}
    return {
        "codebase_version": version, "robot_type": "so100", "total_episodes": 5, "total_tasks": 2, "fps": FPS,
        "chunks_size": 2, "data_path": PATHS[version], "video_path": "videos/….mp4",
        "features": {
            "action": vector, "observation.state": vector, "observation.images.top": camera,
            "timestamp": {"dtype": "float32", **scalar}, "next.done": {"dtype": "bool", **scalar},
            **{name: {"dtype": "int64", **scalar} for name in ("frame_index", "episode_index", "index", "task_index")},
        },
    } | changed  # fmt: skip


def frames(number, state, task, begin):
    n = len(state)
    fixed = pa.list_(pa.float32(), 3)
    return pa.table({
        "action": pa.array((-state).tolist(), fixed),
        "observation.state": pa.array(state.tolist(), fixed),
        "timestamp": (np.arange(n) / FPS).astype(np.float32),
        "next.done": np.arange(n) == n - 1,
        "frame_index": np.arange(n),
        "episode_index": np.full(n, number),
        "index": begin + np.arange(n),
        "task_index": np.full(n, task),
    })  # fmt: skip


def write_v21(root: Path, names=MOTORS, **changed):
    """A file for each episode, two in a folder."""
    (root / "meta").mkdir(parents=True)
    (root / "meta/info.json").write_text(json.dumps(info("v2.1", names, **changed)))
    told, begin = [], 0
    for number, (state, task) in enumerate(episodes()):
        file = root / PATHS["v2.1"].format(episode_chunk=number // 2, episode_index=number)
        file.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(frames(number, state, task, begin), file)
        told.append({"episode_index": number, "tasks": [TASKS[task]], "length": len(state)})
        begin += len(state)
    (root / "meta/episodes.jsonl").write_text("".join(json.dumps(row) + "\n" for row in told))
    tasks = [{"task_index": i, "task": text} for i, text in enumerate(TASKS)]
    (root / "meta/tasks.jsonl").write_text("".join(json.dumps(row) + "\n" for row in tasks))
    return root


def write_v30(root: Path, names=MOTORS, tell_tasks=True, **changed):
    """Episodes together in two files."""
    (root / "meta/episodes/chunk-000").mkdir(parents=True)
    (root / "data/chunk-000").mkdir(parents=True)
    (root / "meta/info.json").write_text(json.dumps(info("v3.0", names, **changed)))
    tables, rows, begin = {0: [], 1: []}, [], 0
    for number, (state, task) in enumerate(episodes()):
        tables[number // 3].append(frames(number, state, task, begin))
        row = {"episode_index": number, "tasks": [TASKS[task]], "length": len(state), "data/chunk_index": 0}
        end = begin + len(state)
        rows.append(row | {"data/file_index": number // 3, "dataset_from_index": begin, "dataset_to_index": end})
        begin = end
    for number, members in tables.items():
        pq.write_table(pa.concat_tables(members), root / f"data/chunk-000/file-{number:03d}.parquet")
    if not tell_tasks:
        rows = [{key: value for key, value in row.items() if key != "tasks"} for row in rows]
    pq.write_table(pa.Table.from_pylist(rows), root / "meta/episodes/chunk-000/file-000.parquet")
    # As pandas writes a table whose index are the tasks.
    pq.write_table(pa.table({"task_index": [0, 1], "__index_level_0__": TASKS}), root / "meta/tasks.parquet")
    return root
