"""Who may talk to the server: pages that it has served itself, and where others can connect, those who know the token."""

import hmac
import ipaddress
import socket
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

from probdmp.studio.server import LOOPBACK

__all__ = ["COOKIE", "Guard"]

Scope = MutableMapping[str, Any]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]

COOKIE = "probdmp-studio"
HEADERS = [
    (b"content-security-policy", b"default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cache-control", b"no-store"),
]


class Guard:
    """In front of the application.

    Parameters
    ----------
    host : where the server listens.
    token : what a page has to bring once; None: nothing, only this machine can connect.
    """

    def __init__(self, app: Callable[[Scope, Receive, Send], Awaitable[None]], host: str, token: str | None) -> None:
        self._app, self._host, self._token = app, host, token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request or connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        refused = self._refused(headers)
        brought = parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[0]
        if not refused and not (self._is_token(brought) or self._is_token(_cookie(headers))):
            refused = (403, "Open the address that the server has printed: it has the token.")
        if refused:
            await _refuse(scope, receive, send, *refused)
            return
        cookie = [(b"set-cookie", f"{COOKIE}={self._token}; HttpOnly; SameSite=Strict; Path=/".encode())]

        async def sent(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                added = HEADERS + (cookie if self._token and self._is_token(brought) else [])
                message["headers"] = [*message.get("headers", []), *added]
            await send(message)

        await self._app(scope, receive, sent if scope["type"] == "http" else send)

    def _refused(self, headers: dict[str, str]) -> tuple[int, str] | None:
        """Status and reason, where Host or Origin are somebody else's."""
        host, origin = headers.get("host", ""), headers.get("origin")
        if not self._is_own(host):
            return 421, "This server does not go by that name."
        if origin is not None and (urlsplit(origin).scheme not in ("http", "https") or urlsplit(origin).netloc != host):
            return 403, "Only pages of this server may ask."
        return None

    def _is_own(self, host: str) -> bool:
        """Whether a Host header names this server, and not one that a stranger has pointed at it."""
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        if self._host in LOOPBACK:
            return name in LOOPBACK
        return name in (self._host, *LOOPBACK, socket.gethostname().lower()) or _is_address(name)

    def _is_token(self, text: str) -> bool:
        return self._token is None or hmac.compare_digest(text.encode(), self._token.encode())


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _cookie(headers: dict[str, str]) -> str:
    try:
        found = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return "" if found is None else found.value


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, reason: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": reason})
        return
    head = [*HEADERS, (b"content-type", b"text/plain; charset=utf-8")]
    await send({"type": "http.response.start", "status": status, "headers": head})
    await send({"type": "http.response.body", "body": reason.encode()})
