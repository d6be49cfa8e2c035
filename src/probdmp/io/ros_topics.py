"""Which topic of a recording is the movement."""

from collections.abc import Sequence
from typing import NamedTuple

from probdmp.errors import DataFileError, InputError
from probdmp.io.recordings import listing
from probdmp.io.ros_messages import is_movement, short_type

__all__ = ["Topic", "choose_topic"]


class Topic(NamedTuple):
    """What a recording says of a topic."""

    name: str
    kind: str
    """Type of its messages."""
    n_messages: int


def choose_topic(topics: Sequence[Topic], wanted: str | None, name: str) -> Topic:
    """The topic that was asked for, or else the only one whose messages are positions.

    Parameters
    ----------
    name : of the file, for messages.

    Raises
    ------
    DataFileError
        If no topic has messages.
    InputError
        If there is no such topic, or several could be the movement.
    """
    having = [topic for topic in topics if topic.n_messages]
    if not having:
        raise DataFileError(f"topics with messages in {name}", listing(map(_text, topics)) or "none")
    if wanted is not None:
        found = [topic for topic in having if topic.name.strip("/") == wanted.strip("/")]
        if not found:
            raise InputError(f"topic to be one of those in {name}: {listing(map(_text, having))}", repr(wanted))
        return found[0]
    candidates = [topic for topic in having if is_movement(topic.kind) or topic.kind == "json"]
    candidates = candidates or (having if len(having) == 1 else [])
    if len(candidates) != 1:
        hint = f"Choose one: topic={(candidates or having)[0].name!r}, --topic of fit and convert on the command line."
        got = f"{len(candidates)}: " if candidates else "none, but "
        raise InputError(f"one topic with positions in {name}, or topic", got + listing(map(_text, candidates or having)), hint)
    return candidates[0]


def _text(topic: Topic) -> str:
    return f"{topic.name} ({short_type(topic.kind)}, {topic.n_messages} messages)"
