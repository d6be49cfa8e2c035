"""Demonstrations in an MCAP file: one recording, one demonstration.

Messages of ROS 1 and 2, of the types that the file itself defines, and JSON, of which those fields of a message that are
numbers become columns. A file of `write_mcap` says in its metadata what the demonstration was.
"""

import json
import os
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError
from probdmp.io.mcap_about import about_of
from probdmp.io.regular_file import open_regular
from probdmp.io.ros_chunks import LARGEST_CHUNK, check_mcap_chunks
from probdmp.io.ros_library import require_ros, undamaged
from probdmp.io.ros_messages import Sample, sample_of
from probdmp.io.ros_samples import demonstration_of_messages
from probdmp.io.ros_topics import Topic, choose_topic
from probdmp.io.selection import EVERYTHING, Selection

__all__ = ["read_mcap"]

LARGEST_MCAP = 2**40
TYPES = {("cdr", "ros2msg"), ("cdr", "ros2idl"), ("ros1", "ros1msg")}
"""Encodings of messages and of their types that are understood, besides JSON."""


def read_mcap(path: str | os.PathLike[str], selection: Selection = EVERYTHING) -> list[Demonstration]:
    """The demonstration in an MCAP file, as a list.

    Raises
    ------
    DataFileError
        If the file is damaged, empty, was not closed, or its messages hold no positions.
    InputError, InputTypeError
        If it has not the topic or the columns, or several topics could be meant.
    MissingExtraError
        If mcap or rosbags is not installed.

    Warns
    -----
    RecordingWarning
        If times are not even and samples had to be put in or resampled, or messages were left out.
    """
    require_ros()
    name = os.fspath(path)
    with open_regular(path, LARGEST_MCAP, DataFileError, follow_links=True) as file, undamaged(name):
        from mcap.reader import SeekingReader

        check_mcap_chunks(file, name)
        reader = SeekingReader(file, validate_crcs=True, record_size_limit=LARGEST_CHUNK)
        summary = reader.get_summary()
        topic = choose_topic(_topics(summary), selection.topic, name)
        place = f"on {topic.name} in {name}"
        about = about_of(reader.iter_metadata(), topic.name)
        samples = _samples(reader.iter_messages(topics=[topic.name]), topic, place)
        if about is None:
            return demonstration_of_messages(samples, selection, place, name)
        own = ((logged, about.sample(sample)) for logged, sample in samples)
        return demonstration_of_messages(own, selection, place, name, about)


def _topics(summary: Any) -> list[Topic]:
    """Each with all of its publishers."""
    counts: dict[tuple[str, str], int] = {}
    for channel in summary.channels.values():
        key = (channel.topic, _kind(channel, summary.schemas.get(channel.schema_id)))
        counts[key] = counts.get(key, 0) + summary.statistics.channel_message_counts.get(channel.id, 0)
    return [Topic(*key, count) for key, count in sorted(counts.items())]


def _kind(channel: Any, schema: Any) -> str:
    """The type of the messages of a channel: as in ROS 2, "json", or what the file calls it."""
    if channel.message_encoding == "json":
        return "json"
    kind = schema.name if schema is not None else channel.message_encoding
    return kind if "/msg/" in kind else kind.replace("/", "/msg/")


def _samples(messages: Iterator[Any], topic: Topic, place: str) -> Iterator[tuple[int, Sample]]:
    decoders: dict[int, Callable[[bytes], Any]] = {}
    for schema, channel, message in messages:
        if _kind(channel, schema) != topic.kind:
            continue
        if topic.kind == "json":
            yield message.log_time, _json_sample(message.data, place)
            continue
        if channel.id not in decoders:
            decoders[channel.id] = _decoder(channel.message_encoding, schema, topic.kind, place)
        yield message.log_time, sample_of(topic.kind, decoders[channel.id](message.data), place)


def _decoder(encoding: str, schema: Any, kind: str, place: str) -> Callable[[bytes], Any]:
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    if schema is None or (encoding, schema.encoding) not in TYPES:
        known = "messages of ROS, or JSON, "
        raise DataFileError(known + place, f"{encoding} of {kind}", "Convert it to ROS messages or JSON first.")
    store = get_typestore(Stores.EMPTY)
    text = schema.data.decode()
    store.register(get_types_from_idl(text) if schema.encoding == "ros2idl" else get_types_from_msg(text, kind))
    if encoding == "ros1":
        return lambda raw: store.deserialize_ros1(raw, kind)
    return lambda raw: store.deserialize_cdr(raw, kind)


def _json_sample(raw: bytes, place: str) -> Sample:
    fields = json.loads(raw)
    if not isinstance(fields, Mapping):
        raise DataFileError(f"JSON objects {place}", f"{fields!r:.60}")
    columns = {
        key: float(value) for key, value in fields.items() if isinstance(value, int | float) and not isinstance(value, bool)
    }
    return Sample(0, columns, (), {})
