"""Many executions judged at once, and each of them shown to a monitor tick by tick: the same verdicts."""

from dataclasses import replace

import numpy as np
import pytest
from detection.verdicts import assert_same, run_online, task_of
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import seeds

from probdmp import FailureDetector
from probdmp.demonstrations import Demonstration, fault_named
from probdmp.detection import BatchJudgement
from probdmp.detection.calibration import Calibration
from probdmp.dmp import stack_tasks, task_for, unstack_tasks
from probdmp.errors import InputError
from probdmp.execution import ExecutionBatch

FAULTS = ("hold", "hold_release", "slow", "push:0.5", "dropout", "stuck_sensor", "spikes", "drift", "wrong_goal")
TEXTS = ("kinds", "causes", "channels", "betters", "blamed")


def looped(detector, primitive, batch):
    """What a monitor says in the end of each execution, by itself."""
    verdicts = []
    for values, task in zip(batch.observations, unstack_tasks(batch.tasks), strict=True):
        execution, _ = run_online(primitive, task, Demonstration(values, batch.dt), detector)
        verdicts.append(execution.verdict)
    return BatchJudgement.of(verdicts)


def assert_agree(one, other):
    for name in ("failed", "steps", "is_stale", "has_sensor_fault", *TEXTS):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), name)
    for name in ("times", "phases", "test_ratios"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-9, atol=1e-12, err_msg=name)


