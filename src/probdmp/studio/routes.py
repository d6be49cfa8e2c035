"""Which address answers what."""

from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from probdmp import __version__
from probdmp.studio.connection import converse
from probdmp.studio.limits import MOST_SOCKETS
from probdmp.studio.room import Room
from probdmp.studio.session import Session
from probdmp.studio.sessions import Sessions
from probdmp.studio.workers import Workers

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.websockets import WebSocket

__all__ = ["Studio", "studio_app"]

STATIC = Path(str(files("probdmp.studio") / "static"))


class Studio:
    """What the routes share.

    Parameters
    ----------
    on_ready : called once the server is there.
    """

    def __init__(self, given: Sequence[Path], on_ready: Callable[[], None], workers: Workers | None = None) -> None:
        self.workers = Workers() if workers is None else workers
        self.sessions = Sessions(self._open_room)
        self.n_sockets = 0
        self._given, self._on_ready = given, on_ready

    def _open_room(self, name: str) -> Room:
        return Room(Session(name), self.workers)

    @asynccontextmanager
    async def lifespan(self, app: Any) -> AsyncIterator[None]:
        """From the first request to the last."""
        self.workers.start()
        self._on_ready()
        try:
            yield
        finally:
            self.workers.stop()

    async def health(self, request: "Request") -> "Response":
        """That it is there."""
        from starlette.responses import JSONResponse

        return JSONResponse({"ok": True, "version": __version__})

    async def page(self, request: "Request") -> "Response":
        """The page."""
        from starlette.responses import FileResponse

        return FileResponse(STATIC / "index.html")

    async def websocket(self, socket: "WebSocket") -> None:
        """A page's connection."""
        if self.n_sockets >= MOST_SOCKETS:
            await socket.close(1013)
            return
        self.n_sockets += 1
        try:
            await socket.accept()
            room, was_there = self.sessions.enter(socket.query_params.get("session"))
            if not was_there:
                await socket.send_json({"type": "fresh", "text": "The session is no longer there; this is a new one."})
            await converse(socket, room)
            if room.session.outbox is None:
                self.sessions.leave(room)
        finally:
            self.n_sockets -= 1


def studio_app(host: str, token: str | None, given: Sequence[Path], on_ready: Callable[[], None] = lambda: None) -> Any:
    """The application, as ASGI has it."""
    from starlette.applications import Starlette
    from starlette.routing import Mount, Route, WebSocketRoute
    from starlette.staticfiles import StaticFiles

    studio = Studio(given, on_ready)
    return Starlette(
        routes=[
            Route("/", studio.page),
            Route("/health", studio.health),
            WebSocketRoute("/ws", studio.websocket),
            Mount("/static", StaticFiles(directory=STATIC)),
        ],
        lifespan=studio.lifespan,
    )
