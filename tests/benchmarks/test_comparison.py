"""Calibration, thresholds that realize a rate, and the experiment with a baseline as its judge."""

import numpy as np
import pytest

from baselines.calibration import Standardization, threshold_for
from probdmp import synthetic_letters
from probdmp.evaluation import UNDISTURBED, Experiment, Finding, Outcome, Trace, at_level, evaluate, level_realizing


@pytest.mark.parametrize(("n", "alpha", "rank"), [(99, 0.01, 99), (199, 0.01, 198), (19, 0.05, 19), (99, 0.05, 95)])
def test_threshold_is_the_conformal_order_statistic(n: int, alpha: float, rank: int) -> None:
    assert threshold_for(np.random.default_rng(0).permutation(n) + 1.0, alpha) == rank


def test_with_too_few_scores_the_largest_is_the_threshold() -> None:
    assert threshold_for([3.0, 1.0, 2.0], 0.01) == 3.0


def test_a_threshold_holds_its_rate_on_exchangeable_scores() -> None:
    rng = np.random.default_rng(0)
    exceeded = [rng.exponential() > threshold_for(rng.exponential(size=99), 0.05) for _ in range(4000)]
    assert np.mean(exceeded) == pytest.approx(0.05, abs=0.012)


def test_standardized_scores_do_not_depend_on_the_scale_of_a_class_or_statistic() -> None:
    rng = np.random.default_rng(0)
    scores = {label: rng.exponential(size=(10, 2)) for label in "ab"}
    scaled = {"a": scores["a"] * [1000, 1], "b": scores["b"] * [1000, 7]}
    plain, other = Standardization.fit(scores), Standardization.fit(scaled)
    for label in "ab":
        np.testing.assert_allclose(other.apply(label, scaled[label]), plain.apply(label, scores[label]))


def outcomes_with(highest: list[float]) -> list[Outcome]:
    times = np.array([0.0, 1.0, 2.0])
    return [
        Outcome(
            label="a",
            duration=2.0,
            onsets={"hold": 1.0},
            findings={
                UNDISTURBED: Finding(None, trace=Trace(times, np.array([0, h, 0]))),
                "hold": Finding(None, trace=Trace(times, np.array([0, h, 2 * h]))),
            },
        )
        for h in highest
    ]


@pytest.mark.parametrize("rate", [0.0, 0.1, 0.3])
def test_a_level_realizes_its_rate(rate: float) -> None:
    outcomes = outcomes_with([0.1 * k for k in range(1, 11)])
    judged = at_level(outcomes, level_realizing(outcomes, rate))
    assert np.mean([outcome.false_alarm is not None for outcome in judged]) == pytest.approx(rate)


def test_another_level_moves_the_first_alarm() -> None:
    outcomes = outcomes_with([1.0])
    assert at_level(outcomes, 0.5)[0].alarms["hold"] == 1.0
    assert at_level(outcomes, 1.0)[0].alarms["hold"] == 2.0
    assert at_level(outcomes, 2.0)[0].alarms["hold"] is None


def test_a_baseline_judges_the_experiment() -> None:
    pytest.importorskip("joblib")
    from baselines.judging import judge_by
    from baselines.z_score import ZScoreBand

    letters = [d for d in synthetic_letters(12) if d.label in "abc"]
    experiment = Experiment(8, 4, faults=("hold", "wrong_class"), traces=True)
    evaluation = evaluate(letters, experiment, {"z": judge_by(ZScoreBand, 0.05)})
    summary = evaluation.summaries()["z"]
    assert summary.false_alarms.n == 12
    assert summary.faults["hold"].ever.rate > 0.8
    unchanged = at_level(evaluation.outcomes["z"], 1.0)
    assert [o.alarms for o in unchanged] == [o.alarms for o in evaluation.outcomes["z"]]
