"""Filtering recorded executions: default tasks, batches, gaps."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_primitive, primitives, seeds

from probdmp.demonstrations import Demonstration
from probdmp.dmp import linear_gaussian_model, stack_tasks, task_for
from probdmp.errors import InputError
from probdmp.execution import (
    filter_recordings,
    sample_trajectories,
    score_recordings,
    smooth_recording,
    task_of_recording,
    track_recording,
)
from probdmp.gaussian import filter_sequence, smooth_sequence


def recorded(primitive, rng, n_recordings, missing=0.0, durations=(0.6, 1.2)):
    """Recordings drawn from a primitive, each with its own length and rate, with gaps."""
    recordings = []
    for _ in range(n_recordings):
        task = task_for(primitive, duration=rng.uniform(*durations))
        dt = float(rng.uniform(0.02, 0.035))
        positions = sample_trajectories(primitive, task, dt, 1, rng, True)[0]
        positions[rng.random(positions.shape) < missing] = np.nan
        recordings.append(Demonstration(positions, dt, names=primitive.names))
    return recordings


@pytest.fixture(scope="module")
def primitive():
    return make_primitive(np.random.default_rng(0))


# --- the task of a recording ------------------------------------------------------------------------------------------


def test_what_is_not_said_is_read_off_the_recording(primitive):
    (recording,) = recorded(primitive, np.random.default_rng(1), 1)
    task = task_of_recording(primitive, recording)
    np.testing.assert_array_equal(task.start, recording.positions[0])
    assert np.isnan(task.goal).all()  # the goal cannot be read off an execution that may have failed
    assert task.duration == recording.duration
    assert task.start_velocity is None


def test_what_is_said_is_taken(primitive):
    (recording,) = recorded(primitive, np.random.default_rng(1), 1)
    task = task_of_recording(primitive, recording, [1, 2], [3, 4], 5.0, [6, 7])
    np.testing.assert_array_equal([task.start, task.goal, task.start_velocity], [[1, 2], [3, 4], [6, 7]])
    assert task.duration == 5


def test_a_first_row_that_is_missing_is_an_unknown_start(primitive):
    positions = np.ones((10, 2))
    positions[0, 1] = np.nan
    task = task_of_recording(primitive, Demonstration(positions, 0.1))
    np.testing.assert_array_equal(task.start, [1.0, np.nan])
    tracked = track_recording(primitive, task, Demonstration(positions, 0.1))
    np.testing.assert_array_equal(tracked.positions[0], [1.0, primitive.start[1]])
    np.testing.assert_allclose(tracked.position_stds[0], [0.0, np.sqrt(primitive.start_covariances[1, 1, 1])])
    positions[0] = np.nan
    np.testing.assert_array_equal(task_of_recording(primitive, Demonstration(positions, 0.1)).start, [np.nan, np.nan])


def test_starts_may_be_known_for_some_only(primitive):
    recordings = recorded(primitive, np.random.default_rng(8), 3)
    unknown = [np.nan, np.nan]
    tasks = [task_of_recording(primitive, r, start) for r, start in zip(recordings, (None, unknown, None), strict=True)]
    singles = [track_recording(primitive, t, r).log_likelihoods.sum() for t, r in zip(tasks, recordings, strict=True)]
    np.testing.assert_allclose(score_recordings(primitive, tasks, recordings), singles, rtol=1e-9)


# --- one recording ----------------------------------------------------------------------------------------------------


@settings(max_examples=20)
@given(primitives(), seeds, st.sampled_from([0.0, 0.3]))
def test_track_is_the_filter(primitive, seed, missing):
    (recording,) = recorded(primitive, np.random.default_rng(seed), 1, missing)
    task = task_of_recording(primitive, recording)
    tracked = track_recording(primitive, task, recording)
    model = linear_gaussian_model(primitive, task, recording.dt, recording.n_samples)
    wanted = filter_sequence(model, recording.positions[..., None])
    np.testing.assert_allclose(tracked.means, wanted.filtered.means, rtol=1e-12)
    np.testing.assert_allclose(tracked.covariances, wanted.filtered.covariances, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(tracked.contributions, wanted.log_likelihoods, rtol=1e-11)
    np.testing.assert_allclose(tracked.log_likelihoods, tracked.contributions.sum(axis=1))
    np.testing.assert_array_equal(np.isnan(tracked.innovations), np.isnan(recording.positions))
    np.testing.assert_allclose(tracked.innovation_variances, wanted.innovation_covariances[..., 0, 0], rtol=1e-12)
    assert tracked.times[-1] == pytest.approx(recording.duration)
    assert (tracked.names, tracked.units) == (primitive.names, primitive.units)


def test_innovations_and_their_variances_give_the_likelihood(primitive):
    (recording,) = recorded(primitive, np.random.default_rng(3), 1, 0.2)
    tracked = track_recording(primitive, task_of_recording(primitive, recording), recording)
    e, s = tracked.innovations, tracked.innovation_variances
    np.testing.assert_allclose(
        tracked.contributions, np.where(np.isnan(e), 0.0, -0.5 * (e**2 / s + np.log(2 * np.pi * s))), rtol=1e-9
    )


def test_rows_that_were_not_measured_are_predicted(primitive):
    (recording,) = recorded(primitive, np.random.default_rng(4), 1)
    gaps = np.array(recording.positions)
    gaps[5:9] = np.nan
    tracked = track_recording(primitive, task_of_recording(primitive, recording), replace(recording, positions=gaps))
    assert np.isnan(tracked.innovations[5:9]).all()
    np.testing.assert_array_equal(tracked.log_likelihoods[5:9], 0.0)
    assert np.isfinite(tracked.means).all()
    assert np.all(tracked.position_stds[8] > tracked.position_stds[4])
    assert np.all(tracked.position_stds[9] < tracked.position_stds[8])


def test_nothing_measured_is_a_rollout_with_likelihood_one(primitive):
    nothing = Demonstration(np.full((20, 2), np.nan), 0.05)
    task = task_of_recording(primitive, nothing)
    tracked = track_recording(primitive, task, nothing)
    rolled = filter_sequence(linear_gaussian_model(primitive, task, 0.05, 20)).filtered
    np.testing.assert_allclose(tracked.means, rolled.means, rtol=1e-10, atol=1e-12)
    np.testing.assert_array_equal(tracked.log_likelihoods, 0)
    np.testing.assert_array_equal(score_recordings(primitive, [task], [nothing]), [0.0])


@settings(max_examples=15)
@given(primitives(), seeds, st.sampled_from([0.0, 0.3]))
def test_smooth_is_the_smoother(primitive, seed, missing):
    (recording,) = recorded(primitive, np.random.default_rng(seed), 1, missing)
    task = task_of_recording(primitive, recording)
    smoothed = smooth_recording(primitive, task, recording)
    # A batch of one, and a sensor for each degree of freedom, so that the comparison can be exact.
    model = linear_gaussian_model(primitive, stack_tasks([task]), np.array([recording.dt]), recording.n_samples)
    model = replace(model, observation_matrix=np.tile(model.observation_matrix, (primitive.n_dof, 1, 1)))
    wanted = smooth_sequence(model, recording.positions[:, None, :, None])
    np.testing.assert_array_equal(smoothed.means, wanted.means[:, 0])
    np.testing.assert_array_equal(smoothed.covariances, wanted.covariances[:, 0])
    tracked = track_recording(primitive, task, recording)
    assert np.all(smoothed.position_stds <= tracked.position_stds * (1 + 1e-9) + 1e-12)
    np.testing.assert_allclose(smoothed.means[-1], tracked.means[-1], rtol=1e-9)


def test_a_recording_drawn_from_the_model_is_as_likely_as_expected():
    """The squared innovations, over their variances, have mean one."""
    rng = np.random.default_rng(5)
    primitive = make_primitive(rng)
    task = task_for(primitive)
    draws = sample_trajectories(primitive, task, 0.02, 60, rng, True)
    forward = filter_recordings(primitive, [task] * 60, [Demonstration(d, 0.02) for d in draws])
    ratios = forward.innovations**2 / np.diagonal(forward.innovation_covariances, axis1=-2, axis2=-1)
    assert ratios.mean() == pytest.approx(1.0, abs=5 * np.sqrt(2 / ratios.size))


# --- many recordings --------------------------------------------------------------------------------------------------


@settings(max_examples=15)
@given(primitives(), seeds, st.sampled_from([0.0, 0.3]))
def test_a_batch_is_its_members(primitive, seed, missing):
    recordings = recorded(primitive, np.random.default_rng(seed), 4, missing)
    tasks = [task_of_recording(primitive, r) for r in recordings]
    batch = filter_recordings(primitive, tasks, recordings)
    scores = score_recordings(primitive, tasks, recordings)
    for k, (task, recording) in enumerate(zip(tasks, recordings, strict=True)):
        single, n = track_recording(primitive, task, recording), recording.n_samples
        scale = np.abs(single.means).max(axis=(0, 1))
        assert (np.abs(batch.filtered.means[:n, k] - single.means) / scale).max() <= 1e-12
        np.testing.assert_allclose(batch.log_likelihoods[:n, k], single.contributions, rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(batch.log_likelihoods[n:, k], 0)
        assert scores[k] == pytest.approx(single.log_likelihoods.sum(), rel=1e-12, abs=1e-9)


def test_more_recordings_than_a_batch_holds(primitive):
    few = recorded(primitive, np.random.default_rng(6), 7, durations=(0.5, 0.6))
    many = [few[k % 7] for k in range(600)]
    tasks = [task_of_recording(primitive, r) for r in few]
    scores = score_recordings(primitive, [tasks[k % 7] for k in range(600)], many)
    assert scores.shape == (600,)
    np.testing.assert_allclose(scores, np.tile(score_recordings(primitive, tasks, few), 86)[:600], rtol=1e-11)


def test_the_order_of_the_recordings_is_kept(primitive):
    recordings = recorded(primitive, np.random.default_rng(7), 5)
    tasks = [task_of_recording(primitive, r) for r in recordings]
    scores = score_recordings(primitive, tasks, recordings)
    np.testing.assert_allclose(score_recordings(primitive, tasks[::-1], recordings[::-1])[::-1], scores, rtol=1e-11)
    assert len(np.unique(scores)) == 5


def test_start_velocities_may_be_known_for_some_only(primitive):
    recordings = recorded(primitive, np.random.default_rng(8), 3)
    tasks = [
        task_of_recording(primitive, r, start_velocity=v) for r, v in zip(recordings, (None, [1.0, -1.0], None), strict=True)
    ]
    singles = [track_recording(primitive, t, r).log_likelihoods.sum() for t, r in zip(tasks, recordings, strict=True)]
    np.testing.assert_allclose(score_recordings(primitive, tasks, recordings), singles, rtol=1e-9)


@pytest.mark.parametrize("run", [track_recording, smooth_recording], ids=["track", "smooth"])
def test_recordings_of_other_degrees_of_freedom_are_refused(primitive, run):
    other = Demonstration(np.zeros((10, 3)), 0.1, names=("a", "b", "c"))
    with pytest.raises(InputError, match=r"recordings of 2 degrees of freedom \(q0, q1\), got one with 3 \(a, b, c\)"):
        run(primitive, task_for(primitive), other)


def one_by_one(primitive, task, recording):
    return task_of_recording(primitive, recording), score_recordings(primitive, [task], [recording])


RUNS = pytest.mark.parametrize("run", [track_recording, smooth_recording, one_by_one], ids=["track", "smooth", "score"])


@RUNS
@pytest.mark.parametrize("names", [("q1", "q0"), ("x", "y")])
def test_recordings_with_other_names_are_refused(primitive, run, names):
    other = Demonstration(np.zeros((10, 2)), 0.1, names=names)
    with pytest.raises(InputError, match=r"recordings of 2 .*\(q0, q1\), got one with 2 \(.*\)\. .*the order that was learned"):
        run(primitive, task_for(primitive), other)


@RUNS
def test_recordings_in_other_units_are_refused(primitive, run):
    other = Demonstration(np.zeros((10, 2)), 0.1, names=primitive.names, units="mm")
    with pytest.raises(InputError, match=r"recordings in m, got one in mm\. Convert"):
        run(primitive, task_for(primitive), other)


@RUNS
def test_recordings_without_names_or_units_fit_any_primitive(primitive, run):
    for description in ({}, {"names": ("dof0", "dof1")}, {"names": primitive.names}, {"units": "m"}):
        run(primitive, task_for(primitive), Demonstration(np.zeros((10, 2)), 0.1, **description))
    run(replace(primitive, units=""), task_for(primitive), Demonstration(np.zeros((10, 2)), 0.1, units="mm"))
