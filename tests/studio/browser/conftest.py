"""A real server, by its command, and a real Chromium; without one these tests are skipped, saying what to type."""

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from studio_browser import Studio, new_page

CHROMIUMS = ("chromium", "chromium-browser", "google-chrome")
INSTALL = "sudo apt-get install chromium, or playwright install chromium, or set PROBDMP_CHROMIUM to the path of one"


class Server:
    """`probdmp studio` as a process of its own, which can be ended and started again at the same port."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.port = 0
        self.start()

    def start(self) -> None:
        command = [sys.executable, "-m", "probdmp", "studio", "--port", str(self.port), "--no-browser"]
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}
        self.process = subprocess.Popen(
            command, cwd=self.folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        assert self.process.stdout is not None
        said = ""
        for line in self.process.stdout:
            said += line
            found = re.search(r"http://127\.0\.0\.1:(\d+)\S*", line)
            if found:
                self.url, self.port = found[0].rstrip("."), int(found[1])
                return
        raise AssertionError(f"the server said no address:\n{said}")

    def stop(self) -> None:
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    pytest.importorskip("starlette", reason="needs the studio: pip install 'probdmp[studio]'")
    api = pytest.importorskip("playwright.sync_api", reason="needs playwright: pip install 'probdmp[test]'")
    with api.sync_playwright() as playwright:
        own = playwright.chromium.executable_path
        known = [os.environ.get("PROBDMP_CHROMIUM"), *map(shutil.which, CHROMIUMS), own if Path(own).exists() else None]
        found = next(filter(None, known), None)
        if found is None:
            pytest.skip(f"needs Chromium: {INSTALL}")
        opened = playwright.chromium.launch(executable_path=found, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture(scope="session")
def server(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One for all tests that leave it running."""
    started = Server(tmp_path_factory.mktemp("studio"))
    yield started
    started.stop()


@pytest.fixture
def own_server(browser: Any, tmp_path: Path) -> Iterator[Server]:
    """One to be ended and started by the test."""
    started = Server(tmp_path)
    yield started
    if started.process.poll() is None:
        started.stop()


@pytest.fixture
def open_studio(browser: Any) -> Iterator[Callable[..., Studio]]:
    """Opens the page in a context of its own. In the end, nothing may have gone wrong in any of them."""
    opened: list[Studio] = []

    def open_page(server: Server, **context: Any) -> Studio:
        studio = new_page(browser, **context)
        opened.append(studio)
        studio.open(server.url)
        return studio

    yield open_page
    complaints = [complaint for studio in opened for complaint in studio.complaints]
    for studio in opened:
        studio.page.context.close()
    assert not complaints


@pytest.fixture(scope="session")
def kept(browser: Any, server: Server) -> Iterator[Studio]:
    """A page that many tests open anew, for starting one takes a second."""
    studio = new_page(browser)
    studio.open(server.url)
    yield studio
    studio.page.context.close()


@pytest.fixture
def studio(kept: Studio, server: Server) -> Iterator[Studio]:
    """The page of a new session, in which nothing may go wrong."""
    kept.forget()
    kept.open(server.url)
    yield kept
    assert not kept.complaints