def faulty(positions, fault, rng):
    """Positions with a fault somewhere, and to their old length."""
    onset = int(rng.integers(len(positions) // 10, 9 * len(positions) // 10))
    changed = fault_named(fault)(np.array(positions), onset, rng, [])
    return np.concatenate([changed, np.repeat(changed[-1:], max(len(positions) - len(changed), 0), axis=0)])[: len(positions)]


def lost(positions, rng, share):
    """With samples that were not measured, one by one and in a row; perhaps from the first on."""
    lossy = np.array(positions)
    lossy[rng.random(lossy.shape) < share] = np.nan
    begin = int(rng.integers(-len(lossy), len(lossy)))
    lossy[max(begin, 0) : max(begin + int(rng.integers(1, 40)), 0), int(rng.integers(2))] = np.nan
    return lossy


def batch_of(primitive, recordings, rng, told, alike=True):
    """Executions of equal length, told their goal or not, with durations of their own unless alike."""
    length, dt = min(len(d.positions) for d in recordings), recordings[0].dt
    values = np.stack([d.positions[:length] for d in recordings])
    tasks = []
    for row in values:
        seen = [column[~np.isnan(column)] for column in row.T]
        goal = [column[-1] if len(column) else 0.0 for column in seen] if told else None
        duration = (length - 1) * dt * (1.0 if alike else rng.uniform(0.7, 1.3)) if told or not alike else None
        tasks.append(task_for(primitive, row[0], goal, duration))
    return ExecutionBatch(values, stack_tasks(tasks), dt)


@settings(max_examples=8)
@given(
    seeds,
    st.sampled_from("asl"),
    st.booleans(),
    st.booleans(),
    st.lists(st.sampled_from(("fine", "lost", *FAULTS)), min_size=1, max_size=4),
)
def test_side_by_side_is_tick_by_tick(calibrated, varied, fresh, seed, letter, told, alike, kinds):
    rng = np.random.default_rng(seed)
    chosen = [d for d in fresh if d.label == letter]
    recordings = []
    for kind in kinds:
        d = chosen[rng.integers(len(chosen))]
        positions = d.positions + rng.normal(0, 1e-3, d.positions.shape) * varied[letter].primitive_.ranges
        changed = lost(positions, rng, 0.1) if kind == "lost" else positions if kind == "fine" else faulty(positions, kind, rng)
        recordings.append(replace(d, positions=changed))
    batch = batch_of(varied[letter].primitive_, recordings, rng, told, alike)
    found = calibrated.judge(varied[letter].primitive_, batch)
    assert_agree(found, looped(calibrated, varied[letter].primitive_, batch))


def many(varied, fresh, rng, n, noise=0.01):
    """Executions of one letter that mostly go well."""
    chosen, primitive = [d for d in fresh if d.label == "s"], varied["s"].primitive_
    length = min(len(d.positions) for d in chosen)
    lean = np.linspace(0, 1, length)[:, None]
    recordings = [
        replace(
            d,
            positions=d.positions[:length]
            + primitive.ranges * (lean * rng.normal(0, 3 * noise, 2) + rng.normal(0, noise / 10, (length, 2))),
        )
        for d in (chosen[k % len(chosen)] for k in range(n))
    ]
    return primitive, recordings


@pytest.mark.parametrize("persistence", [1, 3])
@pytest.mark.parametrize("told", [True, False])
def test_many_at_once_are_judged_as_a_few(varied, training, fresh, persistence, told):
    """More than fit beside one another, some of them failing; any threshold, so that many are near it."""
    rng = np.random.default_rng(persistence)
    detector = FailureDetector(0.3, persistence=persistence).fit(varied["s"], training["s"])
    primitive, recordings = many(varied, fresh, rng, 18, 0.02)
    batch = batch_of(primitive, recordings, rng, told)
    found = detector.judge(primitive, batch)
    assert 0 < found.failed.mean() < 1
    assert_agree(found, looped(detector, primitive, batch))
    for k in (0, 7, 17):
        tasks = stack_tasks(unstack_tasks(batch.tasks)[k : k + 1])
        alone = detector.judge(primitive, ExecutionBatch(batch.observations[k : k + 1], tasks, batch.dt))
        assert_agree(BatchJudgement(*(values[k : k + 1] for values in found)), alone)


def test_told_and_not_told_may_be_mixed(calibrated, varied, fresh):
    rng = np.random.default_rng(0)
    primitive, recordings = many(varied, fresh, rng, 6)
    told, untold = (unstack_tasks(batch_of(primitive, recordings, rng, t).tasks) for t in (True, False))
    mixed = [told[k] if k % 2 else untold[k] for k in range(6)]
    batch = batch_of(primitive, recordings, rng, True)
    found = calibrated.judge(primitive, ExecutionBatch(batch.observations, stack_tasks(mixed), batch.dt))
    assert_agree(found, looped(calibrated, primitive, ExecutionBatch(batch.observations, stack_tasks(mixed), batch.dt)))


def test_only_primitives_that_it_was_fitted_to_are_judged(alone, varied, fresh):
    primitive, recordings = many(varied, fresh, np.random.default_rng(0), 2)
    batch = batch_of(primitive, recordings, np.random.default_rng(0), True)
    with pytest.raises(InputError, match="a primitive that this detector was fitted to"):
        alone.judge(varied["a"].primitive_, batch)


@pytest.mark.parametrize("options", [{"rule": "paper"}, {"statistic": "nis"}, {"rule": "paper", "likelihood": "cumulative"}])
def test_rules_that_ask_the_filter_say_the_same_of_a_batch(varied, training, fresh, options):
    rng = np.random.default_rng(0)
    detector = FailureDetector(0.1, **options).fit(varied["s"], training["s"])
    primitive, recordings = many(varied, fresh, rng, 4)
    recordings[1] = replace(recordings[1], positions=faulty(recordings[1].positions, "push:0.5", rng))
    batch = batch_of(primitive, recordings, rng, True)
    assert_agree(detector.judge(primitive, batch), looped(detector, primitive, batch))


def test_verdicts_on_recordings_of_any_length_are_those_online(calibrated, varied, executions):
    recordings = [d for kind in ("fine", "hold", "slow", "dropout", "lost") for d in executions[kind][1:3]]
    tasks = [task_of(varied[d.label].primitive_, d, k % 2 == 0) for k, d in enumerate(recordings)]
    for d, task, verdict in zip(recordings, tasks, calibrated.verdicts(recordings, tasks=tasks), strict=True):
        execution, _ = run_online(varied[d.label].primitive_, task, d, calibrated)
        assert_same(execution.verdict, verdict, rtol=1e-9)


@given(seeds, st.integers(2, 200))
def test_what_is_smaller_than_the_least_value_is_less_surprising(seed, n):
    """And no value is left out that is as surprising, whether by rank or in the tail, ties included."""
    rng = np.random.default_rng(seed)
    maxima = np.exp(rng.standard_normal((n, 2)) * 2).round(int(rng.integers(0, 4)))
    calibration = Calibration(maxima, ["a"] * n, 0.05, "held_out", [0.0, 1.0], [0.5, 0.0])
    values = np.concatenate([maxima, np.exp(rng.standard_normal((50, 2)) * 3), np.zeros((1, 2))])
    surprises = calibration.surprise(values)
    for wanted in np.unique(surprises[surprises > 0]):
        least = calibration.least_values(np.array([wanted]))[0]
        assert np.all(values[surprises >= wanted] >= np.broadcast_to(least, values.shape)[surprises >= wanted])
        assert np.all(surprises[values < least * (1 - 1e-6)] < wanted)
