"""Recordings of robots, written by the libraries that everybody writes them with."""

import io
import json
from pathlib import Path

import numpy as np
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

ROS_1, ROS_2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
CUSTOM = "lab_msgs/msg/Grip"
for store in (ROS_1, ROS_2):
    store.register(
        get_types_from_msg("std_msgs/Header header\nfloat64 width\nfloat32[2] q\ngeometry_msgs/Vector3 force", CUSTOM)
    )
JOINTS = ("joint_a", "joint_b")
BEGIN = 1_700_000_000_000_000_000
"""Nanoseconds since 1970."""


def header(store, time):
    """A header; without a sequence number in ROS 2."""
    stamp = store.types["builtin_interfaces/msg/Time"](*divmod(time, 10**9))
    head = store.types["std_msgs/msg/Header"]
    return head(seq=0, stamp=stamp, frame_id="base") if store is ROS_1 else head(stamp=stamp, frame_id="base")


def joint_state(store, time, positions, names=JOINTS, velocities=()):
    numbers = (np.array(values, dtype=np.float64) for values in (positions, velocities, ()))
    return store.types["sensor_msgs/msg/JointState"](header(store, time), list(names), *numbers)


def pose_stamped(store, time, point):
    types = store.types
    turned = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.6, 0.8)
    pose = types["geometry_msgs/msg/Pose"](types["geometry_msgs/msg/Point"](*map(float, point)), turned)
    return types["geometry_msgs/msg/PoseStamped"](header(store, time), pose)


def grip(store, time, width):
    force = store.types["geometry_msgs/msg/Vector3"](1.0, 2.0, width)
    return store.types[CUSTOM](header(store, time), width, np.array([width, -width], dtype=np.float32), force)


def write_bag(path: Path, messages, store=ROS_2, storage=StoragePlugin.SQLITE3, compression=CompressionMode.NONE):
    """Messages as (topic, nanoseconds of the log, message)."""
    ros1 = store is ROS_1
    opened = Writer1(path) if ros1 else Writer2(path, version=9, storage_plugin=storage)
    if isinstance(opened, Writer2) and compression != CompressionMode.NONE:
        opened.set_compression(compression, CompressionFormat.ZSTD)
    with opened as writer:
        connections = {}
        for topic, time, message in messages:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            raw = store.serialize_ros1(message, kind) if ros1 else store.serialize_cdr(message, kind)
            writer.write(connections[topic], time, raw)
    return path


def write_json(path: Path, messages, topic="/arm", schema=True):
    """JSON messages as (nanoseconds of the log, fields)."""
    buffer = io.BytesIO()
    writer = McapWriter(buffer)
    writer.start()
    known = writer.register_schema("arm", "jsonschema", b'{"type": "object"}') if schema else 0
    channel = writer.register_channel(topic, "json", known)
    for time, fields in messages:
        writer.add_message(channel, time, json.dumps(fields).encode(), time)
    writer.finish()
    path.write_bytes(buffer.getvalue())
    return path
