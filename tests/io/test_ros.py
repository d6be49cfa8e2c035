"""Recordings of robots: ROS 1, ROS 2 and MCAP, written by rosbags and mcap, say what was recorded, or why they cannot."""

import bz2
import os
import sqlite3
import struct
import tracemalloc
import warnings
from contextlib import closing, suppress
from types import SimpleNamespace

import lz4.frame
import numpy as np
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from io_strategies import assert_same_demonstrations
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as McapWriter
from ros_files import BEGIN, JOINTS, ROS_1, ROS_2, grip, joint_state, pose_stamped, write_bag, write_json
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from probdmp import read_demonstrations, write_demonstrations
from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError, InputError, MissingExtraError, ProbDMPError, RecordingWarning
from probdmp.io import read_mcap, ros_library, write_mcap

PATH = np.cumsum(np.random.default_rng(0).standard_normal((40, 3)), axis=0)
TIMES = [BEGIN + 10_000_000 * i for i in range(40)]
LATE = 3_000_000
"""Nanoseconds between a measurement and the log."""


def arm(store, times=TIMES):
    states = [joint_state(store, t, p[:2], velocities=-p[:2]) for t, p in zip(times, PATH, strict=True)]
    return [("/joint_states", t + LATE * (i % 2), state) for i, (t, state) in enumerate(zip(times, states, strict=True))]


def tool(store):
    return [("/tool", t, pose_stamped(store, t, p)) for t, p in zip(TIMES, PATH, strict=True)]


FORMS = {
    "ros1.bag": lambda path, make: write_bag(path, make(ROS_1), ROS_1),
    "folder": lambda path, make: write_bag(path, make(ROS_2)),
    "alone.db3": lambda path, make: next(write_bag(path.with_suffix(""), make(ROS_2)).glob("*.db3")).rename(path),
    "mcap_folder": lambda path, make: write_bag(path, make(ROS_2), storage=StoragePlugin.MCAP),
    "alone.mcap": lambda path, make: next(
        write_bag(path.with_suffix(""), make(ROS_2), storage=StoragePlugin.MCAP).glob("*.mcap")
    ).rename(path),
}


@pytest.fixture(params=FORMS)
def record(request, tmp_path):
    return lambda make: FORMS[request.param](tmp_path / request.param, make)


def test_joint_states(record):
    (demo,) = read_demonstrations(record(arm))
    assert (demo.names, demo.units, demo.label, demo.dt) == (JOINTS, "", "", 0.01)
    np.testing.assert_array_equal(demo.positions, PATH[:, :2])
    assert list(demo.channels) == ["joint_a_velocity", "joint_b_velocity"]
    np.testing.assert_array_equal(demo.channels["joint_b_velocity"], -PATH[:, 1])


def test_poses(record):
    (demo,) = read_demonstrations(record(tool))
    assert (demo.names, demo.units, demo.dt) == (("x", "y", "z"), "m", 0.01)
    np.testing.assert_array_equal(demo.positions, PATH)
    assert {name: values[0] for name, values in demo.channels.items()} == {
        "orientation_x": 0.0, "orientation_y": 0.0, "orientation_z": 0.6, "orientation_w": 0.8,
    }  # fmt: skip


def test_types_of_ones_own_come_with_the_recording(record):
    path = record(lambda store: [("/grip", t, grip(store, t, p[0])) for t, p in zip(TIMES, PATH, strict=True)])
    (demo,) = read_demonstrations(path)
    assert demo.names == ("q_0", "q_1")
    np.testing.assert_array_equal(demo.positions[:, 0], PATH[:, 0].astype(np.float32))
    assert list(demo.channels) == ["width", "force_x", "force_y", "force_z"]
    (demo,) = read_demonstrations(path, columns=["width"], label="grip", dt=0.02)
    assert (demo.names, demo.n_samples, demo.label) == (("width",), 20, "grip")


def test_several_topics_have_to_be_chosen_from(record):
    def several(store):
        return sorted([*arm(store), *tool(store), ("/grip", TIMES[0], grip(store, TIMES[0], 1.0))], key=lambda m: m[1])

    path = record(several)
    listed = r"/joint_states \(sensor_msgs/JointState, 40 messages\), /tool \(geometry_msgs/PoseStamped, 40 .*--topic"
    with pytest.raises(InputError, match=listed):
        read_demonstrations(path)
    assert read_demonstrations(path, topic="/tool")[0].names == ("x", "y", "z")
    assert read_demonstrations(path, topic="joint_states", columns=["joint_b"])[0].names == ("joint_b",)
    with pytest.raises(InputError, match=r"topic to be one of .*/grip \(lab_msgs/Grip, 1 messages\).*got '/camera'"):
        read_demonstrations(path, topic="/camera")
    with pytest.raises(DataFileError, match="at least 3 messages on /grip"):
        read_demonstrations(path, topic="/grip")


