"""What waits to be sent to one page, bounded whatever the page does."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from typing import Any

__all__ = ["MOST_WAITING", "Outbox"]

MOST_WAITING = 64
"""Messages that may wait; a page that lets more pile up is no longer there."""


class Outbox:
    """Messages in their order, of those with a key only the newest; and one slot for the newest frame."""

    def __init__(self) -> None:
        self._messages: dict[object, str] = {}
        self._frame: bytes | None = None
        self._news, self._n_sent = asyncio.Event(), 0
        self.is_overflown = False
        """Whether the page has fallen so far behind that it has to connect anew."""

    def send(self, message: dict[str, Any], key: str | None = None) -> None:
        """Queue a message; one with the same key that still waits is replaced."""
        text = json.dumps(message, allow_nan=False)  # now: what it speaks of may change
        self._n_sent += 1
        name: object = self._n_sent if key is None else key
        self._messages.pop(name, None)
        self._messages[name] = text
        self.is_overflown |= len(self._messages) > MOST_WAITING
        if self.is_overflown:
            self._messages.clear()
        self._news.set()

    def show(self, frame: bytes) -> None:
        """The newest frame; one that still waits is dropped."""
        self._frame = frame
        self._news.set()

    async def empty(self, send_text: Callable[[str], Awaitable[None]], send_bytes: Callable[[bytes], Awaitable[None]]) -> None:
        """Send whatever comes, until the page has fallen too far behind."""
        while not self.is_overflown:
            await self._news.wait()
            self._news.clear()
            while self._messages and not self.is_overflown:
                await send_text(self._messages.pop(next(iter(self._messages))))
            frame, self._frame = self._frame, None
            if frame is not None:
                await send_bytes(frame)
