"""How messages in an MCAP file are decoded: those of ROS 1 and 2 by the types that the file defines, and JSON."""

import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from probdmp.errors import DataFileError
from probdmp.io.ros_messages import Sample, sample_of
from probdmp.io.ros_topics import Topic

__all__ = ["kind_of", "samples_of"]

TYPES = {("cdr", "ros2msg"), ("cdr", "ros2idl"), ("ros1", "ros1msg")}
"""Encodings of messages and of their types that are understood, besides JSON."""


def kind_of(channel: Any, schema: Any) -> str:
    """The type of the messages of a channel: as in ROS 2, "json", or what the file calls it."""
    if channel.message_encoding == "json":
        return "json"
    kind = schema.name if schema is not None else channel.message_encoding
    return kind if "/msg/" in kind else kind.replace("/", "/msg/")


def samples_of(messages: Iterator[Any], topic: Topic, place: str) -> Iterator[tuple[int, Sample]]:
    """When each message of a topic was logged, nanoseconds, and what is in it.

    Raises
    ------
    DataFileError
        If messages are in an encoding that is not known.
    """
    decoders: dict[int, Callable[[bytes], Any]] = {}
    for schema, channel, message in messages:
        if kind_of(channel, schema) != topic.kind:
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
