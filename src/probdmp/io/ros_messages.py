"""Messages of a robot as named numbers.

sensor_msgs/JointState     joints by name; velocities and efforts as channels q1_velocity, q1_effort
geometry_msgs/Pose…, Point…, Transform…, nav_msgs/Odometry
                           x, y, z in metres; the orientation as channels orientation_x, …, orientation_w
any other                  numbers by the names of their fields, `wrench_force_x`; of arrays, `data_0`, …
"""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from probdmp.errors import DataFileError
from probdmp.io.recordings import MOST_COLUMNS

__all__ = ["AXES", "JOINT_STATE", "ORIENTATION", "POSES", "POSE_STAMPED", "Sample", "is_movement", "sample_of", "short_type"]

JOINT_STATE = "sensor_msgs/msg/JointState"
POSE_STAMPED = "geometry_msgs/msg/PoseStamped"
AXES = ("x", "y", "z")
ORIENTATION = tuple(f"orientation_{axis}" for axis in "xyzw")
POSES: Mapping[str, tuple[str, str]] = {
    POSE_STAMPED: ("pose.position", "pose.orientation"),
    "geometry_msgs/msg/Pose": ("position", "orientation"),
    "geometry_msgs/msg/PoseWithCovariance": ("pose.position", "pose.orientation"),
    "geometry_msgs/msg/PoseWithCovarianceStamped": ("pose.pose.position", "pose.pose.orientation"),
    "geometry_msgs/msg/PointStamped": ("point", ""),
    "geometry_msgs/msg/Point": (".", ""),
    "geometry_msgs/msg/Transform": ("translation", "rotation"),
    "geometry_msgs/msg/TransformStamped": ("transform.translation", "transform.rotation"),
    "nav_msgs/msg/Odometry": ("pose.pose.position", "pose.pose.orientation"),
}
"""By type of message: where position and orientation are in it."""
DEEPEST = 4
LONGEST_ARRAY = 64
"""Numbers in an array of a message of another type; longer ones are images and the like."""
NANOSECONDS = 10**9


class Sample(NamedTuple):
    """One message."""

    stamp: int
    """When it was measured, nanoseconds; 0 if the message does not say."""
    columns: dict[str, float]
    positions: tuple[str, ...]
    """Which columns are positions, if the type of message says so."""
    units: Mapping[str, str]


def is_movement(kind: str) -> bool:
    """Whether messages of a type are positions."""
    return kind == JOINT_STATE or kind in POSES


def short_type(kind: str) -> str:
    """As people write it: sensor_msgs/JointState."""
    return kind.replace("/msg/", "/")


def sample_of(kind: str, message: Any, place: str) -> Sample:
    """The numbers in a message.

    Parameters
    ----------
    place : "on /joint_states in f.bag", for messages.

    Raises
    ------
    DataFileError
        If a joint state has other than one number for each joint.
    """
    stamp = _stamp_of(message)
    if kind == JOINT_STATE:
        columns, positions = _joints(message, place)
        return Sample(stamp, columns, positions, {})
    if kind in POSES:
        where, turned = POSES[kind]
        point = _part(message, where)
        columns = {axis: float(getattr(point, axis)) for axis in AXES}
        if turned:
            orientation = _part(message, turned)
            columns |= {name: float(getattr(orientation, name[-1])) for name in ORIENTATION}
        return Sample(stamp, columns, AXES, dict.fromkeys(AXES, "m"))
    columns = dict(_numbers(message, "", DEEPEST))
    if len(columns) > MOST_COLUMNS:
        raise DataFileError(f"at most {MOST_COLUMNS} numbers in a message {place}", str(len(columns)))
    return Sample(stamp, columns, (), {})


def _stamp_of(message: Any) -> int:
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return 0 if stamp is None else int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def _joints(message: Any, place: str) -> tuple[dict[str, float], tuple[str, ...]]:
    names = [str(name) for name in message.name]
    kinds = {"": message.position, "_velocity": message.velocity, "_effort": message.effort}
    lengths = {len(values) for values in kinds.values()}
    if len(set(names)) < len(names) or len(names) > MOST_COLUMNS or not lengths <= {0, len(names)}:
        got = f"{len(names)} names, {len(set(names))} of them different, and {sorted(lengths)} numbers"
        raise DataFileError(f"one number for each joint, or none, {place}", got)
    columns = {
        name + ending: float(value)
        for ending, values in kinds.items()
        if len(values)
        for name, value in zip(names, values, strict=True)
    }
    return columns, tuple(names) if len(message.position) else ()


def _part(message: Any, path: str) -> Any:
    for name in path.split(".") if path != "." else ():
        message = getattr(message, name)
    return message


def _numbers(message: Any, prefix: str, deepest: int) -> Iterator[tuple[str, float]]:
    for name in getattr(message, "__dataclass_fields__", ()):
        value = getattr(message, name)
        if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
            yield prefix + name, float(value)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and value.ndim == 1 and len(value) <= LONGEST_ARRAY:
            yield from ((f"{prefix}{name}_{i}", float(number)) for i, number in enumerate(value))
        elif deepest and name != "header" and hasattr(value, "__dataclass_fields__"):
            yield from _numbers(value, f"{prefix}{name}_", deepest - 1)
