"""Demonstrations in an MCAP file: one recording, one demonstration.

Messages of ROS 1 and 2, of the types that the file itself defines, and JSON, of which those fields of a message that are
numbers become columns. A file of `write_mcap` says in its metadata what the demonstration was.
"""

import os
from typing import Any

from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError
from probdmp.io.mcap_about import about_of
from probdmp.io.mcap_messages import kind_of, samples_of
from probdmp.io.regular_file import open_regular
from probdmp.io.ros_chunks import LARGEST_CHUNK, check_mcap_chunks
from probdmp.io.ros_library import require_ros, undamaged
from probdmp.io.ros_samples import demonstration_of_messages
from probdmp.io.ros_topics import Topic, choose_topic
from probdmp.io.selection import EVERYTHING, Selection

__all__ = ["read_mcap"]

LARGEST_MCAP = 2**40


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
        samples = samples_of(reader.iter_messages(topics=[topic.name]), topic, place)
        if about is None:
            return demonstration_of_messages(samples, selection, place, name)
        own = ((logged, about.sample(sample)) for logged, sample in samples)
        return demonstration_of_messages(own, selection, place, name, about)


def _topics(summary: Any) -> list[Topic]:
    """Each with all of its publishers."""
    counts: dict[tuple[str, str], int] = {}
    for channel in summary.channels.values():
        key = (channel.topic, kind_of(channel, summary.schemas.get(channel.schema_id)))
        counts[key] = counts.get(key, 0) + summary.statistics.channel_message_counts.get(channel.id, 0)
    return [Topic(*key, count) for key, count in sorted(counts.items())]
