"""The whole experiment: judges, seeds, the document, what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from probdmp.demonstrations import FAULTS, synthetic_letters
from probdmp.dmp import Configuration
from probdmp.errors import InputError, InputTypeError
from probdmp.evaluation import (
    DETECTORS,
    READINGS,
    Assessment,
    Experiment,
    Finding,
    evaluate,
    illustrate,
    learned_primitive,
    outcomes_of,
    summarize,
)

SMALL = Configuration(n_basis=8, discretization="semi_implicit_euler", scaling="paper")


@pytest.fixture(scope="module")
def demos():
    return synthetic_letters(7, letters="sv", dt=0.02)


@pytest.fixture(scope="module")
def members(demos):
    return [d for d in demos if d.label == "s"]


@pytest.fixture(scope="module")
def experiment():
    return Experiment(train=3, test=3, configuration=SMALL)


@pytest.fixture(scope="module")
def evaluation(demos, experiment):
    return evaluate(demos, experiment)


def test_a_class_does_not_depend_on_the_others(demos, members, evaluation, experiment):
    alone = evaluate(members, experiment)
    for reading, outcomes in evaluation.outcomes.items():
        assert [o for o in outcomes if o.label == "s"] == alone.outcomes[reading]
    shuffled = evaluate([*[d for d in demos if d.label == "v"], *members], experiment)
    for reading, outcomes in evaluation.outcomes.items():
        assert sorted(map(repr, shuffled.outcomes[reading])) == sorted(map(repr, outcomes))


# --- the whole --------------------------------------------------------------------------------------------------------


def test_every_test_is_judged_in_every_reading(evaluation, experiment):
    assert list(evaluation.outcomes) == [reading.name for reading in READINGS]
    for outcomes in evaluation.outcomes.values():
        assert [o.label for o in outcomes] == ["s"] * 3 + ["v"] * 3
        for o in outcomes:
            assert 0.25 * o.duration < o.onsets["hold"] < 0.75 * o.duration
            for time in (o.false_alarm, o.alarms["hold"]):
                assert time is None or 0 <= time <= o.duration + 1e-9


def test_readings_judge_the_same_executions(evaluation):
    first, *others = evaluation.outcomes.values()
    for outcomes in others:
        assert [(o.label, o.duration, o.onsets) for o in outcomes] == [(o.label, o.duration, o.onsets) for o in first]


def test_it_can_be_repeated(demos, evaluation, experiment):
    assert evaluate(demos, experiment).as_dict() == evaluation.as_dict()


def test_before_the_onset_both_runs_are_the_same(evaluation):
    """An alarm before the onset is one that the execution as recorded raises too, at the same moment."""
    for outcomes in evaluation.outcomes.values():
        for o in outcomes:
            alarm, onset = o.alarms["hold"], o.onsets["hold"]
            if alarm is not None and alarm < onset:
                assert o.false_alarm == alarm
            if o.false_alarm is not None and o.false_alarm < onset:
                assert alarm == o.false_alarm


def test_the_document_has_what_is_promised(evaluation):
    document = json.loads(json.dumps(evaluation.as_dict(), allow_nan=False))
    assert (document["classes"], document["train"], document["test"], document["seed"]) == (2, 3, 3, 0)
    assert (document["detector"], document["task"]) == ("paper", "known")
    rate = {"count", "n", "rate", "low", "high"}
    assert set(document["false_alarms"]) == rate
    hold = document["faults"]["hold"]
    assert {"detected", "ever", "latency_median", "latency_p95"} <= set(hold)
    assert set(hold["detected"]) == set(hold["ever"]) == rate
    assert hold["detected"]["n"] == document["false_alarms"]["n"] == 6
    assert len(document["readings"]) == 6
    assert set(document["by_class"]) == {"s", "v"}
    assert document["published"]["false_alarms"]["count"] == 2


def test_progress_is_told_after_each_class(members, experiment):
    told = []
    evaluate([*members, *[replace(d, label="t") for d in members]], replace(experiment, train=1, test=1), on_class=told.append)
    assert told == ["s", "t"] * len(READINGS)


# --- other judges -----------------------------------------------------------------------------------------------------


def early_judge(trials, experiment, on_class):
    """Calls every execution failed a quarter into it, and says that the sensor is to blame."""
    outcomes = []
    for trial in trials:
        findings = {
            name: [Finding(0.25 * d.duration, "sensor") for d in executions] for name, executions in trial.executions.items()
        }
        outcomes += outcomes_of(trial, findings)
        on_class(trial.label)
    return Assessment(outcomes)


def test_anyone_may_judge(demos, experiment):
    chosen = replace(experiment, detector="mine", faults=("hold", "spikes", "dropout", "wrong_class"))
    evaluation = evaluate(demos, chosen, {"early": early_judge})
    document = json.loads(json.dumps(evaluation.as_dict(), allow_nan=False))
    assert (document["detector"], [r["name"] for r in document["readings"]]) == ("mine", ["early"])
    assert document["false_alarms"]["count"] == 6
    faults = document["faults"]
    assert [faults[name]["detected"]["count"] for name in chosen.faults] == [0, 0, 0, 6]
    assert faults["wrong_class"]["kinds"] == {"sensor": 6}
    assert (faults["dropout"]["false_alarms"]["count"], faults["spikes"]["called_sensor"]["count"]) == (0, 0)


def test_a_judge_sees_all_classes_of_a_seed_at_once(demos, experiment):
    seen = []

    def judge(trials, experiment, on_class):
        seen.append((experiment.seed, experiment.seeds, [trial.label for trial in trials]))
        return early_judge(trials, experiment, on_class)

    evaluate(demos, replace(experiment, seed=3, seeds=2), {"mine": judge})
    assert seen == [(3, 1, ["s", "v"]), (4, 1, ["s", "v"])]


def test_a_judge_that_forgets_some_is_refused(demos, experiment):
    with pytest.raises(InputError, match=r"from the judge 'lazy' an outcome for each of 6 test executions.*got 5"):
        evaluate(demos, experiment, {"lazy": lambda *arguments: Assessment(early_judge(*arguments).outcomes[1:])})


def test_what_judges_share_is_learned_once(demos, experiment):
    trials = []

    def judge(given, experiment, on_class):
        trials.extend(given)
        return early_judge(given, experiment, on_class)

    evaluate(demos, experiment, {"mine": judge})
    primitive = learned_primitive(trials[0], SMALL)
    assert learned_primitive(trials[0], SMALL) is primitive
    assert learned_primitive(trials[1], SMALL) is not primitive


def test_traces_on_request(demos, evaluation, experiment):
    first = {READINGS[0].name: DETECTORS["paper"][READINGS[0].name]}
    faults = ("hold", "slow", "dropout")
    traced = evaluate(demos, replace(experiment, traces=True, faults=faults), first).outcomes[READINGS[0].name]
    for o, plain in zip(traced, evaluation.outcomes[READINGS[0].name], strict=True):
        assert plain.findings["hold"].trace is None
        assert o.findings["hold"] == plain.findings["hold"]  # traces aside
        for name, finding in o.findings.items():
            times, ratios = finding.trace.times, finding.trace.test_ratios
            assert len(times) == len(ratios)
            assert (times[-1] > o.duration * 1.2) == (name == "slow")
            above = np.flatnonzero(ratios > 1)
            assert finding.alarm == (times[above[0]] if len(above) else None)


# --- several seeds and faults -----------------------------------------------------------------------------------------


def test_several_seeds_are_pooled(demos, evaluation, experiment):
    both = evaluate(demos, replace(experiment, seeds=2))
    second = evaluate(demos, replace(experiment, seed=1))
    for name, outcomes in both.outcomes.items():
        assert outcomes == evaluation.outcomes[name] + second.outcomes[name]
    document = json.loads(json.dumps(both.as_dict(), allow_nan=False))
    assert (document["seed"], document["seeds"], document["interval"]) == (0, 2, "bootstrap_over_classes")
    assert document["false_alarms"]["n"] == 12
    for one, alone in zip(document["per_seed"], (evaluation, second), strict=True):
        expected = alone.as_dict()
        assert (one["seed"], one["false_alarms"]) == (expected["seed"], expected["false_alarms"])
        assert one["faults"]["hold"] == json.loads(json.dumps(expected["faults"]["hold"]))
    assert evaluation.as_dict()["interval"] == "clopper_pearson"
    assert "per_seed" not in evaluation.as_dict()


def test_the_paper_judges_every_fault(demos, experiment):
    """At half speed it is monitored past the end; with missing samples there is no error."""
    first = {READINGS[0].name: DETECTORS["paper"][READINGS[0].name]}
    evaluation = evaluate(demos, replace(experiment, faults=tuple(FAULTS), task="nominal"), first)
    (outcomes,) = evaluation.outcomes.values()
    assert all(list(o.findings) == ["undisturbed", *FAULTS] for o in outcomes)
    assert list(summarize(outcomes).faults) == list(FAULTS)
    json.dumps(evaluation.as_dict(), allow_nan=False)


@pytest.mark.parametrize("fault", ["slow", "wrong_class", "dropout", "push:0.4"])
def test_every_fault_can_be_illustrated(demos, experiment, fault):
    shown = illustrate(demos, replace(experiment, faults=(fault,)), "v")
    assert (shown.label, shown.fault) == ("v", fault)
    assert len(shown.disturbed.statistic) == shown.disturbed.recording.n_samples
    assert 0 <= shown.onset < shown.undisturbed.recording.duration


# --- what is refused --------------------------------------------------------------------------------------------------


def test_too_few_demonstrations_are_named_by_class(demos):
    scarce = [*demos, *[replace(d, label="few") for d in demos[:4]], replace(demos[0], label="one")]
    with pytest.raises(InputError, match=r"train \+ test = 6 demonstrations of every class, got 4 of 'few', 1 of 'one'\."):
        evaluate(scarce, Experiment(3, 3))


def test_the_hint_is_one_that_works(demos):
    with pytest.raises(InputError, match=r"train \+ test = 20 .*got 7 of 's', 7 of 'v'\. Ask for fewer: train = 3, test = 4"):
        evaluate(demos, Experiment(10, 10))


def test_no_demonstrations_at_all():
    with pytest.raises(InputError, match=r"Expected .*demonstration.*, got"):
        evaluate([], Experiment(1, 1))


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"train": 0}, "train as a whole number from 1 up, got 0"),
        ({"test": 0}, "test as a whole number from 1 up, got 0"),
        ({"train": 2.5}, "train as a whole number"),
        ({"seed": -1}, "seed as a whole number from 0 up, got -1"),
        ({"seeds": 0}, "seeds as a whole number from 1 up, got 0"),
        ({"task": "guessed"}, "task to be one of 'known', 'nominal', got 'guessed'"),
        ({"faults": ("hold", "fire")}, "fault to be one of .*'hold'.*got 'fire'"),
        ({"faults": "hold"}, "faults as a tuple of names, got 'hold'"),
        ({"faults": ("jitter:2",)}, "fault 'jitter' without a size"),
    ],
)
def test_experiments_that_cannot_be_run(arguments, match):
    with pytest.raises((InputError, InputTypeError), match=f"Expected {match}"):
        Experiment(**arguments)


def test_detectors_that_do_not_exist(demos):
    with pytest.raises(InputError, match="detector to be one of 'calibrated', 'paper', got 'magic'"):
        evaluate(demos, Experiment(3, 3, detector="magic"))


@pytest.mark.slow
def test_the_paper_on_all_built_in_letters():
    """The published protocol on 22 letters: few false alarms, and most held movements seen."""
    demos = synthetic_letters(20)
    document = evaluate(demos, Experiment()).as_dict()
    assert document["classes"] == 22
    assert document["false_alarms"]["n"] == 220
    assert document["false_alarms"]["rate"] < 0.25
    assert document["faults"]["hold"]["detected"]["rate"] > 0.2
