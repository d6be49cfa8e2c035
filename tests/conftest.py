"""What all tests share: how many examples hypothesis tries, and where real recordings are."""

import gc
import os
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Before NumPy is loaded: every processor has a worker, and threads of BLAS beside it double the time of learning.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

settings.register_profile("fast", max_examples=50, deadline=None, derandomize=True)
settings.register_profile("more", max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("thorough", max_examples=20_000, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "fast"))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Garbage is not looked for while modules are loaded, half of the time that takes, nor among them later."""
    gc.disable()
    collected = yield
    gc.freeze()
    gc.enable()
    return collected


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
    from shortcuts import sketch_pictures

    sketch_pictures(monkeypatch)


@pytest.fixture(params=["sketched", pytest.param("rendered", marks=pytest.mark.slow)])
def sketched_or_rendered(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Pictures are rendered only when asked to be slow."""
    if request.param == "sketched":
        from shortcuts import sketch_pictures

        sketch_pictures(monkeypatch)
    return str(request.param)
