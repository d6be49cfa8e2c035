"""Execution tick by tick: the same numbers as over a recording, whatever the clock does."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_primitive, primitives, seeds

from probdmp.demonstrations import Demonstration
from probdmp.dmp import linear_gaussian_model, step_count, task_for
from probdmp.errors import InputError
from probdmp.execution import OnlineExecution, sample_trajectories, track_recording
from probdmp.gaussian import filter_sequence

DT = 0.02


@pytest.fixture(scope="module")
def primitive():
    return make_primitive(np.random.default_rng(0), duration=1.0)


@pytest.fixture
def execution(primitive):
    return OnlineExecution(primitive, task_for(primitive), DT)


@pytest.fixture(scope="module")
def path(primitive):
    """(51, 2) positions of one execution."""
    return sample_trajectories(primitive, task_for(primitive), DT, 1, np.random.default_rng(1), True)[0]


def states(steps):
    """(n, D, 3) desired states."""
    return np.stack([np.stack([s.acceleration, s.velocity, s.position], axis=-1) for s in steps])


def assert_same_steps(one, other):
    for a, b in zip(one, other, strict=True):
        for name in ("position", "velocity", "acceleration", "covariance", "contributions", "innovations"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
        assert (a.time, a.phase, a.log_likelihood) == (b.time, b.phase, b.log_likelihood)


# --- the law ----------------------------------------------------------------------------------------------------------


@settings(max_examples=20)
@given(primitives(), seeds, st.sampled_from([0.0, 0.3, 1.0]), st.booleans())
def test_online_is_offline_step_by_step(primitive, seed, missing, given_velocity):
    rng = np.random.default_rng(seed)
    velocity = rng.standard_normal(primitive.n_dof) if given_velocity else None
    task = task_for(primitive, duration=0.8, start_velocity=velocity)
    observed = sample_trajectories(primitive, task, DT, 1, rng, True)[0]
    observed[rng.random(observed.shape) < missing] = np.nan
    execution = OnlineExecution(primitive, task, DT)
    steps = [execution.step(o) for o in observed]

    tracked = track_recording(primitive, task, Demonstration(observed, DT))
    model = linear_gaussian_model(primitive, task, DT, len(observed) + 1)
    predicted = np.matmul(model.transition, tracked.means[..., None])[..., 0] + model.drifts()
    covariances = model.transition @ tracked.covariances @ model.transition.mT + model.process_covariances()
    scale = np.abs(predicted).max(axis=(0, 1))
    assert (np.abs(states(steps) - predicted) / scale).max() <= 1e-12
    spread = np.sqrt(np.diagonal(covariances, axis1=-2, axis2=-1)).max(axis=(0, 1))
    assert (np.abs(np.stack([s.covariance for s in steps]) - covariances) / np.outer(spread, spread)).max() <= 1e-12
    np.testing.assert_allclose([s.contributions for s in steps], tracked.contributions, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose([s.innovations for s in steps], tracked.innovations, atol=1e-12 * scale[2])
    np.testing.assert_allclose([s.log_likelihood for s in steps], tracked.log_likelihoods, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose([s.time for s in steps], (np.arange(len(steps)) + 1) * DT, rtol=1e-12)
    np.testing.assert_allclose([s.phase for s in steps], 0.01 ** (tracked.times / 0.8), rtol=1e-12)


def test_the_first_step_updates_without_predicting(execution, primitive):
    step = execution.step(primitive.start + 0.5)
    np.testing.assert_allclose(step.innovations, 0.5, rtol=1e-12)
    assert step.phase == 1.0
    assert step.time == DT


def test_nothing_measured_is_the_rollout(execution, primitive):
    rolled = filter_sequence(linear_gaussian_model(primitive, task_for(primitive), DT, 51)).filtered
    steps = [execution.step() for _ in range(50)]
    np.testing.assert_allclose(states(steps), rolled.means[1:], rtol=1e-11, atol=1e-11)
    for step in steps:
        assert step.log_likelihood == 0
        assert np.isnan(step.innovations).all()
        assert np.isnan(step.test_ratio)


@settings(max_examples=20)
@given(seeds, st.integers(1, 40))
def test_feedback_enters_the_command_as_A_K_e(seed, n_steps):
    """The paper's automatic feedback term; it is in no line of the code."""
    rng = np.random.default_rng(seed)
    primitive = make_primitive(rng, duration=1.0)
    task = task_for(primitive)
    seen = sample_trajectories(primitive, task, DT, 1, rng, True)[0]
    disturbed, undisturbed = (OnlineExecution(primitive, task, DT) for _ in range(2))
    for o in seen[:n_steps]:
        before = disturbed.step(o)
        undisturbed.step(o)
    error = rng.standard_normal(2)
    one, other = disturbed.step(before.position + error), undisturbed.step(before.position)
    gain = before.covariance[:, :, 2] / (before.covariance[:, 2, 2] + primitive.observation_variances)[:, None]
    transition = linear_gaussian_model(primitive, task, DT, 2).transition
    wanted = np.matmul(transition, (gain * error[:, None])[..., None])[..., 0]
    np.testing.assert_allclose(states([one])[0] - states([other])[0], wanted, rtol=1e-7, atol=1e-9 * np.abs(wanted).max())
    np.testing.assert_allclose(one.innovations, error, rtol=1e-9)


