"""MCAP files for Foxglove: a topic for each track, a message for each time, and a log of events with their reasons.

Values are JSON with a schema, so that any reader of MCAP can make sense of them; events are `foxglove.Log`. Times count from
the start of the execution, at zero. Needs the extra `foxglove`.
"""

import io
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from probdmp.errors import MissingExtraError
from probdmp.io import write_atomically
from probdmp.plotting.timelines import Event, Timelines, Track, nanoseconds_of

__all__ = ["LOG", "require_foxglove", "write_mcap"]

LOG = "/log"
"""Topic of the events."""


def require_foxglove() -> None:
    """Refuse, with the command to type, where the Foxglove SDK is not installed."""
    if find_spec("foxglove") is None:
        hint = "Type: pip install 'probdmp[foxglove]'"
        raise MissingExtraError("foxglove-sdk for .mcap files", "none installed", hint)


def write_mcap(path: str | Path, timelines: Timelines) -> None:
    """Write an MCAP file, atomically.

    Raises
    ------
    InputError
        If something other than a regular file is in the way.
    MissingExtraError
        If the Foxglove SDK is not installed.
    """
    require_foxglove()
    import foxglove
    from foxglove.channels import LogChannel
    from foxglove.messages import Log, LogLevel, Timestamp

    context, buffer = foxglove.Context(), io.BytesIO()
    with foxglove.open_mcap(buffer, context=context) as writer:
        if timelines.heading:
            writer.write_metadata("probdmp", {"heading": timelines.heading})
        for track in timelines.tracks:
            channel = foxglove.Channel(f"/{track.name}", schema=_schema(track), context=context, metadata={"view": track.view})
            for nanoseconds, known in track.rows():
                channel.log(known, log_time=nanoseconds)
        levels = {"info": LogLevel.Info, "warning": LogLevel.Warning, "error": LogLevel.Error}
        log = LogChannel(LOG, context=context)
        for event in timelines.events:
            seconds, rest = divmod(_nanoseconds(event), 10**9)
            stamp = Timestamp(sec=seconds, nsec=rest)
            message = Log(timestamp=stamp, level=levels[event.level], message=event.text, name="probdmp")
            log.log(message, log_time=_nanoseconds(event))
    write_atomically(path, buffer.getvalue())


def _nanoseconds(event: Event) -> int:
    return int(nanoseconds_of(np.asarray([event.time]))[0])


def _schema(track: Track) -> dict[str, object]:
    """JSON schema of a message: numbers by name; what is not known is not in it."""
    numbers = {name: {"type": "number"} for name in track.columns}
    return {"type": "object", "title": f"probdmp.{'.'.join(track.columns)}", "description": track.view, "properties": numbers}
