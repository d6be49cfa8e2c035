"""LeRobot datasets: both versions say the same, names and rate are kept, and nothing outside of the folder is read."""

import json
import os
import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from lerobot_folders import FPS, MOTORS, TASKS, episodes, write_v21, write_v30

from probdmp import read_demonstrations
from probdmp.errors import DataFileError, InputError, MissingExtraError
from probdmp.io import Selection, parquet_layout, read_lerobot

BOTH = pytest.mark.parametrize("write", [write_v21, write_v30])


@BOTH
def test_episodes_are_demonstrations_and_tasks_are_labels(write, tmp_path):
    demos = read_demonstrations(write(tmp_path / "set"))
    assert [(d.label, d.dt, d.names, d.units) for d in demos] == [
        (TASKS[task], 1 / FPS, tuple(MOTORS), "") for _, task in episodes()
    ]
    for demo, (state, _) in zip(demos, episodes(), strict=True):
        np.testing.assert_array_equal(demo.positions, state)
        assert list(demo.channels) == [f"action.{name}" for name in MOTORS]
        np.testing.assert_array_equal(demo.channels["action.elbow.pos"], -state[:, 1])


@BOTH
def test_a_task_a_feature_or_names_can_be_chosen(write, tmp_path):
    root = write(tmp_path / "set")
    assert [d.n_samples for d in read_demonstrations(root, label="Wave.")] == [25, 35]
    (first, *_) = read_demonstrations(root, columns=["action"])
    assert first.names == tuple(MOTORS)
    np.testing.assert_array_equal(first.positions, -episodes()[0][0])
    assert list(first.channels) == [f"observation.state.{name}" for name in MOTORS]
    assert read_demonstrations(root, columns=["elbow.pos", "action.elbow.pos"])[0].names == ("elbow.pos", "action.elbow.pos")
    assert read_demonstrations(root, dt=2 / FPS)[0].n_samples == 15
    with pytest.raises(InputError, match=r"label to be one of the tasks in .*'Pick the cube\.', 'Wave\.'"):
        read_demonstrations(root, label="Dance.")
    with pytest.raises(InputError, match=r"columns to be different ones of 'shoulder\.pos'"):
        read_demonstrations(root, columns=["knee"])
    with pytest.raises(InputError, match="no topic"):
        read_demonstrations(root, topic="/joint_states")


def test_tasks_may_be_told_frame_by_frame(tmp_path):
    demos = read_lerobot(write_v30(tmp_path / "set", tell_tasks=False))
    assert [d.label for d in demos] == [TASKS[task] for _, task in episodes()]
    assert len(read_lerobot(tmp_path / "set", Selection(label="Wave."))) == 2


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ({"motors": ["a", "b", "c"]}, ("a", "b", "c")),
        ({"a": 0, "b": 1, "c": 2}, ("a", "b", "c")),
        (None, tuple(f"observation.state_{i}" for i in range(3))),
        (["a", "b"], tuple(f"observation.state_{i}" for i in range(3))),
        (["a", "b", "b"], ("a", "b_1", "b_2")),
    ],
)
def test_names_come_in_several_forms(tmp_path, names, expected):
    assert read_lerobot(write_v21(tmp_path / "set", names))[0].names == expected


def changed_info(root, **changed):
    file = root / "meta/info.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | changed))


@BOTH
@pytest.mark.parametrize(
    ("changed", "match"),
    [
        ({"codebase_version": "v1.6"}, r"version v2\.1 or v3\.0 in .* got 'v1\.6'"),
        ({"codebase_version": None}, r"version v2\.1 or v3\.0"),
        ({"codebase_version": "v4.0"}, r"version v2\.1 or v3\.0"),
        ({"fps": 0}, "fps in"),
        ({"fps": "30"}, "fps in"),
        ({"chunks_size": 0}, "chunks_size in"),
        ({"data_path": "data/all.hdf5"}, "the path of a .parquet file"),
        ({"data_path": None}, "the path of a .parquet file"),
        ({"data_path": "../{episode_index}.parquet"}, "files within|the path of a .parquet file"),
        ({"data_path": "{episode_index.__class__}.parquet"}, "the path of a .parquet file"),
        ({"data_path": "{file_index!r}.parquet"}, "the path of a .parquet file"),
        ({"data_path": "{file_index:9999999999}.parquet"}, "the path of a .parquet file"),
        ({"data_path": "{.parquet"}, "the path of a .parquet file"),
        ({"features": []}, "features in"),
        ({"features": {"observation.state": {"dtype": "video", "shape": [3]}}}, "features of numbers"),
    ],
)
def test_what_is_not_known_is_refused_by_name(write, tmp_path, changed, match):
    root = write(tmp_path / "set")
    changed_info(root, **changed)
    with pytest.raises(DataFileError, match=match):
        read_lerobot(root)


