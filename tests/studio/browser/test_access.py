"""For eyes, hands and screens of every kind; and nothing from elsewhere."""

from collections.abc import Callable
from typing import Any

import pytest
from studio_browser import Studio

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


def test_every_control_has_a_name(studio: Studio) -> None:
    studio.use_example()
    for mode in ("Teach", "Play", "Trace", "Replay"):
        studio.mode(mode)
        assert studio.page.evaluate(NAMELESS) == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out(open_studio: Callable[..., Studio], server: Any, scheme: str) -> None:
    studio = open_studio(server, color_scheme=scheme)
    studio.use_example()
    for mode in ("Play", "Trace", "Replay", "Teach"):
        studio.mode(mode)
        assert studio.page.evaluate(CONTRAST) == []


@pytest.mark.parametrize(("width", "height"), SCREENS)
def test_it_fits_the_screen(open_studio: Callable[..., Studio], server: Any, width: int, height: int) -> None:
    studio = open_studio(server, viewport={"width": width, "height": height})
    studio.use_example()
    for mode in ("Teach", "Play", "Trace", "Replay"):
        studio.mode(mode)
        assert studio.page.evaluate("document.documentElement.scrollWidth") <= width
        canvas = studio.page.locator("#board").bounding_box()
        assert canvas["y"] + canvas["height"] <= height


def test_a_finger_draws_and_its_pressure_is_learned(open_studio: Callable[..., Studio], server: Any) -> None:
    studio = open_studio(server, viewport={"width": 390, "height": 844}, has_touch=True)
    box = studio.page.locator("#ink").bounding_box()
    devtools = studio.page.context.new_cdp_session(studio.page)

    def touch(kind: str, *at: float) -> None:
        points = [{"x": box["x"] + at[0], "y": box["y"] + at[1], "force": 0.3 + at[0] / 1000}] if at else []
        devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    for n in range(2):
        touch("touchStart", 80, 60)
        for k in range(30):
            touch("touchMove", 80 + 5 * k, 60 + (4 - n) * k)
            studio.page.wait_for_timeout(8)
        touch("touchEnd")
        studio.until(f"document.querySelectorAll('#strokes li').length === {n + 1}")
    studio.page.click("#open-model")
    studio.page.check("#use_pressure")
    studio.page.keyboard.press("Escape")
    studio.page.wait_for_selector("#charts figcaption:has-text('pressure over time')")


def test_what_happens_is_said_to_those_who_do_not_see_it(studio: Studio) -> None:
    for selector, manner in (("#hint", "polite"), ("#verdict", "assertive"), ("#toast", "polite")):
        assert studio.page.get_attribute(selector, "aria-live") == manner


def test_nothing_comes_from_elsewhere(studio: Studio) -> None:
    addresses = studio.page.evaluate("performance.getEntriesByType('resource').map((one) => one.name)")
    assert addresses
    assert all(address.startswith(studio.page.evaluate("location.origin")) for address in addresses)
