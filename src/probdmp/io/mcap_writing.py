"""A demonstration as an MCAP file that ROS 2, Foxglove and PlotJuggler read: poses of a tool, or states of joints."""

import io
import os
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from probdmp.demonstrations import Demonstration
from probdmp.errors import InputError
from probdmp.io.atomic import write_atomically
from probdmp.io.mcap_about import RECORD, About
from probdmp.io.recordings import check_alike, listing
from probdmp.io.ros_library import require_ros
from probdmp.io.ros_messages import AXES, JOINT_STATE, NANOSECONDS, ORIENTATION, POSE_STAMPED

__all__ = ["write_mcap"]

LONGEST = 2.0**31
"""Seconds that a stamp can count."""
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
"""The orientation of a tool of which none was recorded."""


def write_mcap(path: str | os.PathLike[str], demonstrations: Sequence[Demonstration]) -> None:
    """Write one demonstration, replacing the file in one step; reading gives the same values back.

    Positions x, y, z in metres become geometry_msgs/PoseStamped on /pose, any others sensor_msgs/JointState on /joint_states.
    Of channels, these hold orientation_x, …, orientation_w, or velocities and efforts of all joints, q1_velocity and q1_effort.

    Raises
    ------
    InputError, InputTypeError
        If there are several, they are too long, or have other channels.
    MissingExtraError
        If mcap or rosbags is not installed.
    """
    require_ros()
    checked = check_alike(demonstrations)
    if len(checked) > 1:
        hint = "Write each to a file of its own, named by its label: reach_1.mcap, reach_2.mcap."
        raise InputError(f"one demonstration for {os.fspath(path)}", f"{len(checked)}", hint)
    (demonstration,) = checked
    if demonstration.duration >= LONGEST:
        raise InputError(f"a demonstration of less than {LONGEST:g} s", f"{demonstration.duration:g} s")
    is_pose = demonstration.names == AXES and demonstration.units == "m"
    columns = _pose_columns(demonstration) if is_pose else _joint_columns(demonstration)
    topic, kind = ("/pose", POSE_STAMPED) if is_pose else ("/joint_states", JOINT_STATE)
    write_atomically(path, _encoded(columns, demonstration, topic, kind))


def _pose_columns(demonstration: Demonstration) -> list[Any]:
    """(T, 7) numbers."""
    _check_channels(demonstration, [ORIENTATION])
    n_samples = demonstration.n_samples
    turned = [
        demonstration.channels.get(name, np.full(n_samples, upright))
        for name, upright in zip(ORIENTATION, UPRIGHT, strict=True)
    ]
    return [np.column_stack([demonstration.positions, *turned])]


def _joint_columns(demonstration: Demonstration) -> list[Any]:
    """Positions, velocities and efforts, (T, D) numbers each; (T, 0) where there are none."""
    kinds = [tuple(name + ending for name in demonstration.names) for ending in ("_velocity", "_effort")]
    _check_channels(demonstration, kinds)
    tables = [[demonstration.channels[name] for name in kind if name in demonstration.channels] for kind in kinds]
    empty = np.empty((demonstration.n_samples, 0))
    return [demonstration.positions, *(np.column_stack(table) if table else empty for table in tables)]


def _check_channels(demonstration: Demonstration, kinds: Sequence[Sequence[str]]) -> None:
    """Refuse channels that are not all of one or more kinds."""
    present = set(demonstration.channels)
    if present - {name for kind in kinds for name in kind} or any(0 < len(present & {*kind}) < len(kind) for kind in kinds):
        wanted = " and ".join(listing(kind, 3) for kind in kinds)
        hint = "A message of ROS has no place for others: leave them out, or write .npz or .csv."
        raise InputError(f"no channels but all of {wanted} in .mcap", listing(map(repr, demonstration.channels)), hint)


def _encoded(columns: Sequence[Any], demonstration: Demonstration, topic: str, kind: str) -> bytes:
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    text, _ = store.generate_msgdef(kind, ros_version=2)
    buffer = io.BytesIO()
    writer: Any = Writer(buffer)
    writer.start(profile="ros2", library="probdmp")
    schema = writer.register_schema(kind, "ros2msg", text.encode())
    channel = writer.register_channel(topic, "cdr", schema)
    times = [round(time * NANOSECONDS) for time in demonstration.times.tolist()]
    for time, message in zip(times, _messages(columns, demonstration.names, times, store.types, kind), strict=True):
        writer.add_message(channel, time, bytes(store.serialize_cdr(message, kind)), time)
    writer.add_metadata(RECORD, About.of(demonstration, topic).texts)
    writer.finish()
    return buffer.getvalue()


def _messages(columns: Sequence[Any], names: Sequence[str], times: Sequence[int], types: Any, kind: str) -> Iterator[Any]:
    stamp_type, header_type = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
    for i, time in enumerate(times):
        header = header_type(stamp_type(*divmod(time, NANOSECONDS)), "")
        if kind == JOINT_STATE:
            yield types[kind](header, list(names), *(table[i] for table in columns))
        else:
            x, y, z, *turned = columns[0][i].tolist()
            point = types["geometry_msgs/msg/Point"](x, y, z)
            pose = types["geometry_msgs/msg/Pose"](point, types["geometry_msgs/msg/Quaternion"](*turned))
            yield types[kind](header, pose)
