"""Five pages for a long time: memory does not grow."""

import os
import random
import threading
import time

import pytest
from studio_page import RunningStudio, points_of

from probdmp.demonstrations import placement_within, synthetic_letters
from probdmp.studio.limits import CANVAS

MINUTES = float(os.environ.get("PROBDMP_SOAK_MINUTES", "2"))
"""30 for the figure in the documentation."""
N_PAGES = 5
GROWTH = 24 * 1024
"""kB that may come and go: caches of a few hundred recordings."""


def resident():
    """kB of this process, which the server is part of."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024


def use(studio, number, until, problems):
    """Draw, play, block, trace, leave and come back, over and over."""
    rng = random.Random(number)
    letter = "acelo"[number]
    written = synthetic_letters(4, letters=letter, dt=0.01)
    placement = placement_within(written, CANVAS)
    strokes = [points_of(placement.placed(d)) for d in written]
    session = None
    try:
        while time.monotonic() < until:
            with studio.page(session) as page:
                session = page.state()["session"]
                for stroke in strokes:
                    page.ask("stroke", "state", label=letter, points=stroke)
                page.hear("band")
                page.ask("play", "playing", "error", fault=rng.choice([None, "hold", "push"]), speed=4)
                page.say("pointer", mode=rng.choice(["none", "slow"]))
                page.hear("played")
                page.say("trace_begin", label=rng.choice([None, letter]))
                for k in range(0, len(strokes[0]), 5):
                    page.say("trace", points=strokes[0][k : k + 5])
                page.say("trace_end")
                page.hear("recognised", where=lambda message: message["final"])
                page.ask("delete_label", "state", label=letter)
    except Exception as error:
        problems.append(f"page {number}: {error!r}")
        raise


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="reads the memory of this process from /proc")
def test_five_pages_for_a_long_time_take_no_more_memory():
    problems, seen = [], []
    with RunningStudio() as studio:
        until = time.monotonic() + 60 * MINUTES
        pages = [threading.Thread(target=use, args=(studio, k, until, problems)) for k in range(N_PAGES)]
        for page in pages:
            page.start()
        while time.monotonic() < until:
            time.sleep(min(2.0, 60 * MINUTES / 20))
            seen.append(resident())
        for page in pages:
            page.join(60)
    assert not problems
    settled, late = seen[len(seen) // 4 : len(seen) // 2], seen[-len(seen) // 4 :]
    print(f"resident: {settled[0]} kB after a quarter, {late[-1]} kB at the end, of {MINUTES:g} minutes")
    assert sorted(late)[len(late) // 2] - sorted(settled)[len(settled) // 2] < GROWTH
