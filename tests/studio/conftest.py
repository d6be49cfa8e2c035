"""A studio that all tests share, each with a session of its own."""

import pytest
from studio_page import RunningStudio, points_of

from probdmp.demonstrations import placement_within, synthetic_letters
from probdmp.studio.limits import CANVAS


@pytest.fixture(scope="session")
def studio():
    with RunningStudio() as running:
        yield running


@pytest.fixture
def page(studio):
    with studio.page() as connected:
        connected.state()
        yield connected


@pytest.fixture(scope="session")
def drawn():
    """Six demonstrations of the letter c on the canvas."""
    written = synthetic_letters(6, letters="c", dt=0.01)
    placement = placement_within(written, CANVAS)
    return [placement.placed(d) for d in written]


@pytest.fixture
def taught(page, drawn):
    """A page with a letter that was learned and is watched."""
    for stroke in drawn:
        page.ask("stroke", "state", label="c", points=points_of(stroke))
    page.hear("state", where=lambda state: state["calibration"] and state["calibration"]["n"] == len(drawn))
    return page
