"""Demonstrations in what `rosbag record` and `ros2 bag record` write: one recording, one demonstration.

ROS 1 `.bag`; ROS 2 `.db3`, and folders with a metadata.yaml, whatever their storage. No ROS is needed. Types of messages are
those that the recording itself defines; where it defines none, those of a standard installation of ROS 2.
"""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError
from probdmp.io.regular_file import open_regular
from probdmp.io.ros_chunks import bound_ros1_chunks, check_compressed_file, check_mcap_chunks
from probdmp.io.ros_database import check_database
from probdmp.io.ros_library import require_ros, undamaged
from probdmp.io.ros_messages import Sample, sample_of
from probdmp.io.ros_samples import demonstration_of_messages
from probdmp.io.ros_topics import Topic, choose_topic
from probdmp.io.selection import EVERYTHING, Selection

__all__ = ["METADATA", "read_rosbag"]

METADATA = "metadata.yaml"
MCAP, SQLITE, ZSTD = b"\x89MCAP0\r\n", b"SQLite format 3\0", b"\x28\xb5\x2f\xfd"
"""How such files begin."""
LARGEST_METADATA = 2**24
LARGEST_BAG = 2**40
"""Bytes; only the messages of one topic are read."""


def read_rosbag(path: str | os.PathLike[str], selection: Selection = EVERYTHING) -> list[Demonstration]:
    """The demonstration in a recording of ROS 1 or 2, as a list.

    Raises
    ------
    DataFileError
        If the recording is damaged, empty, or its messages hold no positions.
    InputError, InputTypeError
        If it has not the topic or the columns, or several topics could be meant.
    MissingExtraError
        If rosbags is not installed.

    Warns
    -----
    RecordingWarning
        If times are not even and samples had to be put in or resampled, or messages were left out.
    """
    require_ros()
    name = os.fspath(path)
    with undamaged(name):
        _check_files(Path(path))
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

        with AnyReader([Path(path)], default_typestore=get_typestore(Stores.LATEST)) as bag:
            _check_compression(bag, name)
            topic = choose_topic(_topics(bag.connections), selection.topic, name)
            place = f"on {topic.name} in {name}"
            wanted = [c for c in bag.connections if (c.topic, c.msgtype) == (topic.name, topic.kind)]
            return demonstration_of_messages(_samples(bag, wanted, place), selection, place, name)


def _samples(bag: Any, connections: Sequence[Any], place: str) -> Iterator[tuple[int, Sample]]:
    for connection, logged, raw in bag.messages(connections=connections):
        yield logged, sample_of(connection.msgtype, bag.deserialize(raw, connection.msgtype), place)


def _topics(connections: Sequence[Any]) -> list[Topic]:
    """Each with all of its publishers."""
    counts: dict[tuple[str, str], int] = {}
    for connection in connections:
        key = (connection.topic, connection.msgtype)
        counts[key] = counts.get(key, 0) + connection.msgcount
    return [Topic(*key, count) for key, count in sorted(counts.items())]


def _check_files(path: Path) -> None:
    """Refuse what is no file, in a folder too: a pipe would be waited for; and what would take for ever to read."""
    if not path.is_dir():
        open_regular(path, LARGEST_BAG, DataFileError, follow_links=True).close()
        _check_content(path)
        return
    open_regular(path / METADATA, LARGEST_METADATA, DataFileError, follow_links=True).close()
    for inner in path.iterdir():
        if inner.is_dir():
            continue
        open_regular(inner, LARGEST_BAG, DataFileError, follow_links=True).close()
        _check_content(inner)


def _check_content(path: Path) -> None:
    """Look at a file before rosbags does, whatever its name."""
    with open(path, "rb") as file:
        begin = file.read(16)
        if begin.startswith(MCAP):
            check_mcap_chunks(file, os.fspath(path))
    if begin.startswith(SQLITE):
        check_database(path)
    elif begin.startswith(ZSTD):
        check_compressed_file(path)


def _check_compression(bag: Any, name: str) -> None:
    """Refuse what cannot be bounded."""
    bound_ros1_chunks(bag.readers, name)
    if any(getattr(reader, "compression_mode", None) == "message" for reader in bag.readers):
        hint = "Unpack it: `ros2 bag convert`, or record it with --compression-mode file."
        raise DataFileError(f"a recording whose messages are not compressed one by one in {name}", "one of the kind", hint)
