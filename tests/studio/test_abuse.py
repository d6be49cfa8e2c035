"""Whatever a page or a stranger sends is answered by an error or a refusal, and the server works on."""

import asyncio
import io
import json
import os
import socket
import time
import zipfile
from contextlib import suppress

import numpy as np
import pytest
from studio_page import PATIENCE, RunningStudio
from websockets.exceptions import InvalidStatus

from probdmp import FailureDetector, ProbabilisticDMP, write_demonstrations
from probdmp.demonstrations import Demonstration, synthetic_arm_movements
from probdmp.errors import InputError
from probdmp.studio.jobs import Contents
from probdmp.studio.limits import LARGEST_MESSAGE, MOST_LABELS, MOST_POINTS, MOST_SESSIONS, MOST_SOCKETS, MOST_STROKES
from probdmp.studio.outbox import MOST_WAITING, Outbox
from probdmp.studio.room import Room
from probdmp.studio.session import Session
from probdmp.studio.sessions import Sessions
from probdmp.studio.workers import Workers

SMALL = 4096
"""Bytes that a socket is to hold."""
LINE = [[0.01 * k, k, 2 * k, None] for k in range(30)]


def stroke(**changes):
    return json.dumps({"type": "stroke", "label": "a", "points": LINE} | changes)


def ask(type, **fields):
    return json.dumps({"type": type, **fields})


def bent(k, row):
    return [*LINE[:k], row, *LINE[k + 1 :]]


MESSAGES = {
    "no JSON": "{",
    "nothing": "",
    "NaN": '{"type": "pointer", "mode": "hold", "x": NaN, "y": 0}',
    "Infinity": '{"type": "play", "speed": Infinity}',
    "a list": "[]",
    "a number": "1",
    "null": "null",
    "a text": '"hello"',
    "lists nested deeply": "[" * 100_000,
    "objects nested deeply": '{"a":' * 50_000,
    "a number of 5000 digits": '{"type": "play", "speed": ' + "9" * 5000 + "}",
    "a number beyond floats": '{"type": "play", "speed": 1e999}',
    "no type": "{}",
    "an unknown type": ask("__class__"),
    "a type that is no text": '{"type": ["hello"]}',
    "a type that is an object": '{"type": {"hello": 1}}',
    "a stroke without a label": ask("stroke", points=LINE),
    "a label that is a number": stroke(label=7),
    "a label that is an object": stroke(label={"a": 1}),
    "an empty label": stroke(label="  "),
    "a label that is too long": stroke(label="x" * 61),
    "a label that steers a terminal": stroke(label="\x1b[31m"),
    "a label that turns text round": stroke(label="a\u202eb"),
    "a label with lines": stroke(label="a\nb"),
    "a reserved label": stroke(label="imported"),
    "a stroke without points": ask("stroke", label="a"),
    "points that are a text": stroke(points="x" * 100),
    "too few points": stroke(points=LINE[:2]),
    "too many points": stroke(points=[[k, 0, 0, 0] for k in range(MOST_POINTS + 1)]),
    "points of three": stroke(points=[row[:3] for row in LINE]),
    "a point that is a number": stroke(points=bent(5, 1)),
    "a point of lists": stroke(points=bent(5, [0.05, [1], 2, None])),
    "a point of texts": stroke(points=bent(5, [0.05, "1", 2, None])),
    "a point of truth values": stroke(points=bent(5, [0.05, True, 2, None])),
    "a place that is null": stroke(points=bent(5, [0.05, None, 2, None])),
    "a huge place": stroke(points=bent(5, [0.05, 1e300, 2, None])),
    "a huge whole number": stroke(points=bent(5, [0.05, 10**400, 2, None])),
    "times that go back": stroke(points=bent(5, [0.01, 1, 2, None])),
    "times that stand still": stroke(points=bent(5, LINE[4])),
    "a stroke of an hour": stroke(points=[*LINE, [3600, 1, 1, None]]),
    "a stroke of an instant": stroke(points=[[1e-9 * k, k, k, None] for k in range(5)]),
    "deleting of an unknown label": ask("delete_stroke", label="nobody", index=0),
    "renaming of an unknown label": ask("rename_label", label="nobody", to="b"),
    "deleting an unknown label": ask("delete_label", label="nobody"),
    "selecting an unknown label": ask("select", label="nobody"),
    "an example of markup": ask("example", name="<script>alert(1)</script>"),
    "an example without a name": ask("example"),
    "settings without any": ask("settings"),
    "no basis functions": ask("settings", n_basis=0),
    "many basis functions": ask("settings", n_basis=10**9),
    "half a basis function": ask("settings", n_basis=10.5),
    "a basis function in words": ask("settings", n_basis="30"),
    "an unknown weight model": ask("settings", weight_model="__import__('os')"),
    "an alpha of nothing": ask("settings", alpha=0),
    "an alpha that is a list": ask("settings", alpha=[0.01]),
    "pressure in words": ask("settings", use_pressure="yes"),
    "pressure of pooled weights": ask("settings", use_pressure=True, weight_model="pooled"),
    "a task before learning": ask("task", start=[0, 0]),
    "play before learning": ask("play"),
    "an unknown fault": ask("play", fault="rm -rf"),
    "an onset after the end": ask("play", onset=2),
    "a huge speed": ask("play", speed=1e9),
    "an unknown mode": ask("pointer", mode="throw"),
    "a pointer in words": ask("pointer", mode="hold", x="here", y="there"),
    "a pointer nowhere": ask("pointer", mode="push"),
    "a pointer far away": ask("pointer", mode="push", x=1e200, y=0),
    "a trace that has not begun": ask("trace", points=LINE),
    "the end of a trace that has not begun": ask("trace_end"),
    "a trace of an unknown label": ask("trace_begin", label="nobody"),
    "a replay of an unknown label": ask("replay", label="nobody", index=0),
    "a replay of what was not imported": ask("replay", label="imported", index=0),
    "a comparison without a label": ask("compare", index=0),
    "bytes": b"\x00\x01\x02",
    "a message that is too long": json.dumps({"type": "hello", "padding": "x" * LARGEST_MESSAGE}),
}


