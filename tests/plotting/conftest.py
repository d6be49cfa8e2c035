"""A primitive, an execution of it that fails, an evaluation, and axes to draw on."""

from collections.abc import Iterator
from dataclasses import replace

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from probdmp import FailureDetector, synthetic_letters
from probdmp.demonstrations import Demonstration, hold
from probdmp.dmp import Configuration, Primitive, task_for
from probdmp.evaluation import Evaluation, Experiment, JudgedExecution, evaluate, judge_execution
from probdmp.learning import LearningOptions, fit_primitive
from probdmp.plotting.style import SETTINGS

CONFIGURATION = Configuration(n_basis=8, weight_uncertainty="joint")


@pytest.fixture
def ax() -> Iterator[Axes]:
    with matplotlib.rc_context(SETTINGS):
        yield Figure().subplots()


@pytest.fixture(scope="session")
def letters() -> list[Demonstration]:
    return synthetic_letters(7, seed=1, letters="a", dt=0.02)


@pytest.fixture(scope="session")
def primitive(letters) -> Primitive:
    return fit_primitive(letters[:6], CONFIGURATION, LearningOptions("hierarchical"))[0]


@pytest.fixture(scope="session")
def blocked(letters) -> Demonstration:
    last = letters[6]
    return replace(last, positions=hold(last.positions, last.n_samples // 2, np.random.default_rng(0)))


@pytest.fixture(scope="session", params=["calibrated", "paper"])
def judged(request, primitive, letters, blocked) -> JudgedExecution:
    detector = FailureDetector(0.1, rule=request.param).fit(primitive, letters[:6])
    return judge_execution(detector, primitive, task_for(primitive, start=blocked.positions[0]), blocked)


@pytest.fixture(scope="session")
def evaluation() -> Evaluation:
    faults = ("hold", "push", "wrong_goal", "jitter")
    experiment = Experiment(4, 3, 0, "calibrated", faults=faults, configuration=CONFIGURATION, traces=True)
    return evaluate(synthetic_letters(7, seed=2, letters="cl", dt=0.02), experiment)
