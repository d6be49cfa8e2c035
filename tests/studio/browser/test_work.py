"""Files, replays, several people at once, and a server that goes away."""

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from studio_browser import Studio

from probdmp import read_demonstrations, synthetic_letters, write_demonstrations


def drop(studio: Studio, path: Path) -> None:
    """As if the file were dragged onto the page from elsewhere."""
    held = studio.page.evaluate_handle(
        """([text, name]) => {
          const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
          const data = new DataTransfer();
          data.items.add(new File([bytes], name));
          return data;
        }""",
        [base64.b64encode(path.read_bytes()).decode(), path.name],
    )
    for event in ("dragenter", "dragover", "drop"):
        studio.page.dispatch_event("body", event, {"dataTransfer": held})


@pytest.fixture(scope="module")
def letters(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("files") / "letters.npz"
    write_demonstrations(path, synthetic_letters(4, letters="bc"))
    return path


def test_a_file_that_is_dropped_is_learned(studio: Studio, letters: Path) -> None:
    drop(studio, letters)
    studio.until("document.querySelectorAll('#labels .name').length === 2")
    assert studio.page.locator("#labels .name").all_inner_texts() == ["b", "c"]
    assert "letters.npz was opened: b (4), c (4)" in studio.page.inner_text("#toast")
    assert studio.page.is_hidden("#dropzone")
    studio.until("[...document.querySelectorAll('.count')].every((one) => one.textContent.includes('learned'))")


def test_a_file_that_is_not_understood_says_so(studio: Studio, tmp_path: Path) -> None:
    (tmp_path / "letters.npz").write_bytes(b"not a file of any kind")
    with studio.page.expect_response("**/upload/**"):
        drop(studio, tmp_path / "letters.npz")
    studio.page.wait_for_selector("#toast:not([hidden])")
    assert "Expected" in studio.page.inner_text("#toast")
    studio.complaints[:] = [text for text in studio.complaints if "Failed to load resource" not in text]  # the 4xx itself


def test_a_recording_is_replayed_and_scrubbed(studio: Studio) -> None:
    page = studio.page
    studio.use_example()
    studio.mode("Replay")
    page.click("#replay")
    page.wait_for_selector("#scrub:enabled")
    end = page.inner_text("#scrub-text")
    page.focus("#scrub")
    page.keyboard.press("Home")
    assert page.inner_text("#scrub-text").startswith("0.00 s")
    assert page.inner_text("#scrub-text") != end
    assert page.locator("#charts .uplot").count() == 3
    page.click("#compare")
    page.wait_for_selector("#legend:not([hidden])")


def test_executions_are_opened_to_be_replayed(studio: Studio, tmp_path: Path) -> None:
    page = studio.page
    studio.use_example()
    with page.expect_download() as saved:
        page.click("#open-files")
        page.get_by_role("link", name="demonstrations.npz").click()
    path = tmp_path / "executions.npz"
    saved.value.save_as(path)
    page.set_input_files("#file-execution", path)
    studio.until("document.querySelectorAll('#recording option').length === 20")
    studio.mode("Replay")
    page.click("#replay")
    page.wait_for_selector("#scrub:enabled")


def test_what_is_saved_is_what_was_drawn(studio: Studio, tmp_path: Path) -> None:
    studio.teach(strokes=2)
    studio.page.click("#open-files")
    names = studio.page.locator("#downloads a").all_inner_texts()
    assert {"model.probdmp", "demonstrations.csv", "picture.svg", "picture.png", "session.zip"} < set(names)
    for name in names:
        with studio.page.expect_download() as saved:
            studio.page.get_by_role("link", name=name, exact=True).click()
        saved.value.save_as(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 100
    assert [d.label for d in read_demonstrations(tmp_path / "demonstrations.npz")] == ["a", "a"]


def test_two_people_do_not_see_each_other(open_studio: Callable[..., Studio], server: Any) -> None:
    one, other = open_studio(server), open_studio(server)
    one.teach("mine", 2)
    other.teach("yours", 2)
    assert one.page.locator("#labels .name").all_inner_texts() == ["mine"]
    assert other.page.locator("#labels .name").all_inner_texts() == ["yours"]


def test_a_page_that_is_loaded_again_is_the_same_session(studio: Studio) -> None:
    studio.teach(strokes=2)
    studio.page.reload()
    studio.until("document.querySelectorAll('#strokes li').length === 2")
    studio.page.wait_for_selector("#teach-play:enabled")


def test_a_session_that_is_opened_twice_stays_with_the_newer_page(studio: Studio) -> None:
    studio.teach(strokes=2)
    held = studio.page.evaluate("sessionStorage.getItem('session')")
    newer = studio.page.context.new_page()
    newer.add_init_script(f"sessionStorage.setItem('session', '{held}')")
    newer.goto(studio.page.url)
    newer.wait_for_selector('.count:text-is("2 strokes, learned")')
    studio.page.wait_for_selector("#banner:has-text('open in another tab')")
    studio.page.click("#banner button")
    newer.wait_for_selector("#banner:has-text('open in another tab')")
    assert studio.page.is_hidden("#banner")


def test_a_server_that_was_started_again_is_taught_again(open_studio: Callable[..., Studio], own_server: Any) -> None:
    studio = open_studio(own_server)
    studio.teach(strokes=3)
    own_server.stop()
    studio.page.wait_for_selector("#banner:not([hidden])")
    assert "connection" in studio.page.inner_text("#banner")
    own_server.start()
    studio.page.click("#banner button")
    studio.page.wait_for_selector("#banner", state="hidden")
    studio.page.wait_for_selector('.count:text-is("3 strokes, learned")')
    assert "your 3 strokes were taught to it again" in studio.page.inner_text("#toast")
    studio.complaints[:] = [text for text in studio.complaints if "WebSocket connection" not in text]  # while it was away


def test_commands_are_shown(studio: Studio) -> None:
    studio.use_example()
    studio.page.click("#open-commands")
    studio.until("document.getElementById('commands-shell').textContent.includes('probdmp fit')")
    code = studio.page.inner_text("#commands-python")
    compile(code, "session.py", "exec")
    assert "ProbabilisticDMP(" in code, json.dumps(code)
