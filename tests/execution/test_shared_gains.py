"""Executions that share their gains: the same as each of them by itself, whatever is told, measured and missed."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_joint_primitive, make_primitive, random_sensors, seeds

from probdmp.dmp import Task, stack_tasks, task_for, unstack_tasks
from probdmp.dmp.joint_model import joint_executions
from probdmp.errors import InputError
from probdmp.execution import (
    ExecutionBatch,
    LinearSensor,
    SensorArray,
    filter_recordings,
    recording_of_readings,
    sample_recordings,
    score_batch,
)
from probdmp.execution.gain_schedule import gain_schedule
from probdmp.execution.joint_steps import JointFilter
from probdmp.execution.plans import planned_states
from probdmp.execution.readings import readings_of

DT = 0.02


def random_batch(rng, primitive, array, n_executions, missing):
    """Executions that are told different things, some of which miss readings."""
    d = primitive.n_dof
    starts = primitive.start + 0.1 * rng.standard_normal((n_executions, d))
    goals = np.where(rng.random((n_executions, 1)) < 0.5, primitive.goal + 0.1 * rng.standard_normal((n_executions, d)), np.nan)
    starts[rng.random(n_executions) < 0.3] = np.nan
    velocities = np.where(rng.random((n_executions, 1)) < 0.3, rng.standard_normal((n_executions, d)), np.nan)
    durations = primitive.duration * rng.choice([1.0, 1.25], n_executions)
    tasks = Task(starts, goals, durations, velocities)
    readings = [readings_of(array, sample_recordings(primitive, task, DT, 1, rng, array)[0]) for task in unstack_tasks(tasks)]
    shortest = min(map(len, readings))
    observations = np.stack([reading[:shortest] for reading in readings])
    observations[rng.random(observations.shape) < missing * (rng.random((n_executions, 1, 1)) < 0.5)] = np.nan
    return ExecutionBatch(observations, tasks, DT)


def scores_of_each(primitive, batch, array):
    recordings = list(batch.recordings(array))
    return [
        filter_recordings(primitive, [task], [recording], array).log_likelihoods.sum()
        for task, recording in zip(unstack_tasks(batch.tasks), recordings, strict=True)
    ]


@settings(max_examples=8)
@given(seeds, st.sampled_from([0.0, 0.05]), st.sampled_from(["independent", "joint", "scaled"]))
def test_a_score_is_that_of_the_execution_by_itself(seed, missing, kind):
    rng = np.random.default_rng(seed)
    if kind == "joint":
        primitive = make_joint_primitive(rng)
    else:
        primitive = make_primitive(rng, scaling="paper" if kind == "scaled" else "none")
    array = SensorArray(primitive)
    batch = random_batch(rng, primitive, array, 16, missing)
    expected = np.array(scores_of_each(primitive, batch, array))
    np.testing.assert_allclose(score_batch(primitive, batch, array), expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())


@settings(max_examples=6)
@given(seeds, st.booleans(), st.sampled_from([(), ("force",)]))
def test_scores_through_sensors_of_any_linear_kind(seed, coupling, channels):
    rng = np.random.default_rng(seed)
    primitive = make_joint_primitive(rng, channels=channels)
    array = SensorArray(primitive, random_sensors(rng, primitive, DT, 2, coupling=coupling))
    batch = random_batch(rng, primitive, array, 8, 0.0)
    expected = np.array(scores_of_each(primitive, batch, array))
    np.testing.assert_allclose(score_batch(primitive, batch, array), expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())


@given(seeds, st.sampled_from([False, True, "noise"]))
@settings(max_examples=8)
def test_one_product_or_one_recursion_is_the_same(seed, coupling):
    rng = np.random.default_rng(seed)
    primitive = make_joint_primitive(rng)
    array = SensorArray(primitive, random_sensors(rng, primitive, DT, 2, coupling=coupling))
    batch = random_batch(rng, primitive, array, 16, 0.0)
    by_product = score_batch(primitive, batch, array)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("probdmp.execution.scoring.LARGEST_GAUSSIAN", 0)
        np.testing.assert_allclose(score_batch(primitive, batch, array), by_product, rtol=1e-9, atol=1e-9)


@given(seeds, st.sampled_from(["predictive", "posterior"]), st.sampled_from([(), ("force",)]))
@settings(max_examples=8)
def test_positions_by_themselves_or_one_recursion_for_all_is_the_same(seed, forcing_noise, channels):
    rng = np.random.default_rng(seed)
    primitive = make_joint_primitive(rng, channels=channels, forcing_noise=forcing_noise)
    array, task = SensorArray(primitive), task_for(primitive, goal=primitive.goal)
    tasks = stack_tasks([task] * 5)
    recordings = sample_recordings(primitive, task, DT, 5, rng, array)
    batch = ExecutionBatch(np.stack([readings_of(array, recording) for recording in recordings]), tasks, DT)
    n_ticks = batch.observations.shape[1]
    plan = planned_states(joint_executions(primitive, tasks, np.array([DT]), n_ticks)).reshape(n_ticks, 5, -1)
    schedule = gain_schedule(primitive, stack_tasks([task]), DT, array, np.ones((n_ticks, len(array.outputs)), dtype=np.bool_))
    expected = schedule.log_likelihoods(batch.observations - (plan @ array.dense_matrix.T).swapaxes(0, 1))
    np.testing.assert_allclose(score_batch(primitive, batch, array), expected, rtol=1e-9, atol=1e-9)


def test_outputs_that_say_nothing_change_nothing():
    rng = np.random.default_rng(5)
    primitive = make_joint_primitive(rng)
    position = np.kron(np.eye(2), [0.0, 0.0, 1.0])
    precise, silent = np.diag([1e-4, 1e-4]), np.diag([1e-4, np.inf])
    alone = SensorArray(primitive, [LinearSensor("one", position[:1], precise[:1, :1])])
    both = SensorArray(primitive, [LinearSensor("two", position, silent)])
    batch = random_batch(rng, primitive, SensorArray(primitive, [LinearSensor("two", position, precise)]), 8, 0.0)
    of_one = ExecutionBatch(np.ascontiguousarray(batch.observations[..., :1]), batch.tasks, DT)
    np.testing.assert_allclose(score_batch(primitive, batch, both), score_batch(primitive, of_one, alone), rtol=1e-12)


@settings(max_examples=15)
@given(seeds, st.booleans(), st.sampled_from([(), ("force",)]), st.sampled_from([0.0, 0.03]))
def test_innovations_of_a_schedule_are_those_of_the_filter(seed, coupling, channels, missing):
    rng = np.random.default_rng(seed)
    primitive = make_joint_primitive(rng, channels=channels)
    sensors = random_sensors(rng, primitive, DT, 2, coupling=coupling) if rng.integers(2) else None
    array, task = SensorArray(primitive, sensors), stack_tasks([task_for(primitive)])
    recording = sample_recordings(primitive, unstack_tasks(task)[0], DT, 1, rng, array)[0]
    readings = readings_of(array, recording)
    readings[rng.random(readings.shape) < missing] = np.nan
    schedule = gain_schedule(primitive, task, DT, array, ~np.isnan(readings))
    plan = planned_states(joint_executions(primitive, task, np.array([DT]), len(readings)))
    found = schedule.innovations(readings[:, None] - plan.reshape(len(plan), 1, -1) @ schedule.sensors.T)
    names = {name: readings[:, part] for name, part in array.slices.items()}
    expected = filter_recordings(primitive, unstack_tasks(task), [recording_of_readings(array, names, DT)], array)
    fused = expected.fused[:, 0]
    np.testing.assert_array_equal(schedule.fused, fused)
    np.testing.assert_allclose(found[:, 0][fused], expected.innovations[:, 0][fused], rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(schedule.innovation_covariances, expected.innovation_covariances[:, 0], rtol=1e-9, atol=1e-15)


@settings(max_examples=15)
@given(seeds, st.booleans(), st.sampled_from([(), ("force",)]), st.sampled_from([None, 0, 1, 17, 30]))
def test_ticks_are_those_of_the_recording(seed, coupling, channels, gap):
    """Whatever the sensors, whichever reading is missed, and after the end of what was prepared."""
    rng = np.random.default_rng(seed)
    primitive = make_joint_primitive(rng, channels=channels)
    sensors = random_sensors(rng, primitive, DT, 2, coupling=coupling) if rng.integers(2) else None
    array, task, chunk = SensorArray(primitive, sensors), task_for(primitive), 20
    recording = sample_recordings(primitive, task, DT, 1, rng, array)[0]
    readings = readings_of(array, recording)
    if gap is not None:
        readings[min(gap, len(readings) - 1), 0] = np.nan
    names = {name: readings[:, part] for name, part in array.slices.items()}
    expected = filter_recordings(primitive, [task], [recording_of_readings(array, names, DT)], array)
    filtering = JointFilter(primitive, task, DT, chunk, array)
    for t, reading in enumerate(readings):
        tick = filtering.step(reading)
        np.testing.assert_array_equal(tick.fused, expected.fused[t, 0])
        assert tick.n_fused == tick.fused.sum()
        np.testing.assert_allclose(tick.innovations, expected.innovations[t, 0], rtol=1e-7, atol=1e-9 * array.scales.max())
        np.testing.assert_allclose(tick.innovation_covariance, expected.innovation_covariances[t, 0], rtol=1e-8, atol=1e-15)
        np.testing.assert_allclose(tick.contributions, expected.log_likelihoods[t, 0], rtol=1e-6, atol=1e-6)
        if t in (0, chunk - 1, chunk, len(readings) - 2):  # the state of the next tick, of which nothing was measured yet
            so_far = {name: np.where(np.arange(len(readings))[:, None] <= t, own, np.nan) for name, own in names.items()}
            ahead = filter_recordings(primitive, [task], [recording_of_readings(array, so_far, DT)], array).filtered
            mean, covariance = ahead.means[t + 1, 0], ahead.covariances[t + 1, 0]
            scale = np.abs(mean).max(axis=0) + np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).max(axis=0)
            assert np.all(np.abs(tick.mean - mean) <= 1e-8 * scale)
            np.testing.assert_allclose(tick.covariance, covariance, rtol=1e-8, atol=1e-12)


def test_schedules_are_kept():
    primitive = make_joint_primitive(np.random.default_rng(0))
    array, task = SensorArray(primitive), stack_tasks([task_for(primitive)])
    elsewhere = stack_tasks([task_for(primitive, primitive.start + 1)])
    seen = np.ones((20, 2), dtype=np.bool_)
    schedule = gain_schedule(primitive, task, DT, array, seen)
    assert gain_schedule(primitive, elsewhere, DT, array, seen) is schedule
    for other in (
        gain_schedule(primitive, stack_tasks([task_for(primitive, goal=primitive.goal)]), DT, array, seen),
        gain_schedule(primitive, stack_tasks([task_for(primitive, duration=2 * primitive.duration)]), DT, array, seen),
        gain_schedule(primitive, task, DT / 2, array, seen),
        gain_schedule(primitive, task, DT, array, seen[:10]),
        gain_schedule(primitive, task, DT, array, seen & (np.arange(20) != 3)[:, None]),
        gain_schedule(make_joint_primitive(np.random.default_rng(1)), task, DT, array, seen),
    ):
        assert other is not schedule


def test_threads_score_at_the_same_time():
    rng = np.random.default_rng(3)
    primitives = [make_joint_primitive(rng) for _ in range(3)]
    work = [(p, random_batch(rng, p, SensorArray(p), 12, 0.0)) for p in primitives] * 8
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda one: score_batch(*one), work))
    for scores, one in zip(found, work, strict=True):
        np.testing.assert_array_equal(scores, score_batch(*one))


def test_no_executions_have_no_scores():
    primitive = make_joint_primitive(np.random.default_rng(0))
    nothing = np.empty((0, 2))
    assert score_batch(primitive, ExecutionBatch(np.empty((0, 30, 2)), Task(nothing, nothing, np.empty(0)), DT)).shape == (0,)


def test_a_batch_that_does_not_fit_is_refused():
    two = np.zeros((2, 2))
    with pytest.raises(InputError, match="one task for each of 3 executions"):
        ExecutionBatch(np.zeros((3, 30, 2)), Task(two, two, np.ones(2)), DT)
    primitive = make_joint_primitive(np.random.default_rng(0))
    observations = np.zeros((2, 30, 2))
    observations[0, 3, 1] = np.inf
    with pytest.raises(InputError):
        score_batch(primitive, ExecutionBatch(observations, Task(two, two, np.ones(2)), DT))
    with pytest.raises(InputError, match="outputs"):
        score_batch(primitive, ExecutionBatch(np.zeros((2, 30, 3)), Task(two, two, np.ones(2)), DT))
