""" "Failure Detection with Probabilistic DMPs": the minimum likelihood of the training demonstrations, and twice that."""

from dataclasses import replace

import numpy as np
import pytest
from paper import equations as paper

from probdmp import FailureDetector, synthetic_letters
from probdmp.demonstrations import FAULTS, noise_stds
from probdmp.detection.thresholds import PaperThreshold
from probdmp.dmp import Configuration, task_for
from probdmp.evaluation import Experiment, illustrate
from probdmp.learning import LearningOptions, fit_primitive

LIKELIHOODS = ("per_step", "cumulative")


def statistic_by_hand(primitive, recording, likelihood, goal=None, duration=None):
    """The log-likelihood of an execution by Algorithm 2 in plain loops, positions in units of their range; its own task."""
    goal = recording.positions[-1] if goal is None else goal
    duration = recording.duration if duration is None else duration
    values = np.zeros(len(recording.positions))
    for d in range(primitive.n_dof):
        p, r = recording.positions[:, d], primitive.ranges[d]
        model = paper.system(primitive, d, p[0], goal[d], duration, recording.dt, len(p))
        values += paper.algorithm_2(model, p).log_likelihoods + np.log(r)  # density of p / r
    return np.cumsum(values) if likelihood == "cumulative" else values


def own_tasks(primitive, recordings):
    """Start, goal and duration of each recording, as commanded."""
    return [task_for(primitive, r.positions[0], r.positions[-1], r.duration) for r in recordings]


