"""What waits to be sent to one page, bounded whatever the page does."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from probdmp.studio.messages import text_of

__all__ = ["MOST_WAITING", "POLICY", "Outbox"]

POLICY = 1008
"""Code that closes the websocket of a page that has fallen too far behind."""

MOST_WAITING = 64
"""Messages that may wait; a page that lets more pile up is no longer there."""


class Outbox:
    """Messages in their order, of those with a key only the newest; and one slot for the newest frame."""

    def __init__(self) -> None:
        self._messages: dict[object, str] = {}
        self._frame: bytes | None = None
        self._news, self._n_sent = asyncio.Event(), 0
        self.ended = asyncio.Event()
        """Set once nothing more is to be sent."""
        self.reason = 0
        """Why: the code to close the websocket with."""

    def send(self, message: dict[str, Any], key: str | None = None) -> None:
        """Queue a message; one with the same key that still waits is replaced."""
        if self.ended.is_set():
            return
        text = text_of(message)  # now: what it speaks of may change
        self._n_sent += 1
        name: object = self._n_sent if key is None else key
        self._messages.pop(name, None)
        self._messages[name] = text
        if len(self._messages) > MOST_WAITING:
            self.end(POLICY)
        self._news.set()

    def end(self, reason: int) -> None:
        """Forget what waits, and let the connection be closed."""
        self._messages.clear()
        self._frame, self.reason = None, self.reason or reason
        self.ended.set()
        self._news.set()

    def show(self, frame: bytes) -> None:
        """The newest frame; one that still waits is dropped."""
        self._frame = frame if not self.ended.is_set() else None
        self._news.set()

    async def empty(self, send_text: Callable[[str], Awaitable[None]], send_bytes: Callable[[bytes], Awaitable[None]]) -> None:
        """Send whatever comes, until the end."""
        while not self.ended.is_set():
            await self._news.wait()
            self._news.clear()
            while self._messages:
                await send_text(self._messages.pop(next(iter(self._messages))))
            frame, self._frame = self._frame, None
            if frame is not None:
                await send_bytes(frame)