def test_the_log_tells_time_where_headers_do_not(record):
    pairs = list(zip(TIMES, PATH[:, :2], strict=True))
    path = record(lambda store: [("/joint_states", t, joint_state(store, 0, p)) for t, p in pairs])
    assert read_demonstrations(path)[0].dt == 0.01


def test_a_gripper_among_the_states_of_an_arm(tmp_path):
    def both(store):
        fingers = [("/joint_states", t + 7, joint_state(store, t + 5_000_000, [1.0], ["finger"])) for t in TIMES[::4]]
        return sorted(arm(store) + fingers, key=lambda m: m[1])

    path = write_bag(tmp_path / "both.bag", both(ROS_1), ROS_1)
    with pytest.warns(RecordingWarning, match="10 of 50 messages on /joint_states .* other columns than 'joint_a'"):
        (demo,) = read_demonstrations(path)
    np.testing.assert_array_equal(demo.positions, PATH[:, :2])
    with pytest.warns(RecordingWarning, match="40 of 50 messages"):
        (demo,) = read_demonstrations(path, columns=["finger"])
    assert (demo.names, demo.n_samples) == (("finger",), 10)


def test_repeated_and_swapped_messages(tmp_path):
    def twice(store):
        messages = arm(store)
        return [*messages[:5], (messages[4][0], messages[4][1] + 1, messages[4][2]), messages[6], messages[5], *messages[7:]]

    path = write_bag(tmp_path / "twice.bag", twice(ROS_1), ROS_1)
    with pytest.warns(RecordingWarning, match="1 messages on /joint_states .* have the time of another one"):
        (demo,) = read_demonstrations(path)
    np.testing.assert_array_equal(demo.positions, PATH[:, :2])


def test_messages_that_were_lost_are_missing_and_uneven_ones_resampled(tmp_path):
    path = write_bag(tmp_path / "lost", [m for i, m in enumerate(arm(ROS_2)) if i not in (3, 4)])
    with pytest.warns(RecordingWarning, match="2 rows are left out"):
        (demo,) = read_demonstrations(path)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(demo.positions[:, 0])), [3, 4])
    uneven = (BEGIN + 1e7 * np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, 40))).astype(int).tolist()
    path = write_bag(tmp_path / "uneven", arm(ROS_2, uneven))
    with pytest.warns(RecordingWarning, match="resampled along straight lines"):
        read_demonstrations(path)
    assert read_demonstrations(path, dt=0.01)[0].dt == 0.01


def test_a_joint_state_without_a_number_for_each_joint_is_refused(record):
    path = record(lambda store: [("/joint_states", t, joint_state(store, t, [1.0])) for t in TIMES])
    with pytest.raises(DataFileError, match="one number for each joint"):
        read_demonstrations(path)


# JSON in MCAP


def test_json_of_another_program(tmp_path):
    more = {"mode": "auto", "ok": True, "more": {"x": 1}}
    rows = [(t, {"q1": p[0], "q2": p[1], "grip": p[2], **more}) for t, p in zip(TIMES, PATH, strict=True)]
    for schema in (True, False):
        (demo,) = read_demonstrations(write_json(tmp_path / "arm.mcap", rows, schema=schema))
        assert (demo.names, demo.dt, list(demo.channels)) == (("q1", "q2"), 0.01, ["grip"])
        np.testing.assert_array_equal(demo.positions, PATH[:, :2])
    with pytest.raises(DataFileError, match="JSON objects"):
        read_demonstrations(write_json(tmp_path / "list.mcap", [(t, [1, 2]) for t in TIMES]))
    with pytest.raises(DataFileError, match="messages with numbers"):
        read_demonstrations(write_json(tmp_path / "text.mcap", [(t, {"mode": "auto"}) for t in TIMES]))
    with pytest.raises(DataFileError, match="finite"):
        read_demonstrations(write_json(tmp_path / "inf.mcap", [(t, {"q": float("inf")}) for t in TIMES]))


