"""Replacing files: whatever happens in between, the old or the new one is there."""

import os
import signal
import stat
import subprocess
import sys
import time

import numpy as np
import pytest

from probdmp.errors import InputError
from probdmp.io import ModelContents, encode_model, read_model
from probdmp.io.atomic import write_atomically

SAVE_UNTIL_KILLED = """
import os, sys
from pathlib import Path
from probdmp.io.atomic import write_atomically

target, *sources = map(Path, sys.argv[1:])
payloads = [source.read_bytes() for source in sources]
for line in sys.stdin:
    saving = os.fork()
    if not saving:
        print(os.getpid(), flush=True)
        while True:
            for payload in payloads:
                write_atomically(target, payload)
    print(os.waitstatus_to_exitcode(os.waitpid(saving, 0)[1]), flush=True)
"""


def test_writes_and_replaces(tmp_path):
    for payload in (b"old", b"new", b""):
        write_atomically(tmp_path / "file", payload)
        assert (tmp_path / "file").read_bytes() == payload
        assert os.listdir(tmp_path) == ["file"]


def test_a_new_file_obeys_the_umask_and_a_replaced_one_keeps_its_mode(tmp_path):
    (tmp_path / "usual").touch()
    write_atomically(tmp_path / "file", b"old")
    assert (tmp_path / "file").stat().st_mode == (tmp_path / "usual").stat().st_mode
    (tmp_path / "file").chmod(0o640)
    write_atomically(tmp_path / "file", b"new")
    assert stat.S_IMODE((tmp_path / "file").stat().st_mode) == 0o640


def test_a_relative_name_is_enough(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_atomically("file", b"new")
    assert (tmp_path / "file").read_bytes() == b"new"


def test_a_link_is_replaced_and_its_target_left_alone(tmp_path):
    (tmp_path / "target").write_bytes(b"old")
    (tmp_path / "link").symlink_to(tmp_path / "target")
    write_atomically(tmp_path / "link", b"new")
    assert (tmp_path / "target").read_bytes() == b"old"
    assert (tmp_path / "link").read_bytes() == b"new"


@pytest.mark.parametrize("step", ["replace", "fsync", "fchmod"])
def test_failure_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, step):
    write_atomically(tmp_path / "file", b"old")

    def refuse(*arguments):
        raise OSError("no space left on device")

    monkeypatch.setattr(os, step, refuse)
    with pytest.raises(OSError, match="no space"):
        write_atomically(tmp_path / "file", b"new")
    assert (tmp_path / "file").read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["file"]


def test_what_is_not_a_file_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for name in ("pipe", "."):
        with pytest.raises(InputError, match=r"which is not a regular file\. Choose another name"):
            write_atomically(tmp_path / name, b"new")
    assert os.listdir(tmp_path) == ["pipe"]
    with pytest.raises(FileNotFoundError):
        write_atomically(tmp_path / "no such folder" / "file", b"new")


def assert_survives_kills(n_kills, make_primitive, folder):
    rng = np.random.default_rng(n_kills)
    models = [ModelContents({"a": make_primitive(rng, 7, 60)}, {}) for _ in range(2)]
    payloads = [encode_model(model) for model in models]
    sources = [folder / "one", folder / "two"]
    for source, payload in zip(sources, payloads, strict=True):
        source.write_bytes(payload)
    target = folder / "m.probdmp"
    write_atomically(target, payloads[0])
    command, pipe = [sys.executable, "-c", SAVE_UNTIL_KILLED, target, *sources], subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, bufsize=1) as process:
        for delay in rng.uniform(0, 0.03, n_kills):
            process.stdin.write("again\n")
            saving = int(process.stdout.readline())
            time.sleep(delay)
            os.kill(saving, signal.SIGKILL)
            assert int(process.stdout.readline()) == -signal.SIGKILL
            assert target.read_bytes() in payloads
            read_model(target)


def test_killed_while_saving(make_primitive, tmp_path):
    assert_survives_kills(20, make_primitive, tmp_path)


@pytest.mark.slow
def test_killed_two_hundred_times_while_saving(make_primitive, tmp_path):
    assert_survives_kills(200, make_primitive, tmp_path)
