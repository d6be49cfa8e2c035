"""One page at the websocket: its messages in, answers and frames out."""

import asyncio
import json
from contextlib import suppress
from logging import getLogger
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

logger = getLogger(__name__)
TOO_BIG, TAKEN_OVER = 1009, 4001
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
    if room.session.outbox is not None:
        room.session.outbox.end(TAKEN_OVER)
    outbox = room.session.outbox = Outbox()
    sending = asyncio.create_task(outbox.empty(socket.send_text, socket.send_bytes))
    listening = asyncio.create_task(_listen(socket, room, outbox))
    ending = asyncio.create_task(outbox.ended.wait())
    try:
        await asyncio.wait([sending, listening, ending], return_when=asyncio.FIRST_COMPLETED)
        if outbox.reason:
            with suppress(Exception):  # it may have gone already, or be stuck
                await asyncio.wait_for(socket.close(outbox.reason), 1.0)
    finally:
        for task in (sending, listening, ending):
            task.cancel()
        await asyncio.gather(sending, listening, ending, return_exceptions=True)
        if room.session.outbox is outbox:
            room.session.outbox = None


async def _listen(socket: "WebSocket", room: Room, outbox: Outbox) -> None:
    """Take messages one after the other, until the page has gone or sends too much."""
    n_violations = 0
    while n_violations < MOST_VIOLATIONS:
        received = await socket.receive()
        if received["type"] == "websocket.disconnect":
            return
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
        except Exception as error:
            logger.exception("in answer to a message of a page")
            hint = "Please report it with what the server has printed."
            outbox.send({"type": "error", "expected": "this to work", "got": type(error).__name__, "hint": hint})
    outbox.end(TOO_BIG)
