"""For eyes, hands and screens of every kind; and nothing from elsewhere."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from studio_browser import PACE, Studio, new_page

NAMELESS = """() => [...document.querySelectorAll(
    'button, a[href], input, select, [role=tab], [role=tabpanel], dialog, canvas[role]')].filter((one) => {
    const text = (id) => document.getElementById(id)?.textContent.trim();
    const named = one.getAttribute('aria-label') || text(one.getAttribute('aria-labelledby')) ||
      [...(one.labels ?? [])].some((label) => label.textContent.trim()) || (one.matches('button, a') && one.textContent.trim());
    return !named;
  }).map((one) => one.outerHTML.slice(0, 120))"""
CONTRAST = """() => {
  const light = (text) => {
    const linear = (c) => (c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
    const [r, g, b] = text.match(/[\\d.]+/g).slice(0, 3).map((c) => linear(c / 255));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const behind = (one) => {
    for (let at = one; at; at = at.parentElement) {
      const color = getComputedStyle(at).backgroundColor;
      if (!/, 0\\)$|transparent/.test(color)) return color;
    }
    return 'rgb(255, 255, 255)';
  };
  const texts = [...document.querySelectorAll('main *, header *')].filter((one) => one.checkVisibility() &&
    !one.closest(':disabled, .unseen') && [...one.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim()));
  return texts.map((one) => {
    const [a, b] = [light(getComputedStyle(one).color), light(behind(one))].sort((x, y) => y - x);
    return [(a + 0.05) / (b + 0.05), one.outerHTML.slice(0, 90)];
  }).filter(([ratio]) => ratio < 4.5);
}"""
SCREENS = [(1440, 900), (1024, 768), (390, 844)]
MODES = ("Teach", "Play", "Trace", "Replay")


@pytest.fixture(scope="module")
def shown(browser: Any, server: Any) -> Iterator[Studio]:
    """A page with an example, to be looked at."""
    studio = new_page(browser)
    studio.open(server.url)
    studio.use_example()
    yield studio
    studio.page.context.close()
    assert not studio.complaints


def test_every_control_has_a_name(shown: Studio) -> None:
    for mode in MODES:
        shown.mode(mode)
        shown.becomes(NAMELESS, [])


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out(shown: Studio, scheme: str) -> None:
    shown.page.emulate_media(color_scheme=scheme)
    for mode in MODES:
        shown.mode(mode)
        shown.becomes(CONTRAST, [])


@pytest.mark.parametrize(("width", "height"), SCREENS)
def test_it_fits_the_screen(shown: Studio, width: int, height: int) -> None:
    shown.page.set_viewport_size({"width": width, "height": height})
    shown.becomes("[innerWidth, innerHeight]", [width, height])
    for mode in MODES:
        shown.mode(mode)
        shown.until("document.documentElement.scrollWidth <= innerWidth")
        shown.until("document.getElementById('board').getBoundingClientRect().bottom <= innerHeight")


def test_a_finger_draws_and_its_pressure_is_learned(open_studio: Callable[..., Studio], server: Any) -> None:
    studio = open_studio(server, viewport={"width": 390, "height": 844}, has_touch=True)
    box = studio.page.locator("#ink").bounding_box()

    def touch(kind: str, seconds: float, *at: float) -> None:
        points = [{"x": box["x"] + at[0], "y": box["y"] + at[1], "force": 0.3 + at[0] / 1000}] if at else []
        studio.devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points, "timestamp": seconds})

    for n in range(2):
        begin = time.time() - 30 * PACE
        touch("touchStart", begin, 80, 60)
        for k in range(1, 30):
            touch("touchMove", begin + PACE * k, 80 + 5 * k, 60 + (4 - n) * k)
        touch("touchEnd", begin + PACE * 30)
        studio.counts("#strokes li", n + 1)
    studio.page.click("#open-model")
    studio.page.check("#use_pressure")
    studio.page.keyboard.press("Escape")
    studio.says("#charts figcaption", "pressure over time")


def test_what_happens_is_said_to_those_who_do_not_see_it(studio: Studio) -> None:
    for selector, manner in (("#hint", "polite"), ("#verdict", "assertive"), ("#toast", "polite")):
        assert studio.page.get_attribute(selector, "aria-live") == manner


def test_nothing_comes_from_elsewhere(studio: Studio) -> None:
    addresses = studio.page.evaluate("performance.getEntriesByType('resource').map((one) => one.name)")
    assert addresses
    assert all(address.startswith(studio.page.evaluate("location.origin")) for address in addresses)