def test_there_are_at_least_forty():
    assert len(MESSAGES) >= 40


@pytest.mark.parametrize("name", MESSAGES)
def test_a_bad_message_is_answered_by_an_error(page, name):
    page.socket.send(MESSAGES[name])
    error = page.hear("error", "learning_failed")
    error = error.get("error", error)
    assert error["expected"]
    assert error["got"] not in ("TypeError", "ValueError", "KeyError", "IndexError", "AttributeError")
    assert page.state()["session"] == page.session


TASKS = {
    "a start of three": {"start": [1, 2, 3]},
    "a goal in words": {"goal": ["a", "b"]},
    "a huge goal": {"goal": [1e300, 0]},
    "no duration": {"duration": 0},
    "a long duration": {"duration": 1e9},
    "a via-point after the end": {"via": [[2, 1, 1]]},
    "a via-point before the start": {"via": [[-1, 1, 1]]},
    "via-points that are texts": {"via": ["abc"]},
    "many via-points": {"via": [[0.5, 1, 1]] * 1000},
}


def test_bad_tasks_leave_the_task_as_it_was(taught):
    for name, fields in TASKS.items():
        assert taught.ask("task", "error", "band", **fields)["type"] == "error", name
    for index in (-1, 6, 1.5, 10**30, "0", None, True):
        assert taught.ask("delete_stroke", "error", "state", label="c", index=index)["type"] == "error", index
    state = taught.state()
    assert state["task"] == {"start": None, "goal": None, "via": [], "duration": None}
    assert len(state["labels"][0]["strokes"]) == 6


def test_too_many_messages_that_are_too_long_end_the_connection(page):
    for _ in range(3):
        page.socket.send("x" * (LARGEST_MESSAGE + 1))
    assert page.closing_code() == 1009


def test_a_huge_message_ends_the_connection_at_once(studio, page):
    page.socket.send("x" * (8 * LARGEST_MESSAGE))
    assert page.closing_code() == 1009
    with studio.page() as other:
        assert other.state()


def test_names_are_text(page):
    hostile = "<img src=x onerror=alert(1)>\"'&"
    state = page.ask("stroke", "state", label=hostile, points=LINE)
    assert state["labels"][0]["name"] == hostile
    assert page.ask("export_commands", "commands")["shell"].count("'\"'\"'") >= 1  # quoted for a shell


