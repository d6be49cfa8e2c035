"""The server: where it listens, and how it begins and ends."""

import secrets
import socket
import webbrowser
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from threading import Timer
from types import FrameType
from typing import Any

from probdmp.errors import MissingExtraError

__all__ = ["LOOPBACK", "StudioOptions", "make_server", "require_studio", "serve"]

LOOPBACK = ("127.0.0.1", "localhost", "::1")


@dataclass(frozen=True, slots=True)
class StudioOptions:
    """Where to listen and what to show."""

    host: str = "127.0.0.1"
    port: int = 0
    """0: any that is free."""
    token: str | None = None
    """What a page has to bring; a random one unless given, where others than this machine can connect."""
    opens_browser: bool = True
    files: Sequence[Path] = ()
    """Models and demonstrations that are there from the beginning."""

    @property
    def is_local(self) -> bool:
        """Whether only this machine can connect."""
        return self.host in LOOPBACK


def require_studio() -> None:
    """Refuse, with the command to type, where the web server is not installed."""
    missing = [name for name in ("starlette", "uvicorn", "websockets") if find_spec(name) is None]
    if missing:
        raise MissingExtraError(
            f"{' and '.join(missing)} for the studio", "none installed", "Type: pip install 'probdmp[studio]'"
        )


def serve(options: StudioOptions, on_ready: Callable[[str], None] = lambda address: None) -> None:
    """Serve until interrupted.

    Parameters
    ----------
    on_ready : called with the address of the page, once it is there.
    """
    require_studio()
    from probdmp.studio.application import studio_app
    from probdmp.studio.jobs import read_file

    given = {path.stem: read_file(str(path)) for path in options.files}
    token = options.token if options.token or options.is_local else secrets.token_urlsafe(24)
    listening = _listening(options)
    port = listening.getsockname()[1]
    shown = f"[{options.host}]" if ":" in options.host else options.host
    address = f"http://{shown}:{port}/" + (f"?token={token}" if token else "")
    app = studio_app(options.host, token, given, lambda: _announce(address, options.opens_browser, on_ready))
    make_server(app).run(sockets=[listening])


def make_server(app: Any) -> Any:
    """What answers for an application: uvicorn, with limits, ended by the first interruption."""
    import uvicorn

    from probdmp.studio.limits import LARGEST_TRANSPORTED, MOST_REQUESTS

    class Server(uvicorn.Server):
        """Ends when it is interrupted, however often, and says nothing about it."""

        def handle_exit(self, sig: int, frame: FrameType | None) -> None:
            self.should_exit = True

    config = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        ws="websockets-sansio",
        ws_max_size=LARGEST_TRANSPORTED,
        ws_max_queue=8,
        ws_per_message_deflate=False,
        limit_concurrency=MOST_REQUESTS,
        timeout_graceful_shutdown=1,
        server_header=False,
    )
    return Server(config)


def _listening(options: StudioOptions) -> socket.socket:
    family = socket.AF_INET6 if ":" in options.host else socket.AF_INET
    return socket.create_server((options.host, options.port), family=family)


def _announce(address: str, opens_browser: bool, on_ready: Callable[[str], None]) -> None:
    on_ready(address)
    if opens_browser:
        Timer(0.3, webbrowser.open, [address]).start()
