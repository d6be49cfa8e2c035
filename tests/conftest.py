"""What all tests share: how many examples hypothesis tries, and where real recordings are."""

import gc
import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from shortcuts import sketch_pictures

settings.register_profile("fast", max_examples=25, deadline=None, derandomize=True)
settings.register_profile("more", max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("thorough", max_examples=20_000, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "fast"))


@pytest.fixture(scope="module", autouse=True)
def kept_to_the_end() -> None:
    """Garbage is not looked for among modules and collected tests: 7 % of the time. Once more after a test that undoes it."""
    if gc.get_freeze_count() == 0:
        gc.collect()
        gc.freeze()


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of real recordings, on machines that have it."""
    place = os.environ.get("PROBDMP_RECORDINGS")
    if not place:
        pytest.skip("needs real recordings: set the environment variable PROBDMP_RECORDINGS to their folder")
    folder = Path(place)
    assert folder.is_dir(), f"PROBDMP_RECORDINGS names {folder}, which is not a folder"
    return folder


@pytest.fixture
def sketched(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are drawn, but not rendered."""
    sketch_pictures(monkeypatch)


@pytest.fixture(params=["sketched", pytest.param("rendered", marks=pytest.mark.slow)])
def sketched_or_rendered(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Pictures are rendered only when asked to be slow."""
    if request.param == "sketched":
        sketch_pictures(monkeypatch)
    return str(request.param)
