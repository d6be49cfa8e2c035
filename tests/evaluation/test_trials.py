"""Splits, faults, and what each execution is told to do."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_primitive

from probdmp.demonstrations import FAULTS, Demonstration, noise_stds, synthetic_letters
from probdmp.errors import TooFewDemonstrationsError
from probdmp.evaluation import UNDISTURBED, Experiment, commanded_tasks, draw_trials

ALL = (*FAULTS, "push:0.4")


@pytest.fixture(scope="module")
def demos():
    return synthetic_letters(7, letters="sv", dt=0.02)


@pytest.fixture(scope="module")
def members(demos):
    return [d for d in demos if d.label == "s"]


@pytest.fixture(scope="module")
def experiment():
    return Experiment(train=3, test=3)


def same(one, other):
    return all(np.array_equal(a.positions, b.positions, equal_nan=True) for a, b in zip(one, other, strict=True))


# --- the split --------------------------------------------------------------------------------------------------------


@given(st.integers(0, 2**32), st.integers(1, 5), st.integers(1, 2))
def test_training_and_tests_share_no_demonstration(seed, train, test):
    members = synthetic_letters(7, letters="v", dt=0.05)
    (trial,) = draw_trials(members, Experiment(train, test, seed))
    chosen = [id(d) for d in trial.training + trial.tests]
    assert (len(trial.training), len(trial.tests)) == (train, test)
    assert len(set(chosen)) == train + test
    assert set(chosen) <= {id(d) for d in members}


def test_the_seed_decides(members, experiment):
    (one,), (again,), (other,) = (draw_trials(members, replace(experiment, seed=seed)) for seed in (1, 1, 2))
    assert [id(d) for d in one.training] == [id(d) for d in again.training]
    assert one.onsets == again.onsets
    assert same(one.faulty["hold"], again.faulty["hold"])
    assert [id(d) for d in one.training] != [id(d) for d in other.training] or one.onsets != other.onsets


def test_every_demonstration_may_come_into_either_part(members, experiment):
    trials = [draw_trials(members, replace(experiment, seed=seed))[0] for seed in range(60)]
    for d in members:
        share = np.mean([any(d is t for t in trial.training) for trial in trials])
        assert 0.15 < share < 0.75  # three of seven: 0.43


def test_labels_draw_differently(members, experiment):
    trials = draw_trials([replace(d, label=label) for label in "abcd" for d in members], experiment)
    assert [trial.label for trial in trials] == list("abcd")
    orders = {tuple(next(k for k in range(7) if same([d], [members[k]])) for d in trial.training) for trial in trials}
    assert len(orders) > 1


# --- the faults -------------------------------------------------------------------------------------------------------


@settings(max_examples=20)
@given(st.integers(0, 2**32))
def test_faults_begin_in_the_middle_and_change_nothing_before(seed):
    members = synthetic_letters(4, letters="v", dt=0.02)
    (trial,) = draw_trials(members, Experiment(2, 2, seed))
    for test, onset, faulty in zip(trial.tests, trial.onsets["hold"], trial.faulty["hold"], strict=True):
        assert 0.3 - 1 / test.n_samples <= onset / test.n_samples <= 0.7
        np.testing.assert_array_equal(faulty.positions[:onset], test.positions[:onset])
        deviation = (faulty.positions[onset:] - test.positions[onset - 1]) / noise_stds(test.positions)
        assert np.abs(deviation).max() < 6
        assert (faulty.dt, faulty.label, faulty.n_samples) == (test.dt, test.label, test.n_samples)


def test_every_test_has_every_fault(demos, experiment):
    for trial in draw_trials(demos, replace(experiment, faults=ALL)):
        assert list(trial.onsets) == list(trial.faulty) == list(ALL)
        assert list(trial.executions) == [UNDISTURBED, *ALL]
        for fault in ALL:
            for test, onset, faulty in zip(trial.tests, trial.onsets[fault], trial.faulty[fault], strict=True):
                assert (onset == 0) == (fault == "wrong_class")
                np.testing.assert_array_equal(faulty.positions[:onset], test.positions[:onset])
                np.testing.assert_allclose(faulty.positions[0], test.positions[0], atol=1e-9)
                assert (faulty.dt, faulty.label, faulty.names) == (test.dt, test.label, test.names)


def test_a_fault_does_not_depend_on_the_others(demos, experiment):
    together = draw_trials(demos, replace(experiment, faults=ALL))
    for fault in ALL:
        for trial, alone in zip(together, draw_trials(demos, replace(experiment, faults=(fault,))), strict=True):
            assert trial.onsets[fault] == alone.onsets[fault]
            assert same(trial.faulty[fault], alone.faulty[fault])


def test_sizes_of_one_fault_differ_in_size_alone(demos, experiment):
    for trial in draw_trials(demos, replace(experiment, faults=("push", "push:0.5"))):
        assert trial.onsets["push"] == trial.onsets["push:0.5"]
        for test, once, twice in zip(trial.tests, trial.faulty["push"], trial.faulty["push:0.5"], strict=True):
            np.testing.assert_allclose(twice.positions - test.positions, 2 * (once.positions - test.positions), atol=1e-9)


def test_faults_begin_at_different_moments(demos, experiment):
    (trial, _) = draw_trials(demos, replace(experiment, faults=("hold", "push", "slow")))
    assert len({tuple(onsets) for onsets in trial.onsets.values()}) == 3


def test_a_class_does_not_depend_on_the_others(demos, members, experiment):
    chosen = replace(experiment, faults=tuple(name for name in ALL if name != "wrong_class"))
    (alone,) = draw_trials(members, chosen)
    for order in (demos, demos[::-1]):
        trials = {trial.label: trial for trial in draw_trials([*members, *[d for d in order if d.label == "v"]], chosen)}
        assert trials["s"].onsets == alone.onsets
        for name, executions in alone.executions.items():
            assert same(trials["s"].executions[name], executions)


def test_another_movement_is_a_test_of_another_class(demos, experiment):
    first, second = draw_trials(demos, replace(experiment, faults=("wrong_class",)))
    for trial, other in ((first, second), (second, first)):
        paths = [d.positions - d.positions[0] for d in other.tests]
        for faulty in trial.faulty["wrong_class"]:
            path = faulty.positions - faulty.positions[0]
            assert any(len(path) == len(p) and np.allclose(path, p) for p in paths)


@pytest.mark.parametrize("change", [{"dt": 0.03}, {"positions": np.zeros((9, 3)), "names": ()}])
def test_another_movement_must_be_recorded_alike(members, experiment, change):
    others = [replace(d, label="other", **change) for d in members]
    with pytest.raises(TooFewDemonstrationsError, match="executions of another class with the same rate"):
        draw_trials([*members, *others], replace(experiment, faults=("wrong_class",)))


def test_sensor_channels_go_along_with_a_fault(experiment):
    """As long as the movement that was made of it; its positions are as those of executions without channels."""
    walks = np.random.default_rng(0).standard_normal((6, 30, 2)).cumsum(axis=1)
    bare = [Demonstration(walk, 0.01, "w") for walk in walks]
    felt = [replace(d, channels={"force": d.positions[:, 0] + 2}) for d in bare]
    names = tuple(name for name in ALL if name != "wrong_class")
    (trial,), (without,) = (draw_trials(given, replace(experiment, faults=names)) for given in (felt, bare))
    assert trial.onsets == without.onsets
    for name in names:
        assert same(trial.faulty[name], without.faulty[name])
        for test, faulty, onset in zip(trial.tests, trial.faulty[name], trial.onsets[name], strict=True):
            assert faulty.channels["force"].shape == (faulty.n_samples,)
            np.testing.assert_array_equal(faulty.channels["force"][:onset], test.channels["force"][:onset])


def test_faults_of_channels_leave_the_movement_as_it_is(experiment):
    walks = np.random.default_rng(0).standard_normal((6, 30, 2)).cumsum(axis=1)
    felt = [Demonstration(walk, 0.01, "w", channels={"force": walk[:, 0] + 2}) for walk in walks]
    (trial,) = draw_trials(felt, replace(experiment, faults=("lift", "press", "press:0.8")))
    assert trial.onsets["press"] == trial.onsets["press:0.8"] != trial.onsets["lift"]
    for executions in trial.faulty.values():
        assert same(executions, trial.tests)
        for test, faulty in zip(trial.tests, executions, strict=True):
            assert np.any(faulty.channels["force"] != test.channels["force"])
    for test, once, twice in zip(trial.tests, trial.faulty["press"], trial.faulty["press:0.8"], strict=True):
        added, doubled = (d.channels["force"] - test.channels["force"] for d in (once, twice))
        np.testing.assert_allclose(doubled, 2 * added, atol=1e-9)


# --- what is commanded ------------------------------------------------------------------------------------------------


def test_known_and_nominal_tasks(members):
    primitive = make_primitive(np.random.default_rng(0))
    for d, task in zip(members, commanded_tasks(primitive, members, "known"), strict=True):
        np.testing.assert_array_equal([task.start, task.goal], d.positions[[0, -1]])
        assert task.duration == d.duration
    for d, task in zip(members, commanded_tasks(primitive, members, "nominal"), strict=True):
        np.testing.assert_array_equal([task.start, primitive.goals(task)], [d.positions[0], primitive.goal])
        assert np.isnan(task.goal).all()  # not told
        assert task.duration == primitive.duration
