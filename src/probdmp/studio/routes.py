"""Which address answers what."""

from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from importlib.resources import files
from logging import getLogger
from pathlib import Path
from typing import TYPE_CHECKING, Any

from probdmp import __version__
from probdmp.errors import InputError, ProbDMPError
from probdmp.studio.connection import converse
from probdmp.studio.files import DOWNLOADS, add_contents, add_file, download, received
from probdmp.studio.jobs import Contents
from probdmp.studio.limits import MOST_SOCKETS
from probdmp.studio.room import Room
from probdmp.studio.session import Session
from probdmp.studio.sessions import Sessions
from probdmp.studio.views import error_view
from probdmp.studio.workers import Workers

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.websockets import WebSocket

__all__ = ["STATIC", "Studio"]

logger = getLogger(__name__)
STATIC = Path(str(files("probdmp.studio") / "static"))


class Studio:
    """What the routes share.

    Parameters
    ----------
    given : contents of the files that every session begins with, by the stem of their names.
    on_ready : called once the server is there.
    """

    def __init__(self, given: Mapping[str, Contents], on_ready: Callable[[], None]) -> None:
        self.workers = Workers()
        self.sessions = Sessions(self._open_room)
        self.n_sockets = 0
        self._given, self._on_ready = given, on_ready

    def _open_room(self, name: str) -> Room:
        room = Room(Session(name), self.workers)
        for stem, contents in self._given.items():
            try:
                add_contents(room, stem, contents)
            except ProbDMPError as error:
                logger.warning("%s: %s", stem, error)
        return room

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

    async def upload(self, request: "Request") -> "Response":
        """A file for a session."""
        from starlette.responses import JSONResponse

        room = self.sessions.find(request.path_params["session"])
        if room is None:
            return _no_session()
        name, use = request.query_params.get("name", ""), request.query_params.get("as")
        try:
            taken = await add_file(room, name, await received(request.stream()), use == "execution")
        except ProbDMPError as error:
            return JSONResponse({"error": error_view(error)}, 400)
        return JSONResponse({"imported": taken._asdict()})

    async def download(self, request: "Request") -> "Response":
        """A file of a session."""
        from starlette.responses import JSONResponse, Response

        room, name = self.sessions.find(request.path_params["session"]), request.path_params["name"]
        if room is None or name not in DOWNLOADS:
            return _no_session()
        try:
            body = await download(room, name)
        except ProbDMPError as error:
            return JSONResponse({"error": error_view(error)}, 409)
        return Response(body, media_type=DOWNLOADS[name], headers={"content-disposition": f'attachment; filename="{name}"'})

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


def _no_session() -> "Response":
    from starlette.responses import JSONResponse

    missing = InputError("the address of a session that is there", "another one", "Load the page again.")
    return JSONResponse({"error": error_view(missing)}, 404)
