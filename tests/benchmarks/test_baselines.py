"""Laws that every baseline obeys, and what each computes against a plain twin; run with the packages of `make bench-env`."""

import importlib
from collections.abc import Callable

import numpy as np
import pytest

from baselines.alignment import Alignment, Command, commands_for, displacements
from baselines.method import Method
from probdmp import Demonstration, synthetic_letters
from probdmp.demonstrations import hold

BASELINES = {
    "z_score.ZScoreBand": None,
    "promp.MovementPrimitiveDistance": "movement_primitives",
    "time_warping.TimeWarpingDistance": "dtaidistance",
    "hidden_markov.HiddenMarkovLikelihood": "hmmlearn",
    "isolation_forest.WindowForest": "sklearn",
}
"""By module and class: the package that it needs."""


@pytest.fixture(scope="module", params=BASELINES)
def make(request: pytest.FixtureRequest) -> Callable[[], Method]:
    package = BASELINES[request.param]
    if package is not None:
        pytest.importorskip(package)
    module, name = request.param.split(".")
    return getattr(importlib.import_module(f"baselines.{module}"), name)


@pytest.fixture(scope="module")
def letters() -> list[Demonstration]:
    return [d for d in synthetic_letters(9) if d.label == "a"]


@pytest.fixture(scope="module", params=["known", "nominal"])
def commands(letters: list[Demonstration], request: pytest.FixtureRequest) -> list[Command]:
    return commands_for(letters, request.param)


@pytest.fixture(scope="module")
def learned(make: Callable[[], Method], letters: list[Demonstration], commands: list[Command]) -> Method:
    return make().fit(letters[:8], commands[:8])


def test_nothing_looks_ahead(learned: Method, letters: list[Demonstration], commands: list[Command]) -> None:
    whole, n = letters[8], letters[8].n_samples // 2
    begun = Demonstration(whole.positions[:n], whole.dt)
    np.testing.assert_allclose(learned.trace(begun, commands[8]), learned.trace(whole, commands[8])[:n], rtol=1e-6, atol=1e-9)


def test_a_statistic_for_each_sample(learned: Method, letters: list[Demonstration], commands: list[Command]) -> None:
    trace = learned.trace(letters[8], commands[8])
    assert len(trace) == letters[8].n_samples
    assert np.isfinite(trace).all()
    assert (trace >= 0).all()


def test_units_do_not_matter(
    make: Callable[[], Method], learned: Method, letters: list[Demonstration], commands: list[Command]
) -> None:
    def larger(positions: np.ndarray | None) -> np.ndarray | None:
        return None if positions is None else 1024 * positions

    scaled = [Demonstration(1024 * d.positions, d.dt) for d in letters]
    told = [Command(1024 * c.start, larger(c.goal), c.duration) for c in commands]
    method = make().fit(scaled[:8], told[:8])
    np.testing.assert_allclose(method.trace(scaled[8], told[8]), learned.trace(letters[8], commands[8]), rtol=1e-6, atol=1e-9)


def test_a_held_movement_is_more_anomalous(learned: Method, letters: list[Demonstration], commands: list[Command]) -> None:
    whole = letters[8]
    held = Demonstration(hold(whole.positions, whole.n_samples // 2, np.random.default_rng(0)), whole.dt)
    undisturbed, blocked = (learned.trace(d, commands[8]).max(axis=0) for d in (whole, held))
    assert (blocked / undisturbed).max() > 1.05


def test_missing_samples_are_no_anomaly_in_themselves(
    learned: Method, letters: list[Demonstration], commands: list[Command]
) -> None:
    positions = letters[8].positions.copy()
    positions[10:12] = np.nan
    trace = learned.trace(Demonstration(positions, letters[8].dt), commands[8])
    assert np.isfinite(trace).all()


def test_a_phase_is_reached_at_the_first_sample_at_or_after_it(letters: list[Demonstration]) -> None:
    demonstration = letters[0]
    path = Alignment.fit(letters).path(demonstration, commands_for([demonstration], "known")[0])
    phases = demonstration.times / demonstration.duration
    assert len(path.position) == 101
    assert (0.01 * path.reached <= phases + 1e-9).all()
    assert (0.01 * (path.reached + 1) > phases - 1e-9).all()
    np.testing.assert_allclose(path.to_goal[-1], 0, atol=1e-12)


def test_displacements_begin_at_zero() -> None:
    positions = np.array([[0.0], [1.0], [3.0], [6.0]])
    np.testing.assert_array_equal(displacements(positions, 2), [[0], [1], [3], [5]])


def test_running_likelihood_ends_at_that_of_the_package() -> None:
    pytest.importorskip("hmmlearn")
    from hmmlearn.hmm import GaussianHMM

    from baselines.hidden_markov import running_log_likelihoods

    rng = np.random.default_rng(0)
    model = GaussianHMM(3, "full")
    model.n_features = 2
    model.startprob_, model.transmat_ = np.array([0.5, 0.5, 0]), np.array([[0.9, 0.1, 0], [0, 0.8, 0.2], [0, 0, 1]])
    model.means_, model.covars_ = rng.normal(size=(3, 2)), np.stack([np.eye(2)] * 3)
    observed = rng.normal(size=(20, 2))
    running = running_log_likelihoods(model, observed)
    for t in (1, 7, 20):
        assert running[t - 1] == pytest.approx(model.score(observed[:t]))


def test_open_end_warping_against_the_plain_recursion(letters: list[Demonstration]) -> None:
    pytest.importorskip("dtaidistance")
    from baselines.time_warping import open_end_costs

    rng = np.random.default_rng(0)
    signals, reference, window = rng.normal(size=(30, 2)), rng.normal(size=(25, 2)), 4
    cost = np.full((31, 36), np.inf)
    cost[0, 0] = 0
    for i in range(30):
        for j in range(max(0, i - window), i + window + 1):
            gap = np.sum((signals[i] - reference[min(j, 24)]) ** 2)
            cost[i + 1, j + 1] = gap + min(cost[i, j + 1], cost[i + 1, j], cost[i, j])
    np.testing.assert_allclose(open_end_costs(signals, reference, window), cost[1:].min(axis=1))
