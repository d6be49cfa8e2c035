"""What a person does on the page of the studio, and sees there."""

import math
import time
from typing import Any

LONG = 20_000
"""Milliseconds that anything may take on a busy machine."""


def loop(step: float, shift: float = 0.0) -> tuple[float, float]:
    """A point of a letter-like curve, in shares of the canvas, at a share of its way; `shift` makes strokes differ."""
    angle = 2.2 * math.pi * step
    return 0.35 + 0.3 * step + 0.14 * math.sin(angle) + 0.02 * shift, 0.5 + 0.22 * math.cos(angle) - 0.015 * shift


def line(step: float, shift: float = 0.0) -> tuple[float, float]:
    """Another letter: hardly more than a line."""
    return 0.2 + 0.6 * step, 0.3 + 0.4 * step + 0.02 * math.sin(7 * step + shift)


class Studio:
    """A page of the studio, open; `complaints` gathers errors of the console and of the page."""

    def __init__(self, page: Any, url: str) -> None:
        self.page = page
        self.complaints: list[str] = []
        page.on(
            "console", lambda message: self.complaints.append(message.text) if message.type in ("error", "warning") else None
        )
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.set_default_timeout(LONG)
        page.goto(url)
        page.wait_for_selector("body[data-connected=yes]")

    def until(self, condition: str) -> None:
        """Waits for a condition in JavaScript. Playwright's own waiting needs eval, which the page forbids."""
        end = time.monotonic() + LONG / 1000
        while not self.page.evaluate(condition):
            assert time.monotonic() < end, f"not so within {LONG / 1000:g} s: {condition}"
            self.page.wait_for_timeout(15)

    def draw(self, shape: Any = loop, shift: float = 0.0, samples: int = 32) -> None:
        """A stroke on the canvas, by the mouse."""
        box = self.page.locator("#ink").bounding_box()
        places = [shape(k / (samples - 1), shift) for k in range(samples)]
        pixels = [(box["x"] + x * box["width"], box["y"] + y * box["height"]) for x, y in places]
        self.page.mouse.move(*pixels[0])
        self.page.mouse.down()
        for x, y in pixels[1:]:
            self.page.mouse.move(x, y)
            self.page.wait_for_timeout(8)
        self.page.mouse.up()

    def teach(self, name: str | None = None, strokes: int = 3, shape: Any = loop) -> None:
        """Some strokes of a letter, until they are learned."""
        if name is not None:
            self.page.fill("#new-label", name)
            self.page.click("#add-label button")
            self.page.wait_for_selector(f'.label[aria-pressed=true] .name:text-is("{name}")')
        for k in range(strokes):
            self.draw(shape, shift=k - 1)
            self.until(f"document.querySelectorAll('#strokes li').length === {k + 1}")
        self.page.wait_for_selector(f'.label[aria-pressed=true] .count:text-is("{strokes} strokes, learned")')

    def use_example(self) -> None:
        """Ten demonstrations by one click, and their detector."""
        self.page.click("#try-example")
        self.page.wait_for_selector("#teach-play:enabled")
        self.until("document.getElementById('calibration-text').textContent.startsWith('Calibrated')")

    def mode(self, name: str) -> None:
        """Teach, Play, Trace or Replay."""
        self.page.locator("#modes").get_by_text(name, exact=True).click()

    def verdict(self) -> dict[str, Any]:
        """The card: its kind, its text, and where it says so, when."""
        card = self.page.locator("#verdict")
        data = card.evaluate("card => ({...card.dataset})")
        return {"kind": data["kind"], "text": card.inner_text(), "time": data.get("time"), "share": data.get("share")}

    def wait_for_verdict(self, kind: str) -> dict[str, Any]:
        """The card, as soon as it is of this kind."""
        self.page.wait_for_selector(f"#verdict[data-kind={kind}]")
        return self.verdict()