@pytest.mark.parametrize("chunked", [True, False])
@pytest.mark.parametrize(("store", "encoding"), [(ROS_1, "ros1"), (ROS_2, "cdr")])
def test_mcap_of_other_writers(tmp_path, store, encoding, chunked):
    kind = "sensor_msgs/msg/JointState"
    text, _ = store.generate_msgdef(kind, ros_version=1 if store is ROS_1 else 2)
    name, schema_encoding = (kind.replace("/msg/", "/"), "ros1msg") if store is ROS_1 else (kind, "ros2msg")
    with open(tmp_path / "f.mcap", "wb") as file:
        writer = McapWriter(file, use_chunking=chunked, compression=CompressionType.LZ4)
        writer.start()
        channel = writer.register_channel("/arm", encoding, writer.register_schema(name, schema_encoding, text.encode()))
        for time, p in zip(TIMES, PATH, strict=True):
            message = joint_state(store, time, p[:2])
            raw = store.serialize_ros1(message, kind) if store is ROS_1 else store.serialize_cdr(message, kind)
            writer.add_message(channel, time + LATE, bytes(raw), time)
        writer.finish()
    (demo,) = read_demonstrations(tmp_path / "f.mcap")
    assert (demo.names, demo.dt) == (JOINTS, 0.01)
    np.testing.assert_array_equal(demo.positions, PATH[:, :2])


def test_messages_in_other_encodings_are_refused_by_name(tmp_path):
    with open(tmp_path / "other.mcap", "wb") as file:
        writer = McapWriter(file)
        writer.start()
        channel = writer.register_channel("/arm", "protobuf", writer.register_schema("lab.Arm", "protobuf", b"..."))
        writer.add_message(channel, BEGIN, b"\1\2", BEGIN)
        writer.finish()
    with pytest.raises(DataFileError, match=r"messages of ROS, or JSON, on /arm .* got protobuf of lab\.Arm"):
        read_mcap(tmp_path / "other.mcap")


# Writing

numbers = st.floats(-1e100, 1e100) | st.just(float("nan"))


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_what_is_written_as_mcap_is_read(folder, data):
    is_pose = data.draw(st.booleans())
    joints = st.lists(st.text("abqé_/ ", min_size=1), min_size=1, max_size=3, unique=True)
    names = ("x", "y", "z") if is_pose else tuple(data.draw(joints))
    n = data.draw(st.integers(3, 8))
    table = lambda width: np.array(data.draw(st.lists(numbers, min_size=n * width, max_size=n * width))).reshape(n, width)  # noqa: E731
    endings = data.draw(st.sampled_from([[], ["_velocity"], ["_effort"], ["_velocity", "_effort"]]))
    channels = [name + ending for ending in endings for name in names]
    if is_pose:
        channels = ["orientation_x", "orientation_y", "orientation_z", "orientation_w"] if endings else []
    if not set(channels).isdisjoint(names):
        return
    values = dict(zip(channels, table(len(channels)).T, strict=True))
    unit = "m" if is_pose else data.draw(st.sampled_from(["", "rad", "°"]))
    demo = Demonstration(table(len(names)), data.draw(st.floats(1e-6, 1e3)), data.draw(st.text("ab é")), names, unit, values)
    write_demonstrations(folder / "round.mcap", [demo])
    assert_same_demonstrations(read_demonstrations(folder / "round.mcap"), [demo])


def test_others_read_what_is_written(tmp_path):
    from rosbags.highlevel import AnyReader

    for names, kind in ((("x", "y", "z"), "geometry_msgs/msg/PoseStamped"), (("j1", "j2", "j3"), "sensor_msgs/msg/JointState")):
        write_mcap(tmp_path / "f.mcap", [Demonstration(PATH, 0.01, "reach", names, "m")])
        with AnyReader([tmp_path / "f.mcap"]) as bag:
            (connection,) = bag.connections
            assert (connection.msgtype, connection.msgcount) == (kind, 40)
            messages = [bag.deserialize(raw, kind) for _, _, raw in bag.messages()]
            assert [m.header.stamp.nanosec for m in messages] == [10_000_000 * i for i in range(40)]


