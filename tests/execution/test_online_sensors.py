"""Execution tick by tick with several sensors: the same numbers as over a recording, gates, and which sensors have a say."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from sensed import DT, KINDS, NAN, STEPS, movement, readings, recorded, tracked
from strategies import random_sensors, seeds, state_scales

from probdmp.dmp import task_for
from probdmp.errors import InputError, InputTypeError
from probdmp.execution import (
    ChannelSensor,
    NonlinearSensor,
    OnlineExecution,
    SensorArray,
    roll_out,
    state_sensor,
    track_recording,
)

OF_EVERY_KIND = pytest.mark.parametrize("kind", KINDS)


def mixed_sensors(rng, p):
    """Two that see single degrees of freedom, one of them with a gate, one that sees all, and one that is not linear."""
    first, second = random_sensors(rng, p, DT, 2)
    third = random_sensors(rng, p, DT, 1, coupling=True)[0]
    scale = state_scales(p, DT).reshape(-1, 3)[:, 2]
    bent = NonlinearSensor(
        "bent", lambda q: np.array([np.sin(q.sum() / scale[0]), q[0] * q[-1]]), np.diag([0.1, scale[0] ** 2]), gate=2.5
    )
    return [replace(first, gate=1.2), second, replace(third, name="third", outputs=()), bent]


def stepped(p, task, array, values, **options):
    execution = OnlineExecution(p, task, DT, sensors=array, **options)
    return execution, [execution.step(row) for row in values]


def commands(steps):
    """(n, D, 3) desired states."""
    return np.stack([np.stack([s.acceleration, s.velocity, s.position], axis=-1) for s in steps])


# --- online is offline ------------------------------------------------------------------------------------------------


@OF_EVERY_KIND
@settings(max_examples=3)
@given(seeds)
def test_online_is_offline(kind, seed):
    """With gates, functions, sensors of several degrees of freedom and gaps."""
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    array = SensorArray(p, mixed_sensors(rng, p))
    values = readings(p, task, array, rng, 0.3, (1, 2, 1, 3))
    track = tracked(p, task, array, values)
    execution, steps = stepped(p, task, array, values)
    np.testing.assert_allclose([s.contributions for s in steps], track.contributions, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose([s.log_likelihood for s in steps], track.log_likelihoods, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose([s.innovations for s in steps], track.innovations, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal([s.fused for s in steps], track.fused)
    np.testing.assert_allclose([s.innovation_covariance for s in steps], track.innovation_covariances, rtol=1e-8, atol=1e-9)
    for name, of_sensor in track.sensors.items():
        ratios = np.concatenate([s.sensors[name].test_ratios for s in steps])
        np.testing.assert_allclose(ratios, of_sensor.test_ratios, rtol=1e-8)
        counts = execution.sensor_counts[name]
        for count in ("n_fused", "n_rejected", "n_missing"):
            assert getattr(counts, count) == getattr(of_sensor, count)
        assert counts.n_fused + counts.n_rejected + counts.n_missing == STEPS


@OF_EVERY_KIND
@settings(max_examples=3)
@given(seeds)
def test_what_is_commanded_is_the_prediction(kind, seed):
    """The state that a recording is believed to be in at the next tick, where nothing was measured."""
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    array = SensorArray(p, mixed_sensors(rng, p))
    values = readings(p, task, array, rng, 0.3)
    unit = state_scales(p, DT).reshape(-1, 3)
    units = unit[:, :, None] * unit[:, None]
    _, steps = stepped(p, task, array, values)
    for t in (1, STEPS // 2, STEPS - 2):
        until = values.copy()
        until[t + 1 :] = NAN
        ahead = tracked(p, task, array, until)
        assert np.max(np.abs(commands(steps)[t] - ahead.means[t + 1]) / (unit + np.abs(ahead.means[t + 1]))) < 1e-9
        np.testing.assert_allclose(steps[t].covariance / units, ahead.covariances[t + 1] / units, atol=1e-9)
        for name, channel in steps[t].channels.items():
            np.testing.assert_allclose(channel.means, ahead.channels[name].means[t + 1], rtol=1e-8, atol=1e-9)
            np.testing.assert_allclose(channel.stds, ahead.channels[name].stds[t + 1], rtol=1e-8)


@OF_EVERY_KIND
def test_readings_by_name_are_readings_in_a_row(kind):
    p, task = movement(kind, 1)
    rng = np.random.default_rng(1)
    array = SensorArray(p, mixed_sensors(rng, p))
    values = readings(p, task, array, rng)
    _, in_a_row = stepped(p, task, array, values)
    named = OnlineExecution(p, task, DT, sensors=array)
    for row, wanted in zip(values, in_a_row, strict=True):
        step = named.step({name: row[part] for name, part in reversed(array.slices.items())})
        np.testing.assert_array_equal(step.position, wanted.position)
        np.testing.assert_array_equal(step.contributions, wanted.contributions)


def test_an_array_may_be_of_the_first_sensor_alone():
    p, task = movement("felt", 1)
    camera, gyro = state_sensor(p, "camera", "position", 0.1), state_sensor(p, "gyro", "velocity", 0.1)
    array = SensorArray(p, [camera, gyro])
    bare, named = (OnlineExecution(p, task, DT, sensors=array) for _ in range(2))
    for position in np.random.default_rng(0).standard_normal((5, 2)):
        np.testing.assert_array_equal(bare.step(position).position, named.step({"camera": position, "gyro": None}).position)
    assert bare.sensor_counts["gyro"].n_missing == bare.sensor_counts["force"].n_missing == 5
    assert bare.sensor_counts["camera"].n_fused == 5


@pytest.mark.parametrize(
    ("given_ones", "error", "match"),
    [
        ({"radar": 1.0}, InputError, r"Expected readings of the sensors 'camera', 'force', got one of 'radar'"),
        ({1: [0.0, 0.0]}, InputTypeError, r"Expected readings by name of their sensors, got 1"),
        ({"camera": [1.0, 2.0, 3.0]}, InputError, r"Expected reading of 'camera' of shape \(2,\), got \(3,\)"),
        ({"camera": [1.0, np.inf]}, InputError, r"Expected reading of 'camera' finite or NaN"),
        ({"force": "much"}, InputTypeError, r"Expected reading of 'force' as real numbers"),
        ([1.0], InputError, r"Expected observation of shape \(2,\), got \(1,\)"),
    ],
)
def test_readings_that_are_none_leave_no_trace(given_ones, error, match):
    p, task = movement("felt", 1)
    array = SensorArray(p, [state_sensor(p, "camera", "position", 0.1)])
    one, other = (OnlineExecution(p, task, DT, sensors=array) for _ in range(2))
    with pytest.raises(error, match=match):
        one.step(given_ones)
    np.testing.assert_array_equal(one.step([0.1, 0.2]).position, other.step([0.1, 0.2]).position)
    assert one.sensor_counts["camera"].n_fused == 1


# --- gates ------------------------------------------------------------------------------------------------------------


@OF_EVERY_KIND
@settings(max_examples=3)
@given(seeds)
def test_a_rejected_reading_changes_nothing_but_the_report(kind, seed):
    """The same as if it had not been measured."""
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    array = SensorArray(p, mixed_sensors(rng, p))
    values = readings(p, task, array, rng, 0.1)
    first = array.slices["s0"]
    values[STEPS // 2, first] = 1e3
    values[STEPS // 2 + 1, array.slices["bent"]] = 1e3
    track = tracked(p, task, array, values)
    kept = np.where(track.fused, values, NAN)
    assert not track.fused[STEPS // 2, first].any()
    assert not track.fused[STEPS // 2 + 1, array.slices["bent"]].any()
    without = tracked(p, task, array, kept)
    np.testing.assert_array_equal(track.means, without.means)
    np.testing.assert_array_equal(track.covariances, without.covariances)
    np.testing.assert_array_equal(track.contributions, without.contributions)
    assert np.all(np.isfinite(track.innovations) == ~np.isnan(values))  # what it said is in the report
    assert track.sensors["s0"].test_ratios[STEPS // 2] > 1
    assert track.sensors["s0"].rejected[STEPS // 2]
    assert not track.sensors["s1"].rejected.any()  # it has no gate
    _, steps = stepped(p, task, array, values)
    _, expected = stepped(p, task, array, kept)
    np.testing.assert_array_equal(commands(steps), commands(expected))


@OF_EVERY_KIND
def test_the_test_ratio_is_that_of_px4(kind):
    """e^2 / (gate^2 S), of one output; the gate of five standard deviations where the sensor has none."""
    p, task = movement(kind, 2)
    rng = np.random.default_rng(2)
    gated = state_sensor(p, "gated", "position:q0", 0.05, outputs=["a"], gate=2.0)
    plain = state_sensor(p, "plain", "velocity:q1", 0.05, outputs=["b"])
    array = SensorArray(p, [gated, plain])
    values = readings(p, task, array, rng)
    values[4, 0] += 5.0
    track = tracked(p, task, array, values)
    for i, (name, gate) in enumerate((("gated", 2.0), ("plain", 5.0))):
        wanted = track.innovations[:, i] ** 2 / (gate**2 * track.innovation_variances[:, i])
        np.testing.assert_allclose(track.sensors[name].test_ratios, wanted, rtol=1e-12)
    np.testing.assert_array_equal(track.sensors["gated"].rejected, track.sensors["gated"].test_ratios > 1)
    assert track.sensors["gated"].rejected[4]


def test_counters_count_in_a_row_and_begin_anew():
    p, task = movement("joint", 3)
    array = SensorArray(p, [state_sensor(p, "camera", "position", 0.05, gate=3.0)])
    execution, near = OnlineExecution(p, task, DT, sensors=array), roll_out(p, task, DT).positions
    counts = []
    for t, said in enumerate(["good", "bad", "bad", "none", "bad", "good", "half"]):
        offset = {"good": [0.0, 0.0], "bad": [1e3, 0.0], "none": [NAN, NAN], "half": [NAN, 0.0]}[said]
        execution.step(near[t] + offset)
        c = execution.sensor_counts["camera"]
        counts.append((c.n_fused, c.n_rejected, c.n_missing, c.n_rejected_in_a_row))
    assert counts == [(1, 0, 0, 0), (1, 1, 0, 1), (1, 2, 0, 2), (1, 2, 1, 2), (1, 3, 1, 3), (2, 3, 1, 0), (3, 3, 1, 0)]
    execution.reset()
    assert execution.sensor_counts["camera"].n_fused == 0


def test_of_several_outputs_one_outlier_rejects_the_reading():
    """A sensor is believed or not: its outputs come from one device."""
    p, task = movement("joint", 3)
    array = SensorArray(p, [state_sensor(p, "camera", "position", 0.05, gate=3.0)])
    near = roll_out(p, task, DT).positions[0]
    step = OnlineExecution(p, task, DT, sensors=array).step([near[0], near[1] + 1e3])
    assert not step.fused.any()
    assert step.log_likelihood == 0
    assert repr(step.sensors["camera"]) == "<SensorTrack: 0 readings used, 1 rejected, 0 missing>"


# --- which sensors modulate the command -------------------------------------------------------------------------------


@OF_EVERY_KIND
def test_all_of_them_unless_told(kind):
    p, task = movement(kind, 4)
    rng = np.random.default_rng(4)
    array = SensorArray(p, mixed_sensors(rng, p))
    values = readings(p, task, array, rng, 0.2)
    (_, plain), (_, told) = (stepped(p, task, array, values, feedback=f) for f in (None, array.names))
    np.testing.assert_array_equal(commands(told), commands(plain))
    np.testing.assert_array_equal([s.covariance for s in told], [s.covariance for s in plain])


@OF_EVERY_KIND
@settings(max_examples=2)
@given(seeds)
def test_with_none_the_command_is_the_plan(kind, seed):
    """And the sensors are watched as ever."""
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    array = SensorArray(p, mixed_sensors(rng, p))
    values = readings(p, task, array, rng, 0.2)
    _, watched = stepped(p, task, array, values, feedback=())
    _, plain = stepped(p, task, array, values)
    rolled = roll_out(p, task, DT)
    unit = state_scales(p, DT).reshape(-1, 3)
    assert np.max(np.abs(commands(watched)[:-1] - rolled.means[1:]) / (unit + np.abs(rolled.means[1:]))) < 1e-11
    for a, b in zip(watched, plain, strict=True):
        assert a.log_likelihood == b.log_likelihood
        np.testing.assert_array_equal(a.contributions, b.contributions)
        np.testing.assert_array_equal(a.innovations, b.innovations)
        np.testing.assert_array_equal(a.fused, b.fused)
        assert {n: t.n_rejected for n, t in a.sensors.items()} == {n: t.n_rejected for n, t in b.sensors.items()}


@OF_EVERY_KIND
@settings(max_examples=2)
@given(seeds)
def test_the_command_of_some_knows_nothing_of_the_others(kind, seed):
    """It is that of an execution in which the others never measured anything."""
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    array = SensorArray(p, mixed_sensors(rng, p))
    values = readings(p, task, array, rng, 0.2)
    for feedback in (["s0"], ["bent", "s1"], ["third"]):
        heard = array.chosen(feedback)
        _, some = stepped(p, task, array, values, feedback=feedback)
        _, alone = stepped(p, task, array, np.where(heard, values, NAN))
        np.testing.assert_array_equal(commands(some), commands(alone))
        np.testing.assert_array_equal([s.covariance for s in some], [s.covariance for s in alone])
        for name in p.channel_names:
            np.testing.assert_array_equal([s.channels[name].means for s in some], [s.channels[name].means for s in alone])


@pytest.mark.parametrize(
    ("feedback", "error", "match"),
    [
        (["radar"], InputError, r"the name of a sensor that modulates the command to be one of 'camera', got 'radar'"),
        ("camera", InputTypeError, r"feedback as a list of names, got 'camera'\. Write feedback=\['camera'\]"),
        (["camera", "camera"], InputError, "different names in feedback"),
    ],
)
def test_feedback_of_sensors_that_are_none(feedback, error, match):
    p, task = movement("joint", 1)
    with pytest.raises(error, match=match):
        OnlineExecution(p, task, DT, sensors=SensorArray(p, [state_sensor(p, "camera", "position", 0.1)]), feedback=feedback)


# --- what a monitor is shown ------------------------------------------------------------------------------------------


class Watch:
    """A detector that remembers what it is shown."""

    def monitor(self, primitive, task, dt, outputs):
        self.outputs, self.shown = outputs, []
        return SimpleNamespace(update=self._see, verdict=SimpleNamespace(failed=False))

    def _see(self, observed):
        self.shown.append(observed)
        return 0.0


@OF_EVERY_KIND
def test_the_monitor_is_shown_all_outputs_whatever_modulates(kind):
    p, task = movement(kind, 5)
    rng = np.random.default_rng(5)
    array, watch = SensorArray(p, mixed_sensors(rng, p)), Watch()
    values = readings(p, task, array, rng, 0.2)
    execution = OnlineExecution(p, task, DT, watch, sensors=array, feedback=["s1"])
    for row in values:
        execution.step(row)
    track = tracked(p, task, array, values)
    assert watch.outputs == array.outputs
    np.testing.assert_allclose([o.contributions for o in watch.shown], track.contributions, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose([o.innovation_variances for o in watch.shown], track.innovation_variances, rtol=1e-8)
    np.testing.assert_array_equal([o.signals for o in watch.shown], array.signals(values))


def test_the_monitor_is_shown_positions_as_the_best_sensor_has_them():
    p, task = movement("felt", 6)
    fine, coarse = state_sensor(p, "fine", "position:q1", 0.01, ["a"]), state_sensor(p, "coarse", "position:q1", 1.0, ["b"])
    rate = state_sensor(p, "rate", "velocity:q0", 0.1, ["c"])
    watch = Watch()
    execution = OnlineExecution(p, task, DT, watch, sensors=SensorArray(p, [coarse, rate, fine, ChannelSensor("force", 0.1)]))
    execution.step({"fine": 0.1, "coarse": 0.2, "rate": 0.3, "force": 0.4})
    np.testing.assert_array_equal(watch.shown[0].signals, [NAN, 0.1, 0.4])


def test_unless_told_positions_and_channels_are_measured_with_the_noise_of_the_demonstrations():
    p, task = movement("felt", 7)
    default, told = SensorArray(p), SensorArray(p, [state_sensor(p, "position", "position", np.sqrt(p.observation_variances))])
    assert default.names == told.names == ("position", "force")
    np.testing.assert_allclose(told.covariance, default.covariance, rtol=1e-15)
    np.testing.assert_array_equal(np.diagonal(default.covariance), p.signals.observation_variances)
    values = readings(p, task, default, np.random.default_rng(0))
    recording = recorded(default, values)
    np.testing.assert_array_equal(track_recording(p, task, recording).means, track_recording(p, task, recording, default).means)


def test_a_task_of_another_duration_has_its_own_rate():
    """Sensors that read velocities read them in seconds, whatever the task's duration."""
    p, _ = movement("joint", 8)
    array = SensorArray(p, [state_sensor(p, "gyro", "velocity", 1e-4)])
    slow = task_for(p, duration=2 * p.duration)
    execution = OnlineExecution(p, slow, DT, sensors=array)
    rolled = roll_out(p, slow, DT)
    for velocity in rolled.velocities[:-1]:
        step = execution.step(velocity)
    np.testing.assert_allclose(step.velocity, rolled.velocities[-1], atol=0.01 * np.abs(rolled.velocities).max())