@pytest.mark.parametrize(
    "path", ["../set2/{file_index}.parquet", "/etc/{file_index}.parquet", "data/../../{file_index}.parquet"]
)
def test_paths_do_not_leave_the_folder(tmp_path, path):
    root = write_v30(tmp_path / "set", data_path=path)
    with pytest.raises(DataFileError, match=r"files within .* copy the dataset"):
        read_lerobot(root)


@BOTH
def test_links_do_not_leave_the_folder(write, tmp_path):
    root = write(tmp_path / "set")
    shutil.move(root / "data", tmp_path / "elsewhere")
    (root / "data").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(DataFileError, match="files within"):
        read_lerobot(root)
    (root / "data").unlink()
    shutil.move(tmp_path / "elsewhere", root / "inner")
    (root / "data").symlink_to(root / "inner")  # but within it they may lead anywhere
    assert len(read_lerobot(root)) == 5
    (root / "meta/info.json").rename(tmp_path / "info.json")
    (root / "meta/info.json").symlink_to(tmp_path / "info.json")
    with pytest.raises(DataFileError, match="files within"):
        read_lerobot(root)


@BOTH
def test_parts_of_a_dataset_are_refused(write, tmp_path):
    root = write(tmp_path / "set")
    for file in [path for path in sorted(root.rglob("*")) if path.is_file() and "tasks." not in path.name]:
        whole = file.read_bytes()
        for payload in (b"", whole[: len(whole) // 2], b"\0" * 100, b"[1]", b"[" * 100_000):
            file.write_bytes(payload)
            with pytest.raises(DataFileError):
                read_lerobot(root)
        file.unlink()
        with pytest.raises((DataFileError, InputError)):
            read_demonstrations(root)
        os.mkfifo(file)
        with pytest.raises((DataFileError, InputError)):
            read_demonstrations(root)
        file.unlink()
        file.write_bytes(whole)
    assert len(read_lerobot(root)) == 5


def test_frames_that_contradict_the_episodes_are_refused(tmp_path):
    root = write_v30(tmp_path / "set")
    file = root / "data/chunk-000/file-001.parquet"
    table = pq.read_table(file)
    for changed, match in (
        (table.slice(0, 30), "35 frames in episode 4"),
        (table.drop(["episode_index"]), "the columns 'episode_index' in"),
        (table.drop(["observation.state"]).append_column("observation.state", table["timestamp"]), "3 numbers in each row"),
        (table.drop(["action"]).append_column("action", pa.array([[1.0, 2.0]] * len(table))), "fewer or more in some"),
        (table.drop(["action"]).append_column("action", pa.array([[1.0, 2.0, 3.0], None] * 27 + [None])), "fewer or more"),
        (table.drop(["timestamp"]).append_column("timestamp", pa.array(np.zeros(len(table)))), "times that increase"),
    ):
        pq.write_table(changed, file)
        with pytest.raises(DataFileError, match=match):
            read_lerobot(root)
    pq.write_table(table.drop(["timestamp", "task_index", "next.done"]), file)
    assert read_lerobot(root)[4].dt == 1 / FPS


def test_too_much_is_refused_before_it_is_read(tmp_path):
    root = write_v21(tmp_path / "set")
    rows = [json.loads(line) for line in (root / "meta/episodes.jsonl").read_text().splitlines()]
    text = "".join(json.dumps(row | {"length": 10**9}) + "\n" for row in rows)
    (root / "meta/episodes.jsonl").write_text(text)
    with pytest.raises(DataFileError, match=r"bytes of numbers .*5000000000 frames of 6"):
        read_lerobot(root)


def test_without_pyarrow_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr(parquet_layout, "find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"pip install 'probdmp\[lerobot\]'"):
        read_lerobot(tmp_path)
