"""What a person does on the page of the studio, and sees there."""

import math
import re
import time
from collections.abc import Callable
from functools import cached_property
from typing import Any

LONG = 60.0
"""Seconds that anything may take on a busy machine."""
PACE = 0.02
"""Seconds between samples of a stroke."""
VISIBLE_TEXTS = """selector => [...document.querySelectorAll(selector)]
  .filter((one) => one.checkVisibility()).map((one) => one.textContent)"""
CARD = "(({ dataset, innerText }) => ({ ...dataset, text: innerText }))(document.getElementById('verdict'))"


def loop(step: float, shift: float = 0.0) -> tuple[float, float]:
    """A point of a letter-like curve, in shares of the canvas, at a share of its way; `shift` makes strokes differ."""
    angle = 2.2 * math.pi * step
    return 0.35 + 0.3 * step + 0.14 * math.sin(angle) + 0.02 * shift, 0.5 + 0.22 * math.cos(angle) - 0.015 * shift


def line(step: float, shift: float = 0.0) -> tuple[float, float]:
    """Another letter: hardly more than a line."""
    return 0.2 + 0.6 * step, 0.3 + 0.4 * step + 0.02 * math.sin(7 * step + shift)


class Studio:
    """A page of the studio, open; `complaints` gathers errors of the console and of the page."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.complaints: list[str] = []
        page.on(
            "console", lambda message: self.complaints.append(message.text) if message.type in ("error", "warning") else None
        )
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.set_default_timeout(1000 * LONG)

    def open(self, url: str) -> None:
        """The page of the session that it was, or of a new one."""
        self.page.goto(url, wait_until="commit")
        self.shows("body[data-connected=yes]")

    def forget(self) -> None:
        """Leave the session, so that the page opens with a new one; what arrives until then shall not remember it."""
        self.page.evaluate("Storage.prototype.setItem = () => {}; sessionStorage.clear()")
        self.complaints.clear()

    def wait(self, read: Callable[[], Any], is_right: Callable[[Any], bool], wanted: str) -> Any:
        """What is read, once it is right. Playwright itself asks twice a second, or needs eval, which the page forbids."""
        end = time.monotonic() + LONG
        while not is_right(found := read()):
            assert time.monotonic() < end, f"after {LONG:g} s not {wanted}, but {found!r:.500}"
            self.page.wait_for_timeout(15)
        return found

    def becomes(self, script: str, wanted: Any) -> None:
        """Waits until JavaScript gives a value."""
        self.wait(lambda: self.page.evaluate(script), lambda found: found == wanted, f"{wanted!r} = {script}")

    def until(self, condition: str) -> None:
        """Waits for a condition in JavaScript."""
        self.becomes(f"Boolean({condition})", True)

    def texts(self, selector: str) -> list[str]:
        """Of all that can be seen there."""
        return list(self.page.evaluate(VISIBLE_TEXTS, selector))

    def says(self, selector: str, pattern: str) -> None:
        """Waits until something that can be seen there contains a text, or matches a pattern."""
        self.wait(lambda: self.texts(selector), lambda found: any(re.search(pattern, one) for one in found), pattern)

    def lists(self, selector: str, *wanted: str) -> None:
        """Waits until these texts can be seen there, in this order."""
        self.wait(lambda: self.texts(selector), lambda found: found == list(wanted), f"{wanted}")

    def shows(self, selector: str) -> None:
        """Waits until something can be seen there."""
        self.wait(lambda: self.texts(selector), bool, selector)

    def hides(self, selector: str) -> None:
        """Waits until nothing can be seen there."""
        self.lists(selector)

    def counts(self, selector: str, wanted: int) -> None:
        """Waits until there are so many."""
        self.becomes(f"document.querySelectorAll('{selector}').length", wanted)

    def draw(self, shape: Any = loop, shift: float = 0.0, samples: int = 24) -> None:
        """A stroke on the canvas, by the mouse. Its events bear the times of an even pace, however busy the machine is."""
        box = self.page.locator("#ink").bounding_box()
        places = [shape(k / (samples - 1), shift) for k in range(samples)]
        pixels = [(box["x"] + x * box["width"], box["y"] + y * box["height"]) for x, y in places]
        begin = time.time() - PACE * samples
        for k, (x, y) in enumerate(pixels):
            self._mouse("mouseMoved" if k else "mousePressed", x, y, begin + PACE * k)
        self._mouse("mouseReleased", *pixels[-1], begin + PACE * samples)

    def _mouse(self, kind: str, x: float, y: float, seconds: float) -> None:
        held = {"button": "left", "buttons": int(kind != "mouseReleased"), "clickCount": 1}
        self.devtools.send("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, "timestamp": seconds, **held})

    @cached_property
    def devtools(self) -> Any:
        """Chromium's own protocol, which can say when something is to have happened."""
        return self.page.context.new_cdp_session(self.page)

    def teach(self, name: str | None = None, strokes: int = 3, shape: Any = loop) -> None:
        """Some strokes of a letter, until they are learned."""
        if name is not None:
            self.page.fill("#new-label", name)
            self.page.click("#add-label button")
            self.lists(".label[aria-pressed=true] .name", name)
        for k in range(strokes):
            self.draw(shape, shift=k - 1)
            self.counts("#strokes li", k + 1)
        self.lists(".label[aria-pressed=true] .count", f"{strokes} stroke{'s' if strokes > 1 else ''}, learned")

    def use_example(self) -> None:
        """Ten demonstrations by one click, and their detector."""
        self.page.click("#try-example")
        self.shows("#teach-play:enabled")
        self.says("#calibration-text", "Calibrated")

    def mode(self, name: str) -> None:
        """Teach, Play, Trace or Replay."""
        self.page.locator("#modes").get_by_text(name, exact=True).click()
        self.shows(f"body[data-mode={name.lower()}]")

    def play(self, button: str, since: float, at: tuple[float, float]) -> None:
        """Begin to play by a key, with the mouse at a place of the canvas, until so many seconds of the movement have gone."""
        self.page.locator("#ink").hover(position={"x": at[0], "y": at[1]})
        self.page.press(button, "Enter")
        self.until(f"studio.lastFrame()?.time > {since}")

    def wait_for_verdict(self, kind: str) -> dict[str, Any]:
        """The card, as soon as it is of this kind: its text, and where it says so, when."""
        return dict(self.wait(lambda: self.page.evaluate(CARD), lambda card: card["kind"] == kind, kind))


def new_page(browser: Any, **context: Any) -> Studio:
    """A page in a context of its own."""
    size = {"viewport": {"width": 1440, "height": 900}, "reduced_motion": "reduce"}
    return Studio(browser.new_context(**(size | context)).new_page())
