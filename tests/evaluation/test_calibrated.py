"""The experiment judged by the calibrated detector, on a few built-in letters."""

import json
from dataclasses import replace

import numpy as np
import pytest

from probdmp.demonstrations import synthetic_letters
from probdmp.dmp import PUBLISHED, Configuration
from probdmp.errors import InputError
from probdmp.evaluation import DETECTORS, READINGS, UNDISTURBED, Experiment, at_level, evaluate, example_of, realized_rates

SMALL = Configuration(n_basis=8, weight_uncertainty="joint")
FAULTS = ("hold", "slow", "wrong_class", "dropout", "stuck_sensor")


@pytest.fixture(scope="module")
def demos():
    return synthetic_letters(10, letters="sv", dt=0.02)


@pytest.fixture(scope="module")
def experiment():
    return Experiment(6, 4, 0, "calibrated", faults=FAULTS, configuration=SMALL, false_alarm_rate=0.1, traces=True)


@pytest.fixture(scope="module")
def evaluation(demos, experiment):
    return evaluate(demos, experiment)


@pytest.fixture(scope="module")
def outcomes(evaluation):
    return evaluation.outcomes["calibrated"]


def test_primitives_are_made_as_the_detector_needs_them():
    experiment = Experiment()
    assert experiment.configuration_for("paper") == PUBLISHED
    assert experiment.configuration_for("calibrated") == Configuration(weight_uncertainty="joint")
    assert replace(experiment, configuration=SMALL).configuration_for("calibrated") is SMALL


@pytest.mark.parametrize("rate", [0, 1, -0.1, float("nan")])
def test_rates_that_no_detector_has(rate):
    with pytest.raises(InputError, match="false_alarm_rate"):
        Experiment(false_alarm_rate=rate)


def test_failures_are_found_and_named(outcomes):
    for fault in ("hold", "wrong_class", "stuck_sensor"):
        assert sum(o.alarms[fault] is not None for o in outcomes) >= 7, fault
    assert sum(o.false_alarm is not None for o in outcomes) <= 2
    assert [o.findings["hold"].cause for o in outcomes if o.alarms["hold"] is not None].count("held") >= 7
    assert {o.findings["stuck_sensor"].kind for o in outcomes} >= {"sensor"}
    assert all(o.findings[UNDISTURBED].kind == "" for o in outcomes if o.false_alarm is None)


def test_before_the_onset_both_runs_are_the_same(outcomes):
    for o in outcomes:
        alarm, onset = o.alarms["hold"], o.onsets["hold"]
        if alarm is not None and alarm < onset:
            assert o.false_alarm == alarm


def test_the_calibration_is_on_the_training_demonstrations(evaluation, experiment):
    (facts,) = evaluation.by_seed[0]["calibrated"].calibrations
    assert (facts.task, facts.label, facts.n, facts.false_alarm_rate) == ("known", "", 12, 0.1)
    assert facts.attainable_rate == pytest.approx(1 / 13)
    assert facts.thresholds[0.1] == facts.threshold
    assert list(facts.thresholds.values()) == sorted(facts.thresholds.values(), reverse=True)
    document = json.loads(json.dumps(evaluation.as_dict(), allow_nan=False))
    assert document["calibrations"][0]["n"] == 12
    assert document["readings"][0]["name"] == "calibrated"
    assert document["faults"]["slow"]["told_apart"]["n"] == document["faults"]["slow"]["detected"]["count"]
    assert document["faults"]["wrong_class"]["told_apart"] is None


def test_a_higher_rate_is_the_lower_threshold_of_the_calibration(demos, experiment, evaluation, outcomes):
    """Asking for another rate and moving the threshold of the traces come to the same, but for moments within one sample."""
    (facts,) = evaluation.by_seed[0]["calibrated"].calibrations
    moved = [moved for o in outcomes for moved in at_level([o], facts.relative_level(0.01, o.label))]
    asked = evaluate(demos, replace(experiment, false_alarm_rate=0.01, traces=False)).outcomes["calibrated"]
    pairs = [(a.alarms[f], b.alarms[f]) for a, b in zip(moved, asked, strict=True) for f in ("hold", "slow", "wrong_class")]
    assert all((a is None) == (b is None) for a, b in pairs)
    apart = np.array([abs(a - b) for a, b in pairs if a is not None]) / demos[0].dt
    assert np.mean(apart < 1 + 1e-9) > 0.9
    assert [one.nominal for one in realized_rates([evaluation.by_seed[0]["calibrated"]])] == [0.01, 0.02, 0.05, 0.1]


def test_side_by_side_each_detector_has_its_own_primitives(demos, experiment, evaluation):
    paper = {READINGS[0].name: DETECTORS["paper"][READINGS[0].name]}
    chosen = replace(experiment, configuration=None, faults=("hold",), traces=False)
    alone = evaluate(demos, replace(chosen, detector="paper"), paper)
    both = evaluate(demos, chosen, {**DETECTORS["calibrated"], **paper})
    assert both.outcomes[READINGS[0].name] == alone.outcomes[READINGS[0].name]


def test_the_nominal_task_has_its_own_calibration(demos, experiment):
    nominal = evaluate(demos, replace(experiment, task="nominal", faults=("hold",), traces=False))
    (facts,) = nominal.by_seed[0]["calibrated"].calibrations
    assert facts.task == "nominal"


def test_an_example_is_one_of_the_executions(demos, evaluation, outcomes):
    for fault in (None, "slow"):
        example = example_of(evaluation, demos, fault)
        name = fault or "hold"
        assert (example.fault, example.judge, list(example.findings)) == (name, "calibrated", [UNDISTURBED, name])
        (outcome,) = [o for o in outcomes if o.findings[name] is example.findings[name]]
        assert (outcome.label, outcome.onsets[name]) == (example.label, example.onset)
        assert example.findings[UNDISTURBED].alarm is None
        for key, recording in example.recordings.items():
            assert len(example.findings[key].trace.times) == recording.n_samples
        assert example.rollout.names == example.primitive.names
