"""The front door."""

import subprocess
import sys

import pytest

import probdmp

PUBLIC = [
    "Demonstration",
    "FailureDetector",
    "GaussianTrajectory",
    "InputError",
    "ModelFileError",
    "OnlineExecution",
    "Primitive",
    "PrimitiveLibrary",
    "ProbDMPError",
    "ProbabilisticDMP",
    "Task",
    "TrackedTrajectory",
    "Verdict",
    "demonstration_from_times",
    "load",
    "load_detector",
    "read_demonstrations",
    "synthetic_arm_movements",
    "synthetic_letters",
    "write_demonstrations",
]


def test_the_front_door_is_this_list() -> None:
    assert probdmp.__all__ == PUBLIC == sorted(PUBLIC)
    assert len(PUBLIC) <= 20


def test_every_public_name_is_there_and_documented() -> None:
    for name in PUBLIC:
        assert getattr(probdmp, name).__doc__
        assert name in dir(probdmp)


def test_other_names_are_not() -> None:
    assert not hasattr(probdmp, "ProDMP")


def loaded_after(statement: str) -> set[str]:
    """Top-level packages in a fresh interpreter after a statement."""
    script = f"{statement}; import sys; print(*{{name.split('.')[0] for name in sys.modules}})"
    return set(subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.split())


def test_the_core_needs_numpy_alone_until_it_is_used() -> None:
    loaded = loaded_after("import probdmp; [getattr(probdmp, name) for name in probdmp.__all__]")
    assert "numpy" in loaded
    assert not loaded & {
        "scipy",
        "matplotlib",
        "safetensors",
        "typer",
        "rich",
        "click",
        "sklearn",
        "starlette",
        "uvicorn",
        "websockets",
    }


def test_importing_alone_loads_nothing() -> None:
    assert "numpy" not in loaded_after("import probdmp")
    assert "probdmp.dmp" not in loaded_after("import probdmp.gaussian")


def test_the_class_alone_loads_what_a_fit_needs() -> None:
    script = "from probdmp import ProbabilisticDMP; import sys; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.split()
    heavy = {"numpy.random", "numpy.ma", "hashlib", "pathlib"}
    heavy |= {f"probdmp.{name}" for name in ("detection", "io", "execution", "evaluation", "demonstrations.letters")}
    assert not heavy & (set(loaded) - set(loaded_by_numpy()))


def loaded_by_numpy() -> list[str]:
    script = "import numpy, sys; print(*sys.modules)"
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.split()


STEPS = """
import sys
import numpy as np
from probdmp import FailureDetector, ProbabilisticDMP
rng = np.random.default_rng(0)
paths = [np.cumsum(rng.normal(1.0, 0.1, (60, 2)), axis=0) for _ in range(6)]
dmp = ProbabilisticDMP(n_basis=8, weight_uncertainty={weights!r}).fit(paths, dt=0.01)
execution = dmp.execute(detector=FailureDetector().fit(dmp, paths, dt=0.01))
before = set(sys.modules)
for observation in paths[0]:
    execution.step(observation)
print(*(set(sys.modules) - before))
"""


@pytest.mark.parametrize("weights", ["joint", "independent"])
def test_a_control_loop_loads_nothing(weights: str) -> None:
    script = STEPS.format(weights=weights)
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert not ran.stdout.split()


def test_the_web_server_is_loaded_by_the_studio_alone_and_only_when_it_serves() -> None:
    server = {"starlette", "uvicorn", "websockets"}
    assert not loaded_after("import probdmp.cli.program") & server
    assert not loaded_after("import probdmp.studio.application, probdmp.studio.routes, probdmp.studio.connection") & server
