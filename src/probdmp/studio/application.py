"""The application: routes behind the guard."""

from collections.abc import Callable, Mapping
from typing import Any

from probdmp.studio.guard import Guard
from probdmp.studio.jobs import Contents
from probdmp.studio.routes import STATIC, Studio

__all__ = ["studio_app"]


def studio_app(
    host: str,
    token: str | None,
    given: Mapping[str, Contents],
    on_ready: Callable[[], None] = lambda: None,
) -> Any:
    """The application, as ASGI has it.

    Parameters
    ----------
    host : where it will listen.
    token : what a page has to bring; None: nothing.
    given : contents of the files that every session begins with, by the stem of their names.
    on_ready : called once the server is there.
    """
    from starlette.applications import Starlette
    from starlette.middleware import Middleware
    from starlette.routing import Mount, Route, WebSocketRoute
    from starlette.staticfiles import StaticFiles

    studio = Studio(given, on_ready)
    return Starlette(
        routes=[
            Route("/", studio.page),
            Route("/health", studio.health),
            Route("/upload/{session}", studio.upload, methods=["POST"]),
            Route("/download/{session}/{name}", studio.download),
            WebSocketRoute("/ws", studio.websocket),
            Mount("/static", StaticFiles(directory=STATIC)),
        ],
        middleware=[Middleware(Guard, host=host, token=token)],
        lifespan=studio.lifespan,
    )
