"""`probdmp studio`: where it listens, what it opens, how it ends."""

import json
import re
import signal
import subprocess
import sys
import urllib.request

import pytest

from probdmp.cli.program import VERBS
from probdmp.errors import MissingExtraError
from probdmp.studio import StudioOptions, serve


@pytest.mark.parametrize("interruptions", [1, 2])
def test_it_says_where_it_is_and_ends_quietly(interruptions):
    command = [sys.executable, "-m", "probdmp", "studio", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        line = process.stdout.readline()
        address = re.search(r"http://127\.0\.0\.1:\d+/", line).group()
        assert b'"ok":true' in urllib.request.urlopen(f"{address}health").read()
        for _ in range(interruptions):
            process.send_signal(signal.SIGINT)
        _, stderr = process.communicate(timeout=60)
    assert (process.returncode, stderr) == (0, "")


def test_where_others_can_connect_a_token_is_made():
    command = [sys.executable, "-m", "probdmp", "studio", "--no-browser", "--json", "--host", "0.0.0.0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        line = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    assert re.search(r"\?token=[\w-]{20,}$", json.loads(line)["address"])


def test_without_its_extra_it_says_what_to_type(run, monkeypatch):
    monkeypatch.setattr("probdmp.studio.server.find_spec", lambda name: None)
    result = run("studio", "--no-browser")
    assert result.exit_code == 1
    assert "pip install 'probdmp[studio]'" in result.stderr
    with pytest.raises(MissingExtraError):
        serve(StudioOptions())


def test_files_that_cannot_be_read_are_said_at_once(run, tmp_path):
    (tmp_path / "x.npz").write_bytes(b"nothing")
    result = run("studio", "--no-browser", tmp_path / "x.npz")
    assert result.exit_code == 3
    assert "x.npz" in result.stderr
    assert run("studio", "--no-browser", "--port", 70000).exit_code == 2


def test_a_port_that_is_taken_is_said(run):
    import socket

    with socket.create_server(("127.0.0.1", 0)) as taken:
        result = run("studio", "--no-browser", "--port", taken.getsockname()[1])
    assert result.exit_code == 1
    assert "in use" in result.stderr


def test_it_is_a_verb():
    assert "studio" in {verb.__name__ for verb in VERBS}