def test_it_runs_on_past_its_duration(primitive):
    """Over several refills of its inputs, as one long model would."""
    task, n_steps = task_for(primitive, duration=0.3), 4 * step_count(0.3, DT) + 5
    observed = np.random.default_rng(0).standard_normal((n_steps, 2)) * 0.01 + primitive.goal
    execution = OnlineExecution(primitive, task, DT)
    steps = [execution.step(o) for o in observed]
    model = linear_gaussian_model(primitive, task, DT, n_steps)
    forward = filter_sequence(model, observed[..., None])
    np.testing.assert_allclose([s.contributions for s in steps], forward.log_likelihoods, rtol=1e-9, atol=1e-9)
    wanted = np.matmul(model.transition, forward.filtered.means[:-1, ..., None])[..., 0] + model.drifts()
    np.testing.assert_allclose(states(steps[:-1]), wanted, rtol=1e-9, atol=1e-9)


def test_the_goal_attracts_after_the_end(primitive):
    execution = OnlineExecution(primitive, task_for(primitive, goal=[3.0, -4.0], duration=0.3), DT)
    for _ in range(100):
        step = execution.step()
    np.testing.assert_allclose(step.position, [3.0, -4.0], atol=1e-5)
    assert np.isfinite(step.covariance).all()


def test_reset_begins_anew(execution, path):
    first = [execution.step(o) for o in path]
    for _ in range(150):
        execution.step()
    execution.reset()
    assert_same_steps([execution.step(o) for o in path], first)
    assert execution.n_dropped == 0


def test_executions_do_not_share_anything(primitive, path):
    one, other = (OnlineExecution(primitive, task_for(primitive), DT) for _ in range(2))
    alone = OnlineExecution(primitive, task_for(primitive), DT)
    interleaved = []
    for o in path:
        interleaved.append(one.step(o))
        other.step(o + 1)
    assert_same_steps(interleaved, [alone.step(o) for o in path])


def test_what_the_caller_does_with_a_step_is_his_own_business(primitive, path):
    """A controller that adds an offset in place, or clears a buffer, must not reach into the filter."""
    untouched, touched = (OnlineExecution(primitive, task_for(primitive), DT) for _ in range(2))
    wanted = [untouched.step(o) for o in path]
    for o, right in zip(path, wanted, strict=True):
        step = touched.step(o)
        np.testing.assert_array_equal(step.position, right.position)
        np.testing.assert_array_equal(step.covariance, right.covariance)
        for name in ("position", "velocity", "acceleration", "covariance", "contributions", "innovations"):
            array = getattr(step, name)
            if array.flags.writeable:
                array += 1.0