def test_there_are_at_most_so_many_labels_and_strokes(page):
    for k in range(MOST_LABELS):
        page.ask("add_label", "state", label=f"{k}")
    assert page.ask("add_label", "error", "state", label="more")["got"] == "one more"
    full, still = Session("x"), Demonstration(np.arange(6.0).reshape(3, 2), 0.01)
    full.add_strokes("a", [still] * MOST_STROKES)
    with pytest.raises(InputError, match="at most 200 demonstrations"):
        full.add_strokes("a", [still])
    with pytest.raises(InputError, match="samples in a session"):
        full.add_strokes("b", [Demonstration(np.random.default_rng(0).random((100_000, 2)), 0.01)] * 11)


def test_there_are_at_most_so_many_sockets(studio):
    pages = []
    try:
        for _ in range(MOST_SOCKETS + 1):
            with suppress(InvalidStatus):
                pages.append(studio.page())
        assert MOST_SOCKETS // 2 < len(pages) <= MOST_SOCKETS
    finally:
        for page in pages:
            page.socket.close()
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:  # places are free again
        try:
            with studio.page() as again:
                assert again.state()
                return
        except InvalidStatus:
            time.sleep(0.05)
    raise AssertionError("no place was freed")


def bomb():
    """An archive that unpacks to hundreds of times its size."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name in ("data.npy", "offsets.npy", "labels.npy", "dt.npy", "columns.npy"):
            archive.writestr(name, bytes(60_000_000))
    return buffer.getvalue()


def arm(tmp_path):
    """Seven degrees of freedom."""
    write_demonstrations(tmp_path / "arm.npz", [synthetic_arm_movements(1, dt=0.02)[0].demonstration])
    return (tmp_path / "arm.npz").read_bytes()


FILES = {
    "no suffix": ("x", b"abc"),
    "an unknown suffix": ("x.exe", b"abc"),
    "a name that climbs": ("../../../etc/passwd", b"abc"),
    "a name that climbs, with a suffix": ("../../../../tmp/x.npz", b"abc"),
    "an empty file": ("x.npz", b""),
    "a damaged archive": ("x.npz", b"PK\x03\x04" + bytes(100)),
    "a damaged model": ("x.probdmp", b"\xff" * 100),
    "a model that promises much": ("x.probdmp", (2**62).to_bytes(8, "little") + b"{}"),
    "a pickle": ("x.npz", b"\x80\x04\x95."),
    "a table without positions": ("x.csv", b"a,b\n1,2\n3,4\n"),
    "a table of markup": ("x.csv", b"<html><script>alert(1)</script></html>"),
    "a bomb": ("x.npz", bomb),
    "an arm": ("x.npz", arm),
}


@pytest.mark.parametrize("name", FILES)
def test_a_bad_file_is_refused(page, tmp_path, name):
    file, body = FILES[name]
    if callable(body):
        body = body() if body is bomb else body(tmp_path)
    with page.studio.http() as http:
        reply = http.post(f"/upload/{page.session}", params={"name": file}, content=body)
    assert reply.status_code == 400, reply.text
    assert reply.json()["error"]["expected"]
    assert page.state()["labels"] == []


def test_a_file_that_is_too_large_is_not_read(page, monkeypatch):
    monkeypatch.setattr("probdmp.studio.files.LARGEST_UPLOAD", 1_000_000)
    with page.studio.http() as http:
        reply = http.post(f"/upload/{page.session}?name=x.npz", content=bytes(2_000_000))
    assert reply.status_code == 400
    assert "at most" in reply.json()["error"]["expected"]


ADDRESSES = {
    "an unknown session": "/download/" + "0" * 32 + "/model.probdmp",
    "an unknown file": "/download/{session}/passwd",
    "a file that climbs": "/download/{session}/..%2f..%2f..%2fetc%2fpasswd",
    "a session that climbs": "/download/..%2f..%2fetc/passwd",
    "static that climbs": "/static/..%2f..%2f..%2fserver.py",
    "static that climbs twice": "/static/%2e%2e/%2e%2e/server.py",
    "static that starts at the root": "/static//etc/passwd",
    "nothing": "/nowhere",
    "an upload by GET": "/upload/{session}",
    "nothing to download": "/download/{session}/model.probdmp",
}


@pytest.mark.parametrize("name", ADDRESSES)
def test_a_bad_address_is_refused(page, name):
    with page.studio.http() as http:
        reply = http.get(ADDRESSES[name].format(session=page.session))
    assert reply.status_code in (404, 405, 409)
    assert "root:" not in reply.text
    assert "import" not in reply.text


def test_strangers_are_refused(studio, page):
    with studio.http() as http:
        assert http.get("/health").json()["ok"]
        for host in (
            "evil.example",
            f"evil.example:{studio.port}",
            "127.0.0.1.evil.example",
            "",
            "[",
            "localhost@evil.example",
        ):
            assert http.get("/health", headers={"host": host}).status_code in (400, 421), host
        for origin in ("http://evil.example", "null", f"http://127.0.0.1:{studio.port + 1}", f"ftp://{studio.address}", "x"):
            for address in ("/", f"/download/{page.session}/session.zip"):
                assert http.get(address, headers={"origin": origin}).status_code == 403, origin
            reply = http.post(f"/upload/{page.session}?name=x.npz", content=b"", headers={"origin": origin})
            assert reply.status_code == 403
            with pytest.raises(InvalidStatus):
                studio.page(additional_headers={"Origin": origin})
        assert http.get("/", headers={"origin": f"http://{studio.address}"}).status_code == 200
    with studio.page(origin=f"http://{studio.address}") as own:
        assert own.state()


def test_every_answer_is_locked_down(studio):
    with studio.http() as http:
        for address in ("/", "/health", "/nowhere"):
            headers = http.get(address).headers
            assert headers["content-security-policy"].startswith("default-src 'self'")
            assert headers["x-content-type-options"] == "nosniff"
            assert headers["cache-control"] == "no-store"
            assert "server" not in headers


def test_a_token_opens_the_door_once_and_a_cookie_afterwards():
    with RunningStudio(token="secret-enough") as studio, studio.http() as http:
        for address in ("/", "/health", "/static/index.html", "/?token=wrong", "/?token="):
            assert http.get(address).status_code == 403, address
        for headers in ({}, {"Cookie": "probdmp-studio=wrong"}, {"Cookie": ';=;"'}):
            with pytest.raises(InvalidStatus):
                studio.page(additional_headers=headers)
        first = http.get("/?token=secret-enough")
        assert first.status_code == 200
        assert "HttpOnly" in first.headers["set-cookie"]
        assert "SameSite=strict" in first.headers["set-cookie"].replace("Strict", "strict")
        assert http.get("/health").status_code == 200  # the client keeps the cookie
        with studio.page(additional_headers={"Cookie": "probdmp-studio=secret-enough"}) as page:
            assert page.state()


def test_what_is_no_http_at_all_is_left_alone(studio, page):
    for garbage in (b"\x16\x03\x01\x02\x00", b"GET\r\n\r\n", b"A" * 100_000, b"GET / HTTP/9.9\r\n\r\n"):
        with socket.create_connection(("127.0.0.1", studio.port), timeout=PATIENCE) as raw:
            raw.sendall(garbage)
    assert page.state()


def test_a_flood_of_pointers_does_no_harm(taught):
    taught.ask("play", "playing", speed=2)
    for k in range(3000):
        taught.say("pointer", mode="push", x=k % 100, y=k % 75)
    taught.hear("played")
    assert taught.state()


def test_a_page_that_never_listens_gets_the_newest_frame_or_is_left():
    """Without a socket: what waits is bounded, whatever is sent."""

    async def flood():
        outbox, sent = Outbox(), []
        blocked = asyncio.Event()

        async def send(message):
            sent.append(message)
            await blocked.wait()

        sending = asyncio.create_task(outbox.empty(send, send))
        outbox.show(b"first")
        await asyncio.sleep(0)
        for k in range(100_000):
            outbox.show(b"%d" % k)
            outbox.send({"type": "state", "k": k}, "state")
        assert len(outbox._messages) == 1
        blocked.set()
        while len(sent) < 3:
            await asyncio.sleep(0)
        assert sent[0] == b"first"
        assert sent[-1] == b"99999"
        blocked.clear()
        for _ in range(MOST_WAITING + 2):
            outbox.send({"type": "error"})
        assert outbox.ended.is_set()
        assert not outbox._messages
        blocked.set()
        await asyncio.wait_for(sending, 1)

    asyncio.run(flood())


def test_a_page_that_does_not_read_for_a_while_gets_the_newest_and_not_all_of_it(drawn):
    """Over a socket that holds little: nothing piles up behind it."""
    learned = ProbabilisticDMP().fit(drawn)
    detector = FailureDetector().fit({"c": learned}, {"c": drawn})
    given = {"c": Contents([], {"c": learned}, detector)}
    with (
        RunningStudio(given=given, buffered=SMALL) as studio,
        narrow_socket(studio) as raw,
        studio.page(sock=raw, max_queue=1, ping_interval=None, close_timeout=0.1) as page,
    ):
        page.state()
        page.ask("play", "playing", speed=0.1)
        page.say("pointer", mode="hold", x=50, y=40)  # so that it lasts
        first = sequence_of(*page.watch(1))
        room = studio.shared.sessions.find(page.session)
        waiting, n_asked = room.session.outbox._messages, 30
        for _ in range(n_asked):
            page.say("hello")  # the state and a band of 50 kB
        page.say("export_commands")
        assert sampled(lambda: len(waiting), until=lambda: "commands" in waiting) <= 4  # with a verdict
        behind = room._sequence + 3
        assert sampled(lambda: len(waiting), until=lambda: room._sequence >= behind) <= 4
        page.hear("commands")
        came = [sequence_of(frame) for frame in page.frames]
        newest = sequence_of(*page.watch(1))
    assert newest >= behind
    assert came == sorted(set(came))
    assert len(came) < behind - first  # the others were left out


def test_a_page_that_never_reads_is_given_up(studio, page):
    n_sockets = studio.shared.n_sockets
    text = b'{"type":"' + b"x" * 100 + b'"}'
    with narrow_socket(studio) as raw:
        raw.sendall(
            f"GET /ws HTTP/1.1\r\nHost: {studio.address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        sampled(lambda: 0, until=lambda: studio.shared.n_sockets > n_sockets)
        raw.setblocking(False)

        frames = 1000 * (bytes([0x81, 0x80 | len(text)]) + bytes(4) + text)
        left = memoryview(frames)

        def is_given_up():
            nonlocal left
            with suppress(OSError):  # nobody takes it any more
                while True:
                    left = left[raw.send(left) :] or memoryview(frames)
            return studio.shared.n_sockets == n_sockets

        sampled(lambda: 0, until=is_given_up)
    assert page.state()


def narrow_socket(studio):
    """A connection that takes little before it is read."""
    raw = socket.create_connection(("127.0.0.1", studio.port))
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SMALL)
    return raw


def sampled(value, until):
    """The largest of a value that is looked at again and again until something is so."""
    largest, end = value(), time.monotonic() + PATIENCE
    while not until():
        assert time.monotonic() < end
        time.sleep(0.002)
        largest = max(largest, value())
    return largest


def sequence_of(frame):
    return int.from_bytes(frame[4:8], "little")


def test_work_that_takes_too_long_is_ended_and_the_next_goes_on():
    async def work(seconds, endless, arguments, message):
        workers = Workers(seconds=seconds, warms_up=False)
        workers.start()
        try:
            with pytest.raises(InputError, match=message):
                await workers.run(endless, *arguments)
            assert await workers.run(abs, -1) == 1
        finally:
            workers.stop()

    asyncio.run(work(1.0, time.sleep, (60,), "more than 1 s"))
    asyncio.run(work(PATIENCE, os._exit, (3,), "a process that ended"))


def test_connecting_without_end_makes_no_session_each():
    """Those that were left are forgotten, the longest left first."""

    async def come_and_go():
        sessions = Sessions(lambda name: Room(Session(name), Workers()))
        first, _ = sessions.enter(None)
        for _ in range(3 * MOST_SESSIONS):
            sessions.leave(sessions.enter(None)[0])
        assert len(sessions) <= MOST_SESSIONS
        assert sessions.find(first.session.name) is first  # its page is still there

    asyncio.run(come_and_go())
