"""A page as tests have it: a websocket to a studio that runs in a thread of this process."""

import json
import socket
import threading
import time

import httpx
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from probdmp.studio.application import studio_app
from probdmp.studio.server import make_server

PATIENCE = 60
"""Seconds."""


class RunningStudio:
    """A studio on a free port of 127.0.0.1; `buffered`: bytes that the system keeps of what a page does not read."""

    def __init__(self, token=None, given=None, host="127.0.0.1", port=0, buffered=None):
        self._buffered = buffered
        self.app = studio_app(host, token, given or {})
        self._server = make_server(self.app)
        self._server.config.port = port
        self._thread = threading.Thread(target=self._server.run)

    def __enter__(self):
        self._thread.start()
        since = time.monotonic()
        while not self._server.started:
            assert time.monotonic() - since < PATIENCE
            time.sleep(0.01)
        listening = self._server.servers[0].sockets[0]
        if self._buffered is not None:
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, self._buffered)
        self.port = listening.getsockname()[1]
        self.address = f"127.0.0.1:{self.port}"
        return self

    def __exit__(self, *_):
        self._server.should_exit = True
        self._thread.join(PATIENCE)
        assert not self._thread.is_alive()

    @property
    def shared(self):
        """What the server has in common for all pages, to be looked at."""
        return self.app.routes[0].endpoint.__self__

    def page(self, session=None, **options):
        return Page(self, session, **options)

    def http(self, **headers):
        return httpx.Client(base_url=f"http://{self.address}", headers=headers, timeout=PATIENCE)


class Page:
    """Says things, and waits for what it is told."""

    def __init__(self, studio, session=None, query="", **options):
        self.studio, self.frames = studio, []
        query = f"?session={session}" if session else query
        connection = connect(f"ws://{studio.address}/ws{query}", max_size=None, compression=None, **options)
        self.socket = connection.__enter__()
        self.session = session

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def say(self, type, **fields):
        self.socket.send(json.dumps({"type": type, **fields}))

    def hear(self, *types, patience=PATIENCE, where=lambda message: True):
        """The next message of one of these types; frames before it are kept."""
        until = time.monotonic() + patience
        while True:
            received = self.socket.recv(timeout=max(until - time.monotonic(), 0))
            if isinstance(received, bytes):
                self.frames.append(received)
                continue
            message = json.loads(received)
            self.session = message.get("session", self.session)
            if message["type"] in types and where(message):
                return message

    def watch(self, count):
        """The next frames, so many; messages between them are passed over."""
        since, until = len(self.frames), time.monotonic() + PATIENCE
        while len(self.frames) < since + count:
            received = self.socket.recv(timeout=max(until - time.monotonic(), 0))
            if isinstance(received, bytes):
                self.frames.append(received)
        return self.frames[since:]

    def ask(self, type, *answers, where=lambda message: True, **fields):
        """Says it, and hears the answer; `where` tells it from what was under way already."""
        self.say(type, **fields)
        return self.hear(*(answers or ("error",)), where=where)

    def state(self):
        return self.ask("hello", "state")

    def closing_code(self):
        """The code with which the server closes, whatever it says before."""
        try:
            while True:
                self.socket.recv(timeout=PATIENCE)
        except ConnectionClosed as closed:
            return closed.rcvd.code if closed.rcvd else None


def points_of(demonstration, pressure=None):
    """A stroke as a page sends it."""
    rows = zip(demonstration.times.tolist(), demonstration.positions.tolist(), strict=True)
    return [[t, *row, pressure] for t, row in rows]