# --- time -------------------------------------------------------------------------------------------------------------


def test_times_on_the_ticks_change_nothing(primitive, path):
    bare, timed, jittered = (OnlineExecution(primitive, task_for(primitive), DT) for _ in range(3))
    wanted = [bare.step(o) for o in path]
    assert_same_steps([timed.step(o, k * DT) for k, o in enumerate(path)], wanted)
    jitter = np.random.default_rng(0).uniform(-0.45, 0.45, len(path))
    assert_same_steps([jittered.step(o, (k + j) * DT) for k, (o, j) in enumerate(zip(path, jitter, strict=True))], wanted)


def test_skipped_ticks_are_predicted(primitive, path):
    skipping, waiting = (OnlineExecution(primitive, task_for(primitive), DT) for _ in range(2))
    for k in range(5):
        skipping.step(path[k], k * DT)
        waiting.step(path[k])
    for _ in range(7):
        waiting.step(None)
    assert_same_steps([skipping.step(path[12], 12 * DT)], [waiting.step(path[12])])
    assert skipping.n_dropped == 0


@settings(max_examples=20)
@given(st.lists(st.integers(0, 40), min_size=1, max_size=10))
def test_only_what_is_newer_counts(ticks):
    """Duplicates and late arrivals are dropped and counted; the last answer is repeated."""
    primitive = make_primitive(np.random.default_rng(0), duration=1.0)
    path = np.cumsum(np.random.default_rng(1).standard_normal((41, 2)), axis=0) * 0.01
    messy, tidy = (OnlineExecution(primitive, task_for(primitive), DT) for _ in range(2))
    newest, n_late, last = -1, 0, None
    for tick in ticks:
        step = messy.step(path[tick], tick * DT)
        if tick <= newest:
            n_late += 1
            assert step is last
        else:
            for _ in range(newest + 1, tick):
                tidy.step()
            assert_same_steps([step], [tidy.step(path[tick])])
            newest = tick
        last = step
        assert messy.n_dropped == n_late


@pytest.mark.parametrize("jump", [1.7e9, 50.0, -50.0, -1.7e9])
def test_a_clock_that_is_set_during_the_movement(primitive, path, jump):
    jumping, steady = (OnlineExecution(primitive, task_for(primitive), DT) for _ in range(2))
    wanted = [steady.step(o) for o in path]
    steps = [jumping.step(o, k * DT + (jump if k >= 20 else 0.0)) for k, o in enumerate(path)]
    assert_same_steps(steps, wanted)
    assert jumping.n_dropped == 0


def test_a_clock_that_is_set_back_within_the_movement(primitive, path):
    """Ten late observations are dropped, then their clock is believed; no tick repeats the same command for longer."""
    execution = OnlineExecution(primitive, task_for(primitive), DT)
    for k in range(30):
        execution.step(path[k], k * DT)
    times = [execution.step(path[30 + k], (5 + k) * DT).time for k in range(15)]
    assert execution.n_dropped == 10
    np.testing.assert_allclose(times[10:], (31 + np.arange(5)) * DT)


@pytest.mark.parametrize("jump", [1.7e9, -50.0])
def test_after_a_jump_gaps_are_understood_relative_to_it(primitive, path, jump):
    jumping, steady = (OnlineExecution(primitive, task_for(primitive), DT) for _ in range(2))
    for k in range(10):
        jumping.step(path[k], k * DT)
        steady.step(path[k])
    jumping.step(path[10], 10 * DT + jump)
    steady.step(path[10])
    for _ in range(4):
        steady.step()
    assert_same_steps([jumping.step(path[15], 15 * DT + jump)], [steady.step(path[15])])


def test_a_clock_that_counts_from_1970_from_the_start(primitive, path):
    absolute, steady = (OnlineExecution(primitive, task_for(primitive), DT) for _ in range(2))
    epoch = 1_700_000_000.0
    assert_same_steps([absolute.step(o, epoch + k * DT) for k, o in enumerate(path)], [steady.step(o) for o in path])


