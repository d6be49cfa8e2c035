"""Every example is short, runs, and draws one figure that says something."""

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import pytest
from shortcuts import sample_less_often

matplotlib.use("Agg")

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.py"))
MOST_LINES = 80
LONGEST = 120
"""Seconds, on a machine that is busy with other things."""


def test_the_examples_are_numbered() -> None:
    assert [path.name[:3] for path in EXAMPLES] == [f"{k:02d}_" for k in range(1, len(EXAMPLES) + 1)]
    assert len(EXAMPLES) >= 10


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_says_what_it_shows(path: Path) -> None:
    lines = path.read_text().splitlines()
    assert len(lines) <= MOST_LINES
    assert re.fullmatch(r'"""[A-Z].*[.?]', lines[0])


def check_what_came_of_it(printed: str, figure: Path) -> None:
    assert printed.strip(), "an example also says what it found"
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert [child.name for child in figure.parent.iterdir()] == ["figure.png"]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_draws_one_figure(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In this process, which has loaded what it needs, on recordings sampled less often; warnings are errors here too."""
    figure = tmp_path / "figure.png"
    sample_less_often(monkeypatch)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(path), str(figure)])
    with matplotlib.rc_context():
        runpy.run_path(str(path), run_name="__main__")
    plt.close("all")
    check_what_came_of_it(capsys.readouterr().out, figure)


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_as_a_program_of_its_own(path: Path, tmp_path: Path) -> None:
    figure = tmp_path / "figure.png"
    command = [sys.executable, "-W", "error", str(path), str(figure)]
    done = subprocess.run(
        command, cwd=tmp_path, env=os.environ | {"MPLBACKEND": "Agg"}, capture_output=True, text=True, timeout=LONGEST
    )
    assert done.returncode == 0, done.stderr
    check_what_came_of_it(done.stdout, figure)
