"""What each message of a page does."""

from collections.abc import Awaitable, Callable, Mapping
from typing import Any

import numpy as np

from probdmp.checks import check_choice
from probdmp.demonstrations import FAULTS
from probdmp.errors import InputError, InputTypeError
from probdmp.execution import DISTURBANCES
from probdmp.studio.commands import commands_of
from probdmp.studio.fields import (
    FARTHEST,
    choice_of,
    name_of,
    number_of,
    optional_name_of,
    optional_point_of,
    place_of,
    points_of,
)
from probdmp.studio.origins import DRAWN, origin_in
from probdmp.studio.room import Room
from probdmp.studio.session import TaskWish
from probdmp.studio.strokes import EXAMPLES, example_strokes, stroke_of

__all__ = ["ACTIONS", "act"]

Message = Mapping[str, Any]
DURATIONS = (0.05, 60.0)
"""Shortest and longest that may be asked for, seconds."""
SPEEDS = (0.1, 4.0)
MOST_VIA_POINTS = 8


async def act(room: Room, message: object) -> None:
    """Do what a message asks for.

    Raises
    ------
    ProbDMPError
        If it is none, or asks for what cannot be done.
    """
    if not isinstance(message, dict):
        raise InputTypeError("a message as a JSON object", f"{message!r:.100}")
    kind = message.get("type")
    if not isinstance(kind, str) or kind not in ACTIONS:
        raise InputError(f"a message of a type out of {', '.join(ACTIONS)}", f"{kind!r:.100}")
    await ACTIONS[kind](room, message)


async def _hello(room: Room, message: Message) -> None:
    room.show_state()
    for label in room.session.library:
        await room.show_band(label)


async def _stroke(room: Room, message: Message) -> None:
    label = name_of(message)
    room.session.add_strokes(label, [stroke_of(points_of(message, least=3), label)], origin_in(message))
    _taught(room, label)


async def _example(room: Room, message: Message) -> None:
    label = choice_of(message, "name", EXAMPLES)
    room.session.add_strokes(label, await room.workers.run(example_strokes, label), DRAWN)
    _taught(room, label)


async def _delete_stroke(room: Room, message: Message) -> None:
    label = name_of(message)
    movement = room.session.movement(label)
    del movement.strokes[place_of(message, "index", len(movement.strokes))]
    movement.version += 1
    _taught(room, label)


def _taught(room: Room, label: str) -> None:
    room.learner.learn(label)
    room.show_state()


async def _add_label(room: Room, message: Message) -> None:
    label = name_of(message)
    room.session.add_label(label)
    room.session.select(label)
    room.show_state()


async def _rename_label(room: Room, message: Message) -> None:
    name = name_of(message, "to")
    room.session.rename(name_of(message), name)
    _taught(room, name)


async def _delete_label(room: Room, message: Message) -> None:
    room.session.delete(name_of(message))
    room.learner.calibrate()
    room.show_state()


async def _select(room: Room, message: Message) -> None:
    label = name_of(message)
    room.session.select(label)
    room.session.task = TaskWish()
    room.show_state()
    await room.show_band(label)


async def _settings(room: Room, message: Message) -> None:
    session = room.session
    before, session.settings = session.settings, session.settings.changed(message)
    if session.settings.learns_like(before):
        room.learner.calibrate()
    else:
        for label in session.all_strokes():
            session.movements[label].version += 1
        room.learner.learn(*sorted(session.all_strokes(), key=lambda label: label == session.selected))
    room.show_state()


async def _task(room: Room, message: Message) -> None:
    session = room.session
    label, _ = session.learned(None)
    via = message.get("via")
    rows = [] if via in (None, []) else points_of(message, "via", columns=3).tolist()
    if len(rows) > MOST_VIA_POINTS or any(not 0 < phase <= 1 for phase, _, _ in rows):
        wanted = f"at most {MOST_VIA_POINTS} via-points, each a part above 0 and up to 1 of the duration, x and y"
        raise InputError(wanted, f"{rows!r:.100}")
    wish = TaskWish(
        start=optional_point_of(message, "start"),
        goal=optional_point_of(message, "goal"),
        via=tuple((phase, np.array([x, y])) for phase, x, y in rows),
        duration=None if message.get("duration") is None else number_of(message, "duration", *DURATIONS),
    )
    before, session.task = session.task, wish
    try:
        await room.show_band(label)
    except BaseException:
        session.task = before
        raise


async def _play(room: Room, message: Message) -> None:
    fault = None if message.get("fault") is None else choice_of(message, "fault", FAULTS)
    await room.play(fault, number_of(message, "onset", 0, 1, 0.4), number_of(message, "speed", *SPEEDS, 1.0))


async def _pointer(room: Room, message: Message) -> None:
    mode = check_choice(message.get("mode"), "mode", DISTURBANCES)
    point: tuple[float, float] | None = None
    if mode in ("hold", "push"):
        point = (number_of(message, "x", -FARTHEST, FARTHEST), number_of(message, "y", -FARTHEST, FARTHEST))
    if room.playing is not None:
        room.playing.pen.disturb(mode, point)


async def _stop(room: Room, message: Message) -> None:
    was_playing = room.playing is not None
    room.stop()
    if was_playing:
        room.session.send({"type": "played", "completed": False})


async def _export_commands(room: Room, message: Message) -> None:
    room.session.send({"type": "commands", **commands_of(room.session)}, "commands")


async def _trace_begin(room: Room, message: Message) -> None:
    await room.begin_trace(optional_name_of(message))


async def _trace(room: Room, message: Message) -> None:
    await room.trace(points_of(message))


async def _trace_end(room: Room, message: Message) -> None:
    await room.end_trace()


async def _replay(room: Room, message: Message) -> None:
    await room.replay(*_recording_of(room, message))


async def _compare(room: Room, message: Message) -> None:
    await room.compare(*_recording_of(room, message))


def _recording_of(room: Room, message: Message) -> tuple[str, int]:
    label = name_of(message)
    return label, place_of(message, "index", room.session.n_recordings(label))


ACTIONS: dict[str, Callable[[Room, Message], Awaitable[None]]] = {
    "hello": _hello,
    "stroke": _stroke,
    "delete_stroke": _delete_stroke,
    "add_label": _add_label,
    "rename_label": _rename_label,
    "delete_label": _delete_label,
    "select": _select,
    "example": _example,
    "settings": _settings,
    "task": _task,
    "play": _play,
    "pointer": _pointer,
    "stop": _stop,
    "trace_begin": _trace_begin,
    "trace": _trace,
    "trace_end": _trace_end,
    "replay": _replay,
    "compare": _compare,
    "export_commands": _export_commands,
}
"""By type of message."""