def test_a_clock_that_is_set_back_a_little_is_late_until_it_has_caught_up(execution, path):
    for k in range(20):
        execution.step(path[k], k * DT)
    for k in range(20, 25):
        execution.step(path[k], (k - 5) * DT)
    assert execution.n_dropped == 5
    assert execution.step(path[25], 20 * DT).time == pytest.approx(21 * DT)


@pytest.mark.parametrize("time", [np.nan, np.inf, -np.inf])
def test_a_time_that_is_no_number_is_the_next_tick(primitive, path, time):
    bare, timed = (OnlineExecution(primitive, task_for(primitive), DT) for _ in range(2))
    wanted = [bare.step(o) for o in path]
    assert_same_steps([timed.step(o, time if k % 3 == 1 else k * DT) for k, o in enumerate(path)], wanted)


@pytest.mark.parametrize("time", ["now", [0.1, 0.2], 1j, object()])
def test_a_time_of_the_wrong_kind_is_refused(execution, path, time):
    with pytest.raises((InputError, TypeError), match=r"Expected time"):
        execution.step(path[0], time)


# --- alarms -----------------------------------------------------------------------------------------------------------


class AlarmAt:
    """A detector that calls the execution failed from a given tick on, and remembers what it was shown."""

    def __init__(self, tick):
        self.tick, self.shown = tick, []

    def monitor(self, primitive, task, dt, outputs):
        self.shown, self.outputs = [], outputs
        detector, verdict = self, SimpleNamespace(failed=False)

        class Monitor:
            def update(self, observed):
                detector.shown.append(observed)
                verdict.failed = verdict.failed or observed.step >= detector.tick
                return float(observed.step) / detector.tick

        monitor = Monitor()
        monitor.verdict = verdict
        return monitor


def test_without_a_detector_nothing_is_ever_called_failed(execution):
    for _ in range(60):
        execution.step([1e6, -1e6])
    assert not execution.failed
    assert execution.verdict is None


def test_the_detector_sees_every_tick_once(primitive, path):
    detector = AlarmAt(1000)
    execution = OnlineExecution(primitive, task_for(primitive), DT, detector)
    execution.step(path[0], 0.0)
    execution.step(path[4], 4 * DT)
    execution.step(path[2], 2 * DT)
    last = execution.step(path[5])
    assert [o.step for o in detector.shown] == [0, 1, 2, 3, 4, 5]
    np.testing.assert_allclose([o.time for o in detector.shown], np.arange(6) * DT)
    assert [bool(np.isnan(o.innovations).all()) for o in detector.shown] == [False, True, True, True, False, False]
    np.testing.assert_array_equal(detector.shown[-1].contributions, last.contributions)
    assert last.test_ratio == 5 / 1000


def test_the_detector_sees_the_variance_of_every_innovation(primitive, path):
    """Also of those that were not seen."""
    detector, task = AlarmAt(1000), task_for(primitive)
    execution = OnlineExecution(primitive, task, DT, detector)
    gaps = np.array(path[:6])
    gaps[2:4, 0] = np.nan
    for o in gaps:
        execution.step(o)
    padded = np.concatenate([gaps, np.full((1, primitive.n_dof), np.nan)])
    forward = filter_sequence(linear_gaussian_model(primitive, task, DT, len(padded)), padded[..., None])
    shown = np.stack([o.innovation_variances for o in detector.shown])
    np.testing.assert_allclose(shown, forward.innovation_covariances[:6, :, 0, 0], rtol=1e-10)


def test_a_step_says_what_the_detector_says(primitive, path):
    watched = OnlineExecution(primitive, task_for(primitive), DT, AlarmAt(2))
    for o in path[:4]:
        assert watched.step(o).verdict is watched.verdict
    assert watched.verdict.failed
    assert OnlineExecution(primitive, task_for(primitive), DT).step(path[0]).verdict is None


