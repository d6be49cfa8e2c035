"""How fast the studio is, in a real browser without a screen: `python benchmarks/studio.py`.

Needs `pip install 'probdmp[test]'` and Chromium (PROBDMP_CHROMIUM says where, if it is not called chromium). Prints the time
from the end of a stroke to its band on the screen, for ten demonstrations; then frames per second and frames left out while a
movement plays.
"""

import argparse
import math
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from playwright.sync_api import Browser, Page, sync_playwright

from probdmp.studio import jobs
from probdmp.studio.settings import Settings
from probdmp.studio.strokes import example_strokes

STROKES = 10
SAMPLES = 60
"""Of a stroke, 16 ms apart."""
PATIENCE = 30_000
"""Milliseconds."""


@contextmanager
def server() -> Iterator[str]:
    """The address of a studio of its own."""
    command = [sys.executable, "-m", "probdmp", "studio", "--port", "0", "--no-browser"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"})
    assert process.stdout is not None
    try:
        yield next(found[0] for line in process.stdout if (found := re.search(r"http://127\.0\.0\.1:\d+", line)))
    finally:
        process.terminate()
        process.wait(10)


def until(page: Page, condition: str) -> None:
    """Waits for a condition in JavaScript; Playwright's own waiting needs eval, which the page forbids."""
    end = time.monotonic() + PATIENCE / 1000
    while not page.evaluate(condition):
        if time.monotonic() > end:
            raise TimeoutError(condition)
        page.wait_for_timeout(20)


def draw(page: Page, shift: float) -> None:
    """A stroke by the mouse, at the pace of a hand."""
    box = page.locator("#ink").bounding_box()
    assert box is not None
    for k in range(SAMPLES):
        share = k / (SAMPLES - 1)
        x = 0.35 + 0.3 * share + 0.14 * math.sin(2.2 * math.pi * share) + 0.01 * shift
        y = 0.5 + 0.22 * math.cos(2.2 * math.pi * share) - 0.01 * shift
        page.mouse.move(box["x"] + x * box["width"], box["y"] + y * box["height"])
        if k == 0:
            page.mouse.down()
        page.wait_for_timeout(12)
    page.mouse.up()


CALIBRATED = "document.getElementById('calibration-text').textContent.startsWith('Calibrated')"
COUNT_TICKS = "window.ticks = []; (function tick(t) { window.ticks.push(t); requestAnimationFrame(tick); })(performance.now())"


def strokes_to_bands(page: Page, pause: float) -> list[float]:
    """Milliseconds from the end of each stroke to its band on the screen."""
    for k in range(STROKES):
        draw(page, math.sin(3 * k))
        until(page, f"performance.getEntriesByName('stroke-to-band').length === {k + 1}")
        page.wait_for_timeout(1000 * pause)
    return list(page.evaluate("performance.getEntriesByName('stroke-to-band').map((one) => one.duration)"))


def play(page: Page, speed: str) -> dict[str, Any]:
    """Frames that came while a movement was played to its end, and frames that the page drew."""
    page.locator("#modes").get_by_text("Play", exact=True).click()
    page.select_option("#speed", speed)
    page.click("#play")
    page.wait_for_selector("body[data-playing=yes]")
    page.wait_for_selector("body[data-playing=no]")
    tally: dict[str, Any] = page.evaluate("studio.tallied()")
    drawn = page.evaluate("([a, b]) => ticks.filter((t) => t >= a && t <= b)", [tally["first"], tally["last"]])
    seconds = (tally["last"] - tally["first"]) / 1000
    gaps = np.diff(drawn)
    return {
        "received": (tally["frames"] - 1) / seconds,
        "dropped": tally["dropped"],
        "frames": tally["frames"],
        "drawn": len(gaps) / (gaps.sum() / 1000),
        "longest": float(gaps.max()),
    }


def learning_times() -> list[float]:
    """Milliseconds of processor time that learning from one stroke, two, … ten takes."""
    strokes = example_strokes("a")
    jobs.warm_up()
    times = []
    for n in range(1, STROKES + 1):
        before = time.process_time()
        jobs.learn(tuple(strokes[:n]), Settings().parameters)
        times.append(1000 * (time.process_time() - before))
    return times


def take_picture(page: Page, path: str) -> None:
    """Of a movement that is held, and of what is said about it."""
    page.locator("#modes").get_by_text("Play", exact=True).click()
    page.select_option("#speed", "0.25")
    page.click("#play")
    until(page, "studio.lastFrame()?.time > 0.55")
    page.locator("#ink").hover(position={"x": 300, "y": 300})
    page.mouse.down()
    page.wait_for_selector("#verdict[data-kind=failed]")
    page.wait_for_timeout(900)
    page.screenshot(path=path)
    page.mouse.up()


def open_page(browser: Browser, address: str, scale: float = 1.0) -> Page:
    """A new session."""
    page = browser.new_page(viewport={"width": 1360, "height": 860}, device_scale_factor=scale)
    page.set_default_timeout(PATIENCE)
    page.goto(address)
    page.wait_for_selector("body[data-connected=yes]")
    page.wait_for_timeout(3000)  # the server gets its workers ready
    return page


def measure(page: Page, given: argparse.Namespace) -> None:
    """Print how long bands take, and how many frames come."""
    alone = learning_times()
    print(f"learning alone, processor time: {min(alone):.0f} to {max(alone):.0f} ms; load average {os.getloadavg()[0]:.1f}")
    page.evaluate(COUNT_TICKS)
    waits = np.array(strokes_to_bands(page, given.pause))
    print(f"stroke to band, {STROKES} strokes: {' '.join(f'{w:.0f}' for w in waits)} ms")
    print(f"  median {np.median(waits):.0f} ms, p95 {np.quantile(waits, 0.95):.0f} ms, most {waits.max():.0f} ms")
    until(page, CALIBRATED)
    for speed in ("1", "0.25"):
        played = [play(page, speed) for _ in range(given.plays)]
        received, drawn, longest = ([one[name] for one in played] for name in ("received", "drawn", "longest"))
        frames, dropped = (sum(one[name] for one in played) for name in ("frames", "dropped"))
        print(f"speed {speed}: {np.mean(received):.1f} frames a second, {dropped} of {frames + dropped} dropped;")
        print(f"  the page drew {np.mean(drawn):.1f} a second, longest gap {max(longest):.0f} ms")


def main() -> None:
    """Measure and print, or take the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plays", type=int, default=5)
    parser.add_argument("--pause", type=float, default=0.5, help="seconds between a band and the next stroke")
    parser.add_argument("--picture", help="where to write docs/images/studio.png; nothing is measured then")
    given = parser.parse_args()
    chromium = os.environ.get("PROBDMP_CHROMIUM") or shutil.which("chromium")
    with server() as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = open_page(browser, address, scale=1.5 if given.picture else 1.0)
        if given.picture:
            page.click("#try-example")
            until(page, CALIBRATED)
            take_picture(page, given.picture)
        else:
            measure(page, given)
        browser.close()


if __name__ == "__main__":
    main()
