"""A few letters, models learned from them, and a way to run the program in this process."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from program import run_program

from probdmp import FailureDetector, PrimitiveLibrary, ProbabilisticDMP, synthetic_letters, write_demonstrations
from probdmp.demonstrations import Demonstration, hold

N_BASIS = 8
VARIED = {"n_basis": N_BASIS, "weight_model": "hierarchical", "weight_uncertainty": "joint"}
"""How `probdmp fit --n-basis 8` learns."""


def parse(text: str) -> Any:
    """One JSON document, nothing else, and strictly JSON."""

    def refuse(constant):
        raise AssertionError(f"{constant} in JSON")

    assert text.count("\n") == 1
    return json.loads(text, parse_constant=refuse)


@pytest.fixture(scope="session")
def run() -> Callable[..., Any]:
    """`run("fit", path, …)`: the result has exit_code, stdout, stderr."""

    def run(*arguments, text=None, env=None):
        return run_program([str(a) for a in arguments], text, env)

    return run


@pytest.fixture(scope="session")
def run_json(run) -> Callable[..., Any]:
    """The document that a verb prints with `--json`, after exit code 0 and nothing on standard error."""

    def run_json(*arguments, exit_code=0):
        result = run(*arguments, "--json")
        assert (result.exit_code, result.stderr) == (exit_code, "")
        return parse(result.stdout)

    return run_json


@pytest.fixture(scope="session")
def letters() -> list[Demonstration]:
    return synthetic_letters(6, seed=1, letters="cl", dt=0.02)


@pytest.fixture(scope="session")
def blocked(letters) -> list[Demonstration]:
    """The first of each letter as recorded, the second blocked half-way."""
    rng = np.random.default_rng(0)
    return [
        d if k % 6 == 0 else replace(d, positions=hold(d.positions, d.n_samples // 2, rng))
        for k, d in enumerate(letters)
        if k % 6 in (0, 1)
    ]


@pytest.fixture(scope="session")
def folder(tmp_path_factory, letters, blocked) -> Path:
    """Files: letters.npz, blocked.npz, unlabelled.npz; letters, c, bare (without detector) and paper (its rule).probdmp."""
    place = tmp_path_factory.mktemp("cli")
    write_demonstrations(place / "letters.npz", letters)
    write_demonstrations(place / "blocked.npz", blocked)
    by_label = {label: [d for d in letters if d.label == label] for label in "cl"}
    write_demonstrations(place / "unlabelled.npz", [replace(d, label="") for d in by_label["c"]])
    library = PrimitiveLibrary.fit(by_label, **VARIED)
    library.save(place / "letters.probdmp", FailureDetector().fit(library, by_label))
    library.save(place / "bare.probdmp")
    library.save(place / "paper.probdmp", FailureDetector(rule="paper").fit(library, by_label))
    alone = ProbabilisticDMP(**VARIED).fit(by_label["c"])
    alone.save(place / "c.probdmp", FailureDetector().fit(alone, by_label["c"]))
    return place