@pytest.mark.parametrize("name", ["position", "velocity", "acceleration", "covariance", "contributions", "innovations"])
@pytest.mark.parametrize("on_alarm", ["continue", "hold"])
def test_the_arrays_of_a_step_are_read_only(primitive, path, name, on_alarm):
    execution = OnlineExecution(primitive, task_for(primitive), DT, AlarmAt(1), on_alarm)
    for o in path[:4]:
        assert not getattr(execution.step(o), name).flags.writeable


def test_an_unknown_start_is_told_by_the_first_observation(primitive):
    unknown = task_for(primitive, np.full(primitive.n_dof, np.nan))
    precise = replace(primitive, observation_variances=np.full(primitive.n_dof, 1e-12))
    away = primitive.start + 0.1
    for task, wanted in ((unknown, away), (task_for(primitive), primitive.start)):
        execution = OnlineExecution(precise, task, 1e-4)  # hardly moves in a step
        np.testing.assert_allclose(execution.step(away).position, wanted, atol=2e-3)


def test_continue_goes_on_with_the_filtered_movement(primitive, path):
    watched = OnlineExecution(primitive, task_for(primitive), DT, AlarmAt(20))
    alone = OnlineExecution(primitive, task_for(primitive), DT)
    steps = [watched.step(o) for o in path]
    assert_same_steps(steps, [alone.step(o) for o in path])
    assert watched.failed


def test_hold_commands_rest_where_the_alarm_was_until_reset(primitive, path):
    held = OnlineExecution(primitive, task_for(primitive), DT, AlarmAt(20), on_alarm="hold")
    alone = OnlineExecution(primitive, task_for(primitive), DT)
    steps, wanted = [held.step(o) for o in path], [alone.step(o) for o in path]
    assert_same_steps(steps[:20], wanted[:20])
    for step, right in zip(steps[20:], wanted[20:], strict=True):
        np.testing.assert_array_equal(step.position, wanted[20].position)
        np.testing.assert_array_equal([step.velocity, step.acceleration], np.zeros((2, 2)))
        assert step.log_likelihood == right.log_likelihood  # it goes on watching
    held.reset()
    assert not held.failed
    assert_same_steps([held.step(o) for o in path[:20]], wanted[:20])


def test_on_alarm_has_two_answers(primitive):
    with pytest.raises(InputError, match="on_alarm to be one of 'continue', 'hold', got 'stop'"):
        OnlineExecution(primitive, task_for(primitive), DT, on_alarm="stop")


# --- what is measured -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("observation", [[1.0], [1.0, 2.0, 3.0], 1.0, [[1.0, 2.0]]])
def test_observations_of_another_shape_are_refused(execution, observation):
    with pytest.raises(InputError, match=r"Expected observation of shape \(2,\), got \("):
        execution.step(observation)


def test_a_refused_observation_leaves_no_trace(primitive, path):
    one, other = (OnlineExecution(primitive, task_for(primitive), DT) for _ in range(2))
    for o in path:
        for bad in ([1.0], [np.inf, 0.0], ["a", "b"]):
            with pytest.raises((InputError, TypeError), match="Expected observation"):
                one.step(bad, 7.0)
        assert_same_steps([one.step(o)], [other.step(o)])


def test_too_many_ticks_are_refused(primitive):
    with pytest.raises(InputError, match="a duration of 1 to 100000 steps of dt"):
        OnlineExecution(primitive, task_for(primitive), 1e-9)


# --- how it shows itself ----------------------------------------------------------------------------------------------


def test_a_step_shows_itself_in_one_line(execution, path):
    step = execution.step(path[0])
    q0, q1 = step.position
    assert str(step) == repr(step) == f"<ExecutionStep due at 0.020 s: q0 {q0:.4g}, q1 {q1:.4g}>"
    stopped = step._replace(test_ratio=1.234, verdict=SimpleNamespace(failed=True), held=np.zeros((2, 3)))
    assert repr(stopped) == "<ExecutionStep due at 0.020 s: q0 0, q1 0; test ratio 1.23; failed; held>"
    assert "failed" not in repr(step._replace(verdict=SimpleNamespace(failed=False)))