def test_what_an_mcap_file_cannot_hold_is_refused(tmp_path):
    demo = Demonstration(PATH, 0.01, names=("x", "y", "z"), units="m", channels={"force": PATH[:, 0]})
    with pytest.raises(InputError, match=r"no channels but all of orientation_x.* got 'force'"):
        write_mcap(tmp_path / "f.mcap", [demo])
    with pytest.raises(InputError, match="one demonstration for"):
        write_mcap(tmp_path / "f.mcap", [Demonstration(PATH, 0.01)] * 2)
    with pytest.raises(InputError, match="less than"):
        write_mcap(tmp_path / "f.mcap", [Demonstration(PATH, 1e9)])
    for other in (".bag", ".db3", ".mat"):
        with pytest.raises(InputError, match="a file name that ends in"):
            write_demonstrations(tmp_path / f"f{other}", [Demonstration(PATH, 0.01)])
    assert not list(tmp_path.iterdir())


# Damaged and hostile


def files_of(path):
    return [path] if path.is_file() else sorted(path.iterdir())


def test_parts_of_recordings_are_refused(record):
    path = record(arm)
    for file in files_of(path):
        whole = file.read_bytes()
        for n in (0, 1, 20, len(whole) // 2, len(whole) - 5):
            file.write_bytes(whole[:n])
            with suppress(DataFileError):  # the end of a database may be empty, that of YAML a default
                np.testing.assert_array_equal(read_demonstrations(path)[0].positions, PATH[:, :2])
                assert file.suffix in (".db3", ".yaml")
        file.write_bytes(whole)


def test_an_empty_file_is_refused_by_name(tmp_path):
    for suffix in (".bag", ".db3", ".mcap"):
        (tmp_path / f"f{suffix}").write_bytes(b"")
        with pytest.raises(DataFileError, match="an undamaged recording in"):
            read_demonstrations(tmp_path / f"f{suffix}")
        (tmp_path / f"f{suffix}").write_bytes(b"\0" * 1000)
        with pytest.raises(DataFileError, match="an undamaged recording in"):
            read_demonstrations(tmp_path / f"f{suffix}")


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_a_changed_byte_never_ends_in_another_error(folder, data):
    suffix = data.draw(st.sampled_from(["bag", "mcap"]))
    path = folder / f"changed.{suffix}"
    if not (folder / f"whole.{suffix}").exists():
        if suffix == "bag":
            write_bag(folder / "whole.bag", arm(ROS_1), ROS_1)
        else:
            write_mcap(folder / "whole.mcap", [Demonstration(PATH, 0.01)])
    payload = bytearray((folder / f"whole.{suffix}").read_bytes())
    payload[data.draw(st.integers(0, len(payload) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(payload)
    with suppress(ProbDMPError), warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)
        read_demonstrations(path)


def test_pipes_are_not_waited_for(tmp_path):
    for suffix in (".bag", ".db3", ".mcap"):
        os.mkfifo(tmp_path / f"pipe{suffix}")
        with pytest.raises(DataFileError, match="a pipe, socket or device"):
            read_demonstrations(tmp_path / f"pipe{suffix}")
    bag = write_bag(tmp_path / "bag", arm(ROS_2))
    (bag / "bag.db3").unlink()
    os.mkfifo(bag / "bag.db3")
    with pytest.raises(DataFileError, match="a pipe, socket or device"):
        read_demonstrations(bag)


BIG = 2**27
"""Bytes that a bomb unpacks to: zeros."""


def compressed(kind):
    payload = bytes(2**22)
    if kind == "bz2":
        packer = bz2.BZ2Compressor(1)
        return b"".join([*(packer.compress(payload) for _ in range(BIG // 2**22)), packer.flush()])
    if kind == "lz4":
        packer = lz4.frame.LZ4FrameCompressor()
        parts = [packer.begin(), *(packer.compress(payload) for _ in range(BIG // 2**22)), packer.flush()]
        return b"".join(parts)
    packer = zstandard.ZstdCompressor().compressobj()
    return b"".join([*(packer.compress(payload) for _ in range(BIG // 2**22)), packer.flush()])


@pytest.mark.parametrize("kind", ["lz4", "zstd"])
@pytest.mark.parametrize("chunked", [True, False], ids=["indexed", "not indexed"])
def test_bombs_in_mcap_are_refused_unexploded(tmp_path, kind, chunked):
    """A chunk of which the record says that it is small."""
    with open(tmp_path / "f.mcap", "wb") as file:
        writer = McapWriter(file, index_types=IndexType.ALL if chunked else IndexType.NONE)
        writer.start("ros2")
        channel = writer.register_channel("/arm", "json", 0)
        writer.add_message(channel, BEGIN, b"{}", BEGIN)
        writer.finish()
    whole, data = (tmp_path / "f.mcap").read_bytes(), compressed(kind)
    start = whole.index(struct.pack("<I", 4) + b"zstd") - 9 - 28
    (length,) = struct.unpack_from("<Q", whole, start + 1)
    record = struct.pack("<3QII", BEGIN, BEGIN, 100, 0, len(kind)) + kind.encode() + struct.pack("<Q", len(data)) + data
    bomb = struct.pack("<BQ", 6, len(record)) + record
    tail = whole[start + 9 + length :]
    summary_start, offsets_start, _ = struct.unpack_from("<QQI", tail, len(tail) - 28)
    moved = len(bomb) - 9 - length
    footer = struct.pack("<QQI", summary_start + moved, offsets_start + moved, 0)
    (tmp_path / "f.mcap").write_bytes(whole[:start] + bomb + tail[:-28] + footer + tail[-8:])
    refused_cheaply(tmp_path / "f.mcap", "chunks of at most")
    (tmp_path / "folder").mkdir()
    bag = write_bag(tmp_path / "bag", arm(ROS_2), storage=StoragePlugin.MCAP)
    (tmp_path / "f.mcap").rename(bag / "bag.mcap")
    refused_cheaply(bag, "chunks of at most")


@pytest.mark.parametrize("kind", ["bz2", "lz4"])
def test_bombs_in_ros_1_are_refused_unexploded(tmp_path, kind):
    bomb, path = compressed(kind), tmp_path / "f.bag"
    writer = Writer1(path)
    writer.set_compression(Writer1.CompressionFormat[kind.upper()])
    writer.compressor = lambda data: bomb
    with writer:
        connection = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=ROS_1)
        for t in TIMES:
            raw = ROS_1.serialize_ros1(joint_state(ROS_1, t, [1.0, 2.0]), "sensor_msgs/msg/JointState")
            writer.write(connection, t, raw)
    refused_cheaply(path, "chunks of at most")


def refused_cheaply(path, match):
    tracemalloc.start()
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("probdmp.io.ros_chunks.LARGEST_CHUNK", 2**24)
            with pytest.raises(DataFileError, match=match):
                read_demonstrations(path)
        assert tracemalloc.get_traced_memory()[1] < BIG / 2
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_compressed_recordings(tmp_path, mode):
    path = write_bag(tmp_path / "bag", arm(ROS_2), compression=mode)
    if mode == CompressionMode.MESSAGE:
        with pytest.raises(DataFileError, match="compressed one by one"):
            read_demonstrations(path)
        return
    np.testing.assert_array_equal(read_demonstrations(path)[0].positions, PATH[:, :2])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("probdmp.io.ros_chunks.LARGEST_FILE", 1000)
        with pytest.raises(DataFileError, match="at most 1000 bytes unpacked"):
            read_demonstrations(path)


@pytest.mark.parametrize("alone", [True, False])
def test_a_database_that_would_never_end_is_refused(tmp_path, alone):
    bag = write_bag(tmp_path / "bag", arm(ROS_2))
    (file,) = bag.glob("*.db3")
    counting = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
    endless = f"{counting} SELECT i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data"
    with closing(sqlite3.connect(file)) as database:
        database.execute("DROP TABLE messages")
        database.execute(f"CREATE VIEW messages AS {endless} FROM n")
        database.commit()
    with pytest.raises(DataFileError, match=r"tables alone in .*a view 'messages'"):
        read_demonstrations(file if alone else bag)


def test_a_recording_that_was_not_closed_says_so(tmp_path):
    with open(tmp_path / "f.mcap", "wb") as file:
        writer = McapWriter(file, use_statistics=False)
        writer.start()
        writer.finish()
    with pytest.raises(DataFileError, match="mcap recover"):
        read_demonstrations(tmp_path / "f.mcap")


def test_without_the_extra_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr(ros_library, "find_spec", SimpleNamespace(__call__=None).__dict__.get)
    for suffix in (".bag", ".db3", ".mcap"):
        with pytest.raises(MissingExtraError, match=r"pip install 'probdmp\[ros\]'"):
            read_demonstrations(tmp_path / f"f{suffix}")
    with pytest.raises(MissingExtraError):
        write_mcap(tmp_path / "f.mcap", [Demonstration(PATH, 0.01)])
