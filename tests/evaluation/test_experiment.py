"""The protocol: splits, faults, tasks, what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_primitive

from probdmp.demonstrations import noise_stds, synthetic_letters
from probdmp.dmp import Configuration
from probdmp.errors import InputError, InputTypeError
from probdmp.evaluation import READINGS, Experiment, evaluate
from probdmp.evaluation.experiment import commanded_tasks, draw_trial

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


# --- the split and the faults -----------------------------------------------------------------------------------------


@given(st.integers(0, 2**32), st.integers(1, 5), st.integers(1, 2))
def test_training_and_tests_share_no_demonstration(seed, train, test):
    members = synthetic_letters(7, letters="v", dt=0.05)
    trial = draw_trial("v", members, Experiment(train, test, seed))
    chosen = [id(d) for d in trial.training + trial.tests]
    assert (len(trial.training), len(trial.tests)) == (train, test)
    assert len(set(chosen)) == train + test
    assert set(chosen) <= {id(d) for d in members}


def test_the_seed_decides(members, experiment):
    one, same, other = (draw_trial("s", members, replace(experiment, seed=seed)) for seed in (1, 1, 2))
    assert [id(d) for d in one.training] == [id(d) for d in same.training]
    assert one.onsets == same.onsets
    for a, b in zip(one.faulty["hold"], same.faulty["hold"], strict=True):
        np.testing.assert_array_equal(a.positions, b.positions)
    assert [id(d) for d in one.training] != [id(d) for d in other.training] or one.onsets != other.onsets


def test_every_demonstration_may_come_into_either_part(members, experiment):
    trials = [draw_trial("s", members, replace(experiment, seed=seed)) for seed in range(60)]
    for d in members:
        share = np.mean([any(d is t for t in trial.training) for trial in trials])
        assert 0.15 < share < 0.75  # three of seven: 0.43


def test_labels_draw_differently(members, experiment):
    trials = [draw_trial(label, members, experiment) for label in "abcd"]
    assert len({tuple(id(d) for d in t.training) for t in trials}) > 1


@settings(max_examples=20)
@given(st.integers(0, 2**32))
def test_faults_begin_in_the_middle_and_change_nothing_before(seed):
    members = synthetic_letters(4, letters="v", dt=0.02)
    trial = draw_trial("v", members, Experiment(2, 2, seed))
    for test, onset, faulty in zip(trial.tests, trial.onsets["hold"], trial.faulty["hold"], strict=True):
        assert 0.3 - 1 / test.n_samples <= onset / test.n_samples <= 0.7
        np.testing.assert_array_equal(faulty.positions[:onset], test.positions[:onset])
        deviation = (faulty.positions[onset:] - test.positions[onset - 1]) / noise_stds(test.positions)
        assert np.abs(deviation).max() < 6
        assert (faulty.dt, faulty.label, faulty.n_samples) == (test.dt, test.label, test.n_samples)


def test_a_class_does_not_depend_on_the_others(demos, members, evaluation, experiment):
    alone = evaluate(members, experiment)
    for reading in READINGS:
        together = [o for o in evaluation.outcomes[reading] if o.label == "s"]
        assert together == list(alone.outcomes[reading])
    shuffled = evaluate([*[d for d in demos if d.label == "v"], *members], experiment)
    for reading in READINGS:
        assert sorted(map(repr, shuffled.outcomes[reading])) == sorted(map(repr, evaluation.outcomes[reading]))


# --- what is commanded ------------------------------------------------------------------------------------------------


def test_known_and_nominal_tasks(members):
    primitive = make_primitive(np.random.default_rng(0))
    for d, task in zip(members, commanded_tasks(primitive, members, "known"), strict=True):
        np.testing.assert_array_equal([task.start, task.goal], d.positions[[0, -1]])
        assert task.duration == d.duration
    for d, task in zip(members, commanded_tasks(primitive, members, "nominal"), strict=True):
        np.testing.assert_array_equal([task.start, task.goal], [d.positions[0], primitive.goal])
        assert task.duration == primitive.duration


# --- the whole --------------------------------------------------------------------------------------------------------


def test_every_test_is_judged_in_every_reading(evaluation, experiment):
    assert list(evaluation.outcomes) == list(READINGS)
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
    assert len(document["readings"]) == 4
    assert set(document["by_class"]) == {"s", "v"}
    assert document["published"]["false_alarms"]["count"] == 2


def test_progress_is_told_after_each_class(members, experiment):
    told = []
    evaluate([*members, *[replace(d, label="t") for d in members]], replace(experiment, train=1, test=1), told.append)
    assert told == ["s", "t"]


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
        ({"detector": "magic"}, "detector to be one of 'paper'"),
        ({"task": "guessed"}, "task to be one of 'known', 'nominal', got 'guessed'"),
        ({"faults": ("hold", "fire")}, "fault to be one of .*'hold'.*got 'fire'"),
        ({"faults": "hold"}, "fault"),
    ],
)
def test_experiments_that_cannot_be_run(arguments, match):
    with pytest.raises((InputError, InputTypeError), match=f"Expected {match}"):
        Experiment(**arguments)


@pytest.mark.slow
def test_the_paper_on_all_built_in_letters():
    """The published protocol on 22 letters: few false alarms, and most held movements seen."""
    demos = synthetic_letters(20)
    document = evaluate(demos, Experiment()).as_dict()
    assert document["classes"] == 22
    assert document["false_alarms"]["n"] == 220
    assert document["false_alarms"]["rate"] < 0.25
    assert document["faults"]["hold"]["detected"]["rate"] > 0.2
