"""Files, replays, several people at once, and a server that goes away."""

import base64
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from studio_browser import Studio

from probdmp import (
    FailureDetector,
    PrimitiveLibrary,
    ProbabilisticDMP,
    read_demonstrations,
    synthetic_letters,
    write_demonstrations,
)


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
    studio.says("#toast", r"letters\.npz was opened as demonstrations: b \(4\), c \(4\)")
    studio.lists("#labels .name", "b", "c")
    studio.hides("#dropzone")
    studio.lists(".count", "4 strokes, learned", "4 strokes, learned")


def test_a_file_that_is_not_understood_says_so(studio: Studio, tmp_path: Path) -> None:
    (tmp_path / "letters.npz").write_bytes(b"not a file of any kind")
    with studio.page.expect_response("**/upload/**"):
        drop(studio, tmp_path / "letters.npz")
    studio.says("#toast", "Expected")
    studio.complaints[:] = [text for text in studio.complaints if "Failed to load resource" not in text]  # the 4xx itself


@pytest.fixture(scope="module")
def in_millimetres(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings of a robot, far from the canvas, and a model of them beside."""
    path = tmp_path_factory.mktemp("robot") / "robot.npz"
    letters = synthetic_letters(4, letters="c", dt=0.01)
    around = [replace(d, positions=20 * d.positions + np.array([400.0, -150.0]), units="mm") for d in letters]
    write_demonstrations(path, around)
    learned = ProbabilisticDMP(n_basis=15).fit(around)
    PrimitiveLibrary({"c": learned}).save(path.with_suffix(".probdmp"), FailureDetector().fit({"c": learned}, {"c": around}))
    return path


def save(studio: Studio, name: str, folder: Path) -> Path:
    studio.page.click("#open-files")
    with studio.page.expect_download() as saved:
        studio.page.get_by_role("link", name=name, exact=True).click()
    studio.page.keyboard.press("Escape")
    saved.value.save_as(folder / name)
    return folder / name


def test_millimetres_are_shown_on_the_canvas_and_saved_as_they_were(
    studio: Studio, in_millimetres: Path, tmp_path: Path
) -> None:
    """Strokes drawn to them are in millimetres, too, and so are those that are taken back."""
    drop(studio, in_millimetres)
    studio.says(
        "#toast",
        r"robot\.npz was opened as demonstrations: c \(4\)\. Shown .* kept and saved in its own",
    )
    studio.says("#charts figcaption", r"^Position x \[mm\]")
    studio.draw()
    studio.counts("#strokes li", 5)
    studio.page.get_by_role("button", name="Delete stroke 1 of c").click()
    studio.counts("#strokes li", 4)
    studio.page.get_by_role("button", name="Undo").click()
    studio.lists(".count", "5 strokes, learned")
    before, after = read_demonstrations(in_millimetres), read_demonstrations(save(studio, "demonstrations.npz", tmp_path))
    assert {d.units for d in after} == {"mm"}
    np.testing.assert_allclose(after[0].positions, before[1].positions, rtol=1e-12)
    np.testing.assert_allclose(after[4].positions, before[0].positions, rtol=1e-4)
    around = np.concatenate([d.positions for d in before])
    assert np.linalg.norm(after[3].positions.mean(axis=0) - around.mean(axis=0)) < np.ptp(around, axis=0).max()


def test_an_opened_model_is_ready_to_be_played_and_held(studio: Studio, in_millimetres: Path) -> None:
    page = studio.page
    drop(studio, in_millimetres.with_suffix(".probdmp"))
    studio.says("#toast", r"robot\.probdmp was opened: c \(learned\)")
    studio.lists("#hint", "It knows the movement. Press Play.")
    studio.lists(".count", "learned from a file")
    studio.says("#charts figcaption", r"^Position x \[mm\]")
    studio.shows("#teach-play:enabled")
    studio.says("#calibration-text", "Calibrated on 4 ")
    studio.play("#teach-play", 0.2, at=(350.0, 250.0))
    page.mouse.down()
    assert "Something is wrong" in studio.wait_for_verdict("failed")["text"]
    page.mouse.up()
    page.click("#play")
    start = page.get_by_role("button", name="Start at")
    box, board = start.bounding_box(), page.locator("#board").bounding_box()
    assert board["x"] < box["x"] < board["x"] + board["width"]
    assert board["y"] < box["y"] < board["y"] + board["height"]


def test_a_download_that_fails_says_so(studio: Studio) -> None:
    studio.page.click("#open-files")
    studio.page.get_by_role("link", name="model.probdmp").click()
    studio.says("#toast", "Expected a movement that was learned, got none")
    studio.complaints[:] = [text for text in studio.complaints if "Failed to load resource" not in text]  # the 409 itself


def test_pictures_that_nothing_draws_are_no_links(studio: Studio) -> None:
    """As the server says it where matplotlib is not installed."""
    hint = "Type: pip install 'probdmp[plot]'"
    studio.use_example()
    studio.page.evaluate("text => studio.on('state', (state) => (state.pictures_missing = text))", hint)
    studio.page.click("#add-example button")
    studio.lists(".count", "20 strokes, learned")
    studio.page.click("#open-files")
    studio.counts("#downloads a[href]", 4)
    studio.lists("#downloads a[aria-disabled]", "picture.svg", "picture.png")
    studio.says("#downloads", "pip install")


def test_what_a_drop_has_taught_is_taken_back(studio: Studio, letters: Path) -> None:
    for count in (4, 8):
        drop(studio, letters)
        studio.lists(".count", *[f"{count} strokes, learned"] * 2)
    studio.page.get_by_role("button", name="Undo").click()
    studio.lists(".count", *["4 strokes, learned"] * 2)


def test_an_execution_that_is_dropped_is_the_one_to_replay(studio: Studio, letters: Path) -> None:
    studio.use_example()
    studio.mode("Replay")
    studio.page.select_option("#recording", index=2)
    drop(studio, letters)
    studio.says("#toast", r"was opened as executions to replay: b \(4\), c \(4\)")
    chosen = "document.getElementById('recording').selectedOptions[0].textContent"
    studio.becomes(chosen, "execution 1: b")
    drop(studio, letters)
    studio.becomes(chosen, "execution 9: b")


def test_a_recording_is_replayed_and_scrubbed(studio: Studio) -> None:
    page = studio.page
    studio.use_example()
    studio.mode("Replay")
    page.click("#replay")
    studio.shows("#scrub:enabled")
    studio.says("#scrub-text", r"^1\.\d\d s")
    page.focus("#scrub")
    page.keyboard.press("Home")
    studio.says("#scrub-text", r"^0\.00 s")
    studio.counts("#charts .uplot", 3)
    page.click("#compare")
    studio.shows("#legend")


def test_executions_are_opened_to_be_replayed(studio: Studio, tmp_path: Path) -> None:
    page = studio.page
    studio.use_example()
    with page.expect_download() as saved:
        page.click("#open-files")
        page.get_by_role("link", name="demonstrations.npz").click()
    path = tmp_path / "executions.npz"
    saved.value.save_as(path)
    page.set_input_files("#file-execution", path)
    studio.counts("#recording option", 20)
    studio.mode("Replay")
    page.click("#replay")
    studio.shows("#scrub:enabled")


def test_what_is_saved_is_what_was_drawn(studio: Studio, tmp_path: Path) -> None:
    studio.teach(strokes=2)
    studio.page.click("#open-files")
    studio.counts("#downloads a", 6)
    names = studio.page.locator("#downloads a").all_inner_texts()
    assert {"model.probdmp", "demonstrations.csv", "picture.svg", "picture.png", "session.zip"} < set(names)
    for name in names:
        with studio.page.expect_download() as saved:
            studio.page.get_by_role("link", name=name, exact=True).click()
        saved.value.save_as(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 100
    assert [d.label for d in read_demonstrations(tmp_path / "demonstrations.npz")] == ["a", "a"]


def test_two_people_do_not_see_each_other(studio: Studio, open_studio: Callable[..., Studio], server: Any) -> None:
    one, other = studio, open_studio(server)
    one.teach("mine", 1)
    other.teach("yours", 1)
    one.lists("#labels .name", "mine")
    other.lists("#labels .name", "yours")


def test_a_page_that_is_loaded_again_is_the_same_session(studio: Studio) -> None:
    studio.teach(strokes=2)
    studio.page.reload()
    studio.counts("#strokes li", 2)
    studio.shows("#teach-play:enabled")


def test_a_session_that_is_opened_twice_stays_with_the_newer_page(
    studio: Studio, open_studio: Callable[..., Studio], server: Any
) -> None:
    studio.teach(strokes=1)
    newer = open_studio(server)
    newer.page.evaluate(
        "id => sessionStorage.setItem('session', id)", studio.page.evaluate("sessionStorage.getItem('session')")
    )
    newer.open(server.url)
    newer.lists(".count", "1 stroke, learned")
    studio.says("#banner", "open in another tab")
    studio.page.click("#banner button")
    newer.says("#banner", "open in another tab")
    studio.hides("#banner")


def test_a_server_that_was_started_again_is_taught_again(open_studio: Callable[..., Studio], own_server: Any) -> None:
    studio = open_studio(own_server)
    for k in range(3):
        studio.draw(shift=k - 1)
        studio.counts("#strokes li", k + 1)
    own_server.stop()
    studio.says("#banner", "The connection to the server is lost")
    studio.page.click("#banner button")  # while it is away: later the page may come back by itself before the click
    own_server.start()
    studio.says("#toast", "your 3 strokes were taught to it again")
    studio.hides("#banner")
    studio.lists(".count", "3 strokes, learned")
    studio.complaints[:] = [text for text in studio.complaints if "WebSocket connection" not in text]  # while it was away


def test_commands_are_shown(studio: Studio) -> None:
    studio.use_example()
    studio.page.click("#open-commands")
    studio.says("#commands-shell", "probdmp fit")
    code = studio.page.inner_text("#commands-python")
    compile(code, "session.py", "exec")
    assert "ProbabilisticDMP(" in code
