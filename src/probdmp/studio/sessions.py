"""Sessions by their secret names, kept for a while after their page has gone."""

import secrets
import time
from collections.abc import Callable

from probdmp.studio.limits import MOST_SESSIONS, SESSION_SECONDS
from probdmp.studio.room import Room

__all__ = ["Sessions"]


class Sessions:
    """All that is going on.

    Parameters
    ----------
    open_room : makes the room of a new session from its name.
    """

    def __init__(self, open_room: Callable[[str], Room]) -> None:
        self._open_room = open_room
        self._rooms: dict[str, Room] = {}
        self._left: dict[str, float] = {}

    def __len__(self) -> int:
        return len(self._rooms)

    def find(self, name: str | None) -> Room | None:
        """The room of a session, if it is still there."""
        return self._rooms.get(name) if name is not None else None

    def enter(self, name: str | None) -> tuple[Room, bool]:
        """The room for a page, and whether it is the one that it asked for; a fresh one if there is none."""
        self.tidy()
        room = self.find(name)
        if room is None:
            fresh = secrets.token_hex(16)
            room = self._rooms[fresh] = self._open_room(fresh)
            self._left.pop(fresh, None)
            return room, name is None
        self._left.pop(room.session.name, None)
        return room, True

    def leave(self, room: Room) -> None:
        """A page has gone; it may come back."""
        self._left[room.session.name] = time.monotonic()
        self.tidy()

    def tidy(self) -> None:
        """Forget what was left too long ago, and the longest left if there is too much."""
        now = time.monotonic()
        for name, since in sorted(self._left.items(), key=lambda item: item[1]):
            if now - since > SESSION_SECONDS or len(self._rooms) > MOST_SESSIONS:
                del self._left[name]
                self._rooms.pop(name).close()
