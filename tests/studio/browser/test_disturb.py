"""Play, hold, push; the verdict comes, and says what and when."""

import numpy as np
import pytest
from studio_browser import Studio, line

from probdmp.checks import FloatArray

AWAY = 0.6
"""Units, six standard deviations of what a pen that is held still reads."""
LATENCY = 0.25
"""Of the duration, from a hold to its alarm: the 95th percentile on real handwriting is 0.242 or less (docs/monitoring.md)."""


MIDDLE, CORNER = (350.0, 250.0), (80.0, 80.0)
"""Of the canvas, pixels."""
KEEP_FRAMES = "window.seen = []; studio.on('frame', (frame) => seen.push([frame.time, ...frame.measured]))"


def held_since(frames: FloatArray) -> float:
    """The last time, seconds, at which a pen was seen elsewhere than where it is held in the end, from rows (time, x, y)."""
    away = np.linalg.norm(frames[:, 1:] - np.median(frames[-3:, 1:], axis=0), axis=1) > AWAY
    return float(frames[away, 0][-1])


def test_a_held_pen_is_noticed_in_time(studio: Studio) -> None:
    """From the tick at which the server has it held: messages of a busy machine take their time, the movement does not."""
    studio.use_example()
    page = studio.page
    page.evaluate(KEEP_FRAMES)
    studio.play("#teach-play", 0.2, at=MIDDLE)
    page.mouse.down()
    verdict = studio.wait_for_verdict("failed")
    studio.until(f"seen.at(-1)[0] > {float(verdict['time']) + 0.03}")
    frames = np.array(page.evaluate("seen"))
    studio.lists("#hint", "It noticed. Let go.")
    page.mouse.up()
    studio.lists("#hint", "It noticed. Let it arrive, or stop it.")
    held, noticed = held_since(frames), float(verdict["time"])
    assert 0 < held < noticed
    assert noticed - held <= LATENCY * float(page.input_value("#duration")), (held, verdict)
    assert "Something is wrong" in verdict["text"]
    assert "Since" in verdict["text"]
    page.click("#play")  # which stops it
    studio.lists("#hint", "It noticed. Drag the start or the goal, and play again.")


def test_a_pen_that_is_pulled_away_is_noticed(studio: Studio) -> None:
    studio.use_example()
    studio.mode("Play")
    studio.page.select_option("#pointer-mode", "push")
    studio.play("#play", 0.1, at=CORNER)
    studio.page.mouse.down()
    assert "off the path" in studio.wait_for_verdict("failed")["text"]
    studio.page.mouse.up()


def test_undisturbed_it_is_as_taught(studio: Studio) -> None:
    studio.use_example()
    studio.mode("Play")
    studio.page.select_option("#speed", "2")
    studio.page.click("#play")
    assert "As taught" in studio.wait_for_verdict("fine")["text"]
    studio.counts("#charts .uplot", 3)


@pytest.mark.parametrize("fault", ["hold", "push"])
def test_a_fault_is_noticed(studio: Studio, fault: str) -> None:
    studio.use_example()
    studio.mode("Play")
    names = [name for name in studio.page.locator("#fault option").all_inner_texts() if name.startswith(fault)]
    studio.page.select_option("#fault", label=names[0])
    studio.page.select_option("#speed", "2")
    studio.page.click("#play")
    verdict = studio.wait_for_verdict("failed")
    assert 0.4 < float(verdict["share"]) <= 0.4 + LATENCY


def test_by_keyboard_alone_to_a_verdict(studio: Studio) -> None:
    """From the top of the page: example, play, hold, verdict."""
    press, page = studio.page.keyboard.press, studio.page

    def tab_to(selector: str) -> None:
        for _ in range(80):
            if page.evaluate("selector => document.activeElement?.matches(selector) ?? false", selector):
                return
            press("Tab")
        raise AssertionError(f"{selector} is not reached by Tab")

    tab_to("#try-example")
    press("Enter")
    studio.shows("#teach-play:enabled")
    studio.says("#calibration-text", "Calibrated")
    tab_to("#teach-play")
    press("Enter")
    studio.until("studio.lastFrame()?.time > 0.1")
    tab_to("#hold")
    press("Space")
    studio.shows("#hold[aria-pressed=true]")
    assert "Something is wrong" in studio.wait_for_verdict("failed")["text"]


def test_start_and_goal_are_moved_by_pointer_and_by_keyboard(studio: Studio) -> None:
    page = studio.page
    studio.use_example()
    studio.mode("Play")
    goal = page.get_by_role("button", name="Goal at")
    box = goal.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + 60, box["y"] - 80, steps=6)
    page.mouse.up()
    studio.until(f"document.querySelector('[data-key=goal]').getBoundingClientRect().x > {box['x'] + 30}")
    start = page.get_by_role("button", name="Start at")
    before = start.get_attribute("aria-label")
    start.focus()
    page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press("ArrowRight")
    studio.until(f"document.querySelector('[data-key=start]').getAttribute('aria-label') !== '{before}'")
    page.click("#open-commands")
    studio.says("#commands-shell", "--goal")


def test_a_via_point_is_added_timed_and_removed(studio: Studio) -> None:
    page = studio.page
    studio.use_example()
    studio.mode("Play")
    page.click("#add-via")
    studio.counts("[data-key=via-0]", 1)
    for _ in range(3):
        page.keyboard.press("Shift+ArrowUp")
    page.get_by_label("When it passes via-point 1").focus()
    page.keyboard.press("ArrowRight")
    studio.lists(".via output", "52 %")
    page.click("#open-commands")
    studio.says("#commands-shell", "The command line has no via-points")
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Remove via-point 1").click()
    studio.counts("[data-key=via-0]", 0)


def test_what_is_traced_is_recognised(studio: Studio) -> None:
    studio.teach("loop", 3)
    studio.teach("line", 3, line)
    studio.says("#calibration-text", "Calibrated on 6 ")  # together: fewer vouch for too little
    studio.mode("Trace")
    studio.draw(line)
    studio.says("#scores", "Looks like line")
    studio.counts("#scores li", 2)
    studio.wait_for_verdict("fine")
    studio.counts("#charts .uplot", 3)
    studio.until("studio.tallied().frames > 1")
    studio.page.select_option("#trace-label", "loop")
    studio.draw(line)
    studio.wait_for_verdict("failed")