def fitted(primitive, training, likelihood):
    """The paper's detector."""
    return FailureDetector(rule="paper", likelihood=likelihood).fit(primitive, training, tasks=own_tasks(primitive, training))


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_the_minimum_of_the_training_demonstrations_is_stored(learned, letters, likelihood):
    """We measure the minimum likelihood of each training demonstration given the learned model parameters, and store that."""
    primitive, training = learned.primitive_, letters["a"][:10]
    detector = fitted(primitive, training, likelihood)
    by_hand = min(statistic_by_hand(primitive, recording, likelihood).min() for recording in training)
    (threshold,) = detector.rule_.thresholds.values()
    assert threshold.minimum == pytest.approx(by_hand, rel=1e-9)


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_unless_told_the_tasks_a_detector_knows_what_an_execution_knows(learned, letters, likelihood):
    """Ours: the start of each recording, the learned goal and duration, as `execute(start=...)` has them."""
    primitive, training = learned.primitive_, letters["a"][:10]
    detector = FailureDetector(rule="paper", likelihood=likelihood).fit(primitive, training)
    by_hand = min(statistic_by_hand(primitive, r, likelihood, primitive.goal, primitive.duration).min() for r in training)
    (threshold,) = detector.rule_.thresholds.values()
    assert threshold.minimum == pytest.approx(by_hand, rel=1e-9)
    d = letters["a"][11]
    held = replace(d, positions=FAULTS["hold"](d.positions, len(d.positions) // 2, np.random.default_rng(1)))
    for recording in (d, held):
        (verdict,) = detector.verdicts([recording])
        execution = learned.execute(start=recording.positions[0], dt=recording.dt, detector=detector)
        for o in recording.positions:
            execution.step(o)
        assert (execution.verdict.failed, execution.verdict.step) == (verdict.failed, verdict.step)
        assert execution.verdict.test_ratio == pytest.approx(verdict.test_ratio, rel=1e-9)


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_failed_if_at_any_point_below_twice_the_minimum(learned, letters, likelihood):
    """We classify an execution as failed if at any point the loglikelihood drops below 2 times the minimum reported value."""
    primitive, training = learned.primitive_, letters["a"][:10]
    detector = fitted(primitive, training, likelihood)
    (threshold,) = detector.rule_.thresholds.values()
    rng, executions = np.random.default_rng(0), list(letters["a"][10:])
    executions += [replace(d, positions=FAULTS["hold"](d.positions, len(d.positions) // 2, rng)) for d in letters["a"][10:]]
    tasks = own_tasks(primitive, executions)
    verdicts = detector.verdicts(executions, tasks=tasks)
    below = [statistic_by_hand(primitive, execution, likelihood) < threshold.level for execution in executions]
    assert [verdict.failed for verdict in verdicts] == [bool(row.any()) for row in below]
    np.testing.assert_array_equal(detector.predict(executions, tasks=tasks), [-1 if row.any() else 1 for row in below])
    for verdict, row in zip(verdicts, below, strict=True):
        if verdict.failed:
            assert verdict.step == np.argmax(row)  # the first such point


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_monitoring_is_online(learned, letters, likelihood):
    """While executing we continuously monitor how likely it is that this primitive generates the measured state."""
    primitive, training = learned.primitive_, letters["a"][:10]
    detector = fitted(primitive, training, likelihood)
    d = letters["a"][11]
    held = replace(d, positions=FAULTS["hold"](d.positions, len(d.positions) // 2, np.random.default_rng(1)))
    task = task_for(primitive, d.positions[0], d.positions[-1], d.duration)
    (verdict,) = detector.verdicts([held], tasks=[task])
    execution = learned.execute(start=d.positions[0], goal=d.positions[-1], duration=d.duration, dt=d.dt, detector=detector)
    ratios = []
    for t, o in enumerate(held.positions):
        ratios.append(execution.step(o).test_ratio)
        assert execution.failed == any(ratio > 1 for ratio in ratios)
        if execution.failed:
            assert verdict.failed
            assert t >= verdict.step
    assert execution.failed == verdict.failed
    assert execution.verdict.step == verdict.step


@pytest.mark.parametrize("minimum", [-0.5, -3.0, -1e4])
def test_twice_a_negative_minimum(minimum):
    """2 times the minimum reported value, where that is negative."""
    threshold = PaperThreshold(minimum)
    assert threshold.level == 2 * minimum
    assert threshold.test_ratio(2 * minimum * 1.001) > 1
    assert threshold.test_ratio(2 * minimum * 0.999) < 1
    for ll in (0.1 * minimum, minimum, 7 * minimum):
        assert threshold.test_ratio(ll) == pytest.approx(ll / (2 * minimum), rel=1e-14)
    assert threshold.test_ratio(-minimum) == 0


@pytest.mark.parametrize("minimum", [0.5, 3.0, 1e4])
def test_twice_a_positive_minimum_would_fail_the_training_demonstrations(minimum):
    """Read literally the rule inverts: 2 m > m, so the demonstration that set m has failed. Ours: minimum - |minimum|."""
    threshold = PaperThreshold(minimum)
    assert minimum < 2 * minimum  # as printed: failed
    assert threshold.test_ratio(minimum) == 0  # ours: fine
    assert threshold.level == 0
    assert threshold.test_ratio(-0.001 * minimum) > 1
    for ll in (0.3 * minimum, 0.0, -5 * minimum):
        assert threshold.test_ratio(ll) == pytest.approx((minimum - ll) / minimum, rel=1e-14)


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_no_training_demonstration_is_called_failed(learned, letters, likelihood):
    """What the rule guarantees whatever the sign: the threshold lies at or below every demonstration it was made from."""
    training = letters["a"][:10]
    detector = fitted(learned.primitive_, training, likelihood)
    assert np.all(detector.predict(training, tasks=own_tasks(learned.primitive_, training)) == 1)


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_the_rule_does_not_depend_on_units(letters, unit):
    """Ours: densities have units (ln p of metres and of millimetres differ by ln 1000), so positions are taken in ranges."""
    rng = np.random.default_rng(2)
    held = [replace(d, positions=FAULTS["hold"](d.positions, len(d.positions) // 2, rng)) for d in letters["a"][10:]]
    outcomes = []
    for factor in (1.0, unit):
        training, executions = (
            [replace(d, positions=factor * d.positions) for d in group]
            for group in (letters["a"][:10], [*letters["a"][10:], *held])
        )
        primitive, _ = fit_primitive(training, Configuration(), LearningOptions())
        detector = fitted(primitive, training, "per_step")
        verdicts = detector.verdicts(executions, tasks=own_tasks(primitive, executions))
        (threshold,) = detector.rule_.thresholds.values()
        outcomes.append((threshold.minimum, [(v.failed, v.step) for v in verdicts], [v.test_ratio for v in verdicts]))
    (minimum, steps, ratios), (scaled_minimum, scaled_steps, scaled_ratios) = outcomes
    assert scaled_minimum == pytest.approx(minimum, rel=1e-3, abs=1e-3)
    assert scaled_steps == steps
    np.testing.assert_allclose(scaled_ratios, ratios, rtol=1e-2, atol=1e-3)


def test_hold_blocks_the_execution(letters):
    """ "We artificially hold the movement": recorded as it is up to the onset, then at one place, seen by the same sensor."""
    d, onset = letters["a"][0], 50
    held = FAULTS["hold"](d.positions, onset, np.random.default_rng(0))
    np.testing.assert_array_equal(held[:onset], d.positions[:onset])
    noise = held[onset:] - d.positions[onset - 1]
    np.testing.assert_allclose(noise.std(axis=0), noise_stds(d.positions), rtol=0.4)
    assert not np.any(noise == 0)


def test_the_likelihood_drops_once_the_movement_is_held():
    """ "Note, how once we artificially hold the movement the likelihood value significantly drops." (Figure)

    The figure's own case in five letters: up to the onset the two executions are one; after it the held one falls below the
    other's minimum by more than the whole spread that the undisturbed likelihood has.
    """
    experiment, drops = Experiment(train=10, test=2), []
    for letter in "aglpv":
        shown = illustrate(synthetic_letters(12, letters=letter), experiment)
        onset = round(shown.onset / shown.undisturbed.recording.dt)
        free, held = shown.undisturbed.statistic, shown.disturbed.statistic
        np.testing.assert_array_equal(held[:onset], free[:onset])
        drops.append((free.min() - held[onset:].min()) / np.ptp(free))
    assert min(drops) > 1
