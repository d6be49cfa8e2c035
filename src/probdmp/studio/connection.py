"""One page at the websocket: its messages in, answers and frames out."""

import asyncio
import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from probdmp.errors import InputError, ProbDMPError
from probdmp.studio import views
from probdmp.studio.actions import act
from probdmp.studio.limits import LARGEST_MESSAGE, MOST_VIOLATIONS
from probdmp.studio.outbox import Outbox
from probdmp.studio.room import Room

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

__all__ = ["converse", "parsed"]

GOING_AWAY, POLICY, TOO_BIG, TAKEN_OVER = 1001, 1008, 1009, 4001
"""Codes that close a websocket."""


def parsed(text: str) -> Any:
    """The value of a message; its numbers are finite.

    Raises
    ------
    InputError
        If it is not JSON.
    """
    try:
        return json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise InputError("a message in JSON", f"something else ({error!s:.100})") from error


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is not JSON")


async def converse(socket: "WebSocket", room: Room) -> None:
    """Until the page goes, falls too far behind, or another connection takes its session over."""
    outbox = Outbox()
    room.session.outbox = outbox
    sending = asyncio.create_task(outbox.empty(socket.send_text, socket.send_bytes))
    listening = asyncio.create_task(_listen(socket, room, outbox))
    try:
        await asyncio.wait([sending, listening], return_when=asyncio.FIRST_COMPLETED)
        code = listening.result() if listening.done() and listening.exception() is None else POLICY
        if code is not None:
            with suppress(Exception):  # it may have gone already
                await asyncio.wait_for(socket.close(code), 1.0)
    finally:
        for task in (sending, listening):
            task.cancel()
        await asyncio.gather(sending, listening, return_exceptions=True)
        if room.session.outbox is outbox:
            room.session.outbox = None


async def _listen(socket: "WebSocket", room: Room, outbox: Outbox) -> int | None:
    """Take messages one after the other; the code to close with, None if the page has gone."""
    n_violations = 0
    while room.session.outbox is outbox:
        received = await socket.receive()
        if received["type"] == "websocket.disconnect":
            return None
        text = received.get("text")
        try:
            if text is None:
                raise InputError("a text message", "a binary one")
            if len(text.encode()) > LARGEST_MESSAGE:
                n_violations += 1
                raise InputError(f"a message of at most {LARGEST_MESSAGE} bytes", f"{len(text)} characters")
            await act(room, parsed(text))
        except ProbDMPError as error:
            outbox.send({"type": "error", **views.error_view(error)})
        if n_violations >= MOST_VIOLATIONS:
            return TOO_BIG
    return TAKEN_OVER
