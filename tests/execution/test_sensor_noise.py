"""The noise of each sensor by expectation maximisation: what it finds in data drawn from the model, and what it must not do."""

from dataclasses import replace

import numpy as np
import pytest
from sensed import nonlinear
from strategies import make_joint_primitive, make_primitive

from probdmp.demonstrations import Demonstration
from probdmp.dmp import task_for
from probdmp.errors import InputError, InputTypeError
from probdmp.execution import (
    ChannelSensor,
    LinearSensor,
    NonlinearSensor,
    SensorArray,
    estimate_sensor_noise,
    sample_recordings,
    score_recordings,
    state_sensor,
)

STEPS = 41
DT = 1 / (STEPS - 1)
CORRELATED = np.array([[1.0, 0.6], [0.6, 1.5]]) * 0.05**2


def movement(kind, steps=STEPS):
    """A movement of a second, and its task from a start that nobody knows."""
    rng = np.random.default_rng(0)
    changes = {"duration": 1.0, "phase_step": 1 / (steps - 1), "observation_variances": np.full(2, 1e-3)}
    if kind == "independent":
        p = make_primitive(rng, 2, 5, **changes)
    else:
        p = make_joint_primitive(rng, 2, 3, ("force",) if kind == "felt" else (), **changes)
    return p, task_for(p, np.full(2, np.nan))


def sensors_of(p):
    """A camera of both positions, whose errors go together, and a gyroscope."""
    camera = LinearSensor("camera", np.eye(6)[[2, 5]], CORRELATED, p.names)
    return [camera, state_sensor(p, "gyro", "velocity", [0.3, 0.6])]


def guessed(sensors):
    """Wrong by a factor of four in either direction."""
    return [replace(s, covariance=np.diagonal(s.covariance) * np.resize([4.0, 0.25], s.n_outputs)) for s in sensors]


def drawn(p, task, sensors, n, seed=1, dt=DT):
    return sample_recordings(p, task, dt, n, np.random.default_rng(seed), SensorArray(p, sensors))


def total(p, tasks, recordings, sensors):
    """Log-likelihood of recordings; where the start was not told all of it counts."""
    return score_recordings(p, tasks, recordings, SensorArray(p, sensors)).sum()


def assert_never_falls(noise):
    steps = np.diff(noise.log_likelihoods)
    assert np.all(steps >= -1e-9 * np.abs(noise.log_likelihoods[1:]))


def assert_found(noise, sensors, within):
    for found, true in zip(noise.sensors, sensors, strict=False):
        stds = np.sqrt(np.diagonal(true.covariance))
        np.testing.assert_allclose(found.covariance / np.outer(stds, stds), true.covariance / np.outer(stds, stds), atol=within)


# --- what it finds ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "told"), [("independent", False), ("independent", True), ("joint", False), ("felt", True)])
def test_each_noise_is_found_within_five_percent(kind, told):
    p, unknown = movement(kind)
    task = task_for(p) if told else unknown
    sensors = sensors_of(p) + ([ChannelSensor("force", 0.05)] if kind == "felt" else [])
    recordings = drawn(p, task, sensors, 220)
    noise = estimate_sensor_noise(p, guessed(sensors), [task] * 220, recordings, "full")
    assert noise.converged
    assert_never_falls(noise)
    assert_found(noise, sensors, within=0.05)
    assert np.diff(noise.log_likelihoods).sum() > 100


def test_gaps_and_slow_sensors_do_not_matter():
    """A gyroscope at every third sample, and a tenth of the readings of the camera lost."""
    p, task = movement("independent")
    sensors, rng, gappy = sensors_of(p), np.random.default_rng(2), []
    for r in drawn(p, task, sensors, 240):
        positions = np.where(rng.random((STEPS, 1)) < 0.1, np.nan, r.positions)
        slow = {name: np.where(np.arange(STEPS) % 3 == 1, values, np.nan) for name, values in r.channels.items()}
        gappy.append(replace(r, positions=positions, channels=slow))
    noise = estimate_sensor_noise(p, guessed(sensors), [task] * 240, gappy, "full")
    assert noise.converged
    assert_never_falls(noise)
    assert_found(noise, sensors, within=0.06)


@pytest.mark.parametrize("kind", ["independent", "felt"])
def test_what_is_found_is_the_likeliest(kind):
    """A change of any entry of R, up or down, makes the recordings less likely, but for the tolerance of the iteration."""
    p, task = movement(kind, 15)
    sensors = sensors_of(p)
    recordings = drawn(p, task, sensors, 30, dt=1 / 14)
    noise = estimate_sensor_noise(p, guessed(sensors), [task] * 30, recordings, "full")
    best = total(p, [task] * 30, recordings, noise.sensors)
    assert best >= noise.log_likelihoods[-1] - 1e-6 * abs(best)
    for i, sensor in enumerate(noise.sensors[:2]):
        factor = np.linalg.cholesky(sensor.covariance)
        for a, b, step in ((0, 0, 0.1), (1, 1, 0.1), (0, 1, 0.1)):
            for sign in (1, -1):
                bent = np.eye(2)
                bent[a, b] += sign * step
                bent[b, a] = bent[a, b]
                changed = list(noise.sensors)
                changed[i] = replace(sensor, covariance=_symmetric(factor @ bent @ factor.T))
                assert total(p, [task] * 30, recordings, changed) < best


def _symmetric(matrix):
    return (matrix + matrix.T) / 2


@pytest.mark.parametrize("linearization", ["extended", "unscented"])
def test_functions_that_are_linear_have_the_noise_of_linear_sensors(linearization):
    p, task = movement("joint", 7)
    sensors = sensors_of(p)
    recordings = drawn(p, task, sensors, 2, dt=1 / 6)
    exact = estimate_sensor_noise(p, guessed(sensors), [task] * 2, recordings)
    curved = [nonlinear(s, linearization, jacobian=True) for s in guessed(sensors)]
    other = estimate_sensor_noise(p, curved, [task] * 2, recordings)
    np.testing.assert_allclose(other.log_likelihoods, exact.log_likelihoods, rtol=1e-6)
    for one, same in zip(exact.sensors, other.sensors, strict=True):
        np.testing.assert_allclose(same.covariance, one.covariance, rtol=1e-4, atol=1e-4 * one.covariance.max())


def radar(covariance, linearization):
    """Distance and bearing of a point, from three units away."""

    def look(q):
        return np.array([np.hypot(q[0] + 3, q[1]), np.arctan2(q[1], q[0] + 3)])

    def jacobian(q):
        r = np.hypot(q[0] + 3, q[1])
        return np.array([[(q[0] + 3) / r, q[1] / r], [-q[1] / r**2, (q[0] + 3) / r**2]])

    return NonlinearSensor("radar", look, covariance, jacobian, linearization=linearization, period=2 * np.pi)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["independent", "joint"])
@pytest.mark.parametrize("linearization", ["extended", "unscented"])
def test_the_noise_of_a_radar_is_found_within_five_percent(kind, linearization):
    p, task = movement(kind)
    sensors = [radar(CORRELATED, linearization), state_sensor(p, "gyro", "velocity", [0.3, 0.6])]
    recordings = drawn(p, task, sensors, 150)
    noise = estimate_sensor_noise(p, guessed(sensors), [task] * 150, recordings, "full")
    assert noise.converged
    assert_never_falls(noise)
    assert_found(noise, sensors, within=0.05)


# --- full or diagonal -------------------------------------------------------------------------------------------------


def test_as_given_a_diagonal_noise_stays_diagonal():
    p, task = movement("independent", 11)
    camera, gyro = sensors_of(p)
    recordings = drawn(p, task, [camera, gyro], 10, dt=0.1)
    given_ones = [camera, replace(gyro, covariance=np.diagonal(gyro.covariance))]
    for covariance, full in (("as_given", (True, False)), ("full", (True, True)), ("diagonal", (False, False))):
        noise = estimate_sensor_noise(p, given_ones, [task] * 10, recordings, covariance)
        assert tuple(bool(s.covariance[0, 1] != 0) for s in noise.sensors) == full


@pytest.mark.parametrize("kind", ["independent", pytest.param("joint", marks=pytest.mark.slow)])
def test_auto_is_full_where_errors_go_together(kind):
    p, task = movement(kind, 15)
    camera, gyro = sensors_of(p)
    strong = replace(camera, covariance=np.array([[1.0, 0.9], [0.9, 1.0]]) * 0.05**2)
    recordings = drawn(p, task, [strong, gyro], 15, dt=1 / 14)
    first = [replace(camera, covariance=[0.05**2] * 2), gyro]
    found = estimate_sensor_noise(p, first, [task] * 15, recordings, "auto").sensors[0].covariance
    assert found[0, 1] / np.sqrt(found[0, 0] * found[1, 1]) == pytest.approx(0.9, abs=0.05)


def test_auto_is_diagonal_where_they_do_not():
    """In most data sets; in the others the correlation that it takes for one is small."""
    p, task = movement("independent", 15)
    camera = state_sensor(p, "camera", "position", 0.05)
    correlations = []
    for seed in range(3):
        recordings = drawn(p, task, [camera], 15, seed, 1 / 14)
        found = estimate_sensor_noise(p, [camera], [task] * 15, recordings, "auto").sensors[0].covariance
        correlations.append(found[0, 1] / np.sqrt(found[0, 0] * found[1, 1]))
    assert np.mean(np.array(correlations) == 0) >= 0.6
    assert np.max(np.abs(correlations)) < 0.3


def test_auto_needs_recordings_to_leave_out():
    p, task = movement("independent", 11)
    sensors = sensors_of(p)
    noise = estimate_sensor_noise(p, sensors, [task], drawn(p, task, sensors, 1, dt=0.1), "auto")
    assert not any(s.covariance[0, 1] for s in noise.sensors)


# --- what stays as it is ----------------------------------------------------------------------------------------------


def test_all_but_the_noise_stays_as_it_was():
    p, task = movement("felt", 11)
    sensors = [replace(s, gate=3.0) for s in sensors_of(p)]
    recordings = drawn(p, task, sensors, 10, dt=0.1)
    noise = estimate_sensor_noise(p, sensors, [task] * 10, recordings)
    for before, after in zip(sensors, noise.sensors, strict=False):
        assert (after.name, after.outputs, after.gate) == (before.name, before.outputs, 3.0)
        np.testing.assert_array_equal(after.matrix, before.matrix)
    assert noise.sensors[2].name == "force"  # which was not asked for
    np.testing.assert_array_equal(noise.sensors[2].covariance[0], p.channels.observation_variances)
    bare = [replace(r, channels={k: v for k, v in r.channels.items() if k != "force"}) for r in recordings]
    estimate_sensor_noise(p, sensors, [task] * 10, bare)  # nor is it needed then


def test_gates_are_open_while_it_learns():
    """Those that are too narrow would let pass only what confirms them."""
    p, task = movement("joint", 15)
    sensors = sensors_of(p)
    recordings = drawn(p, task, sensors, 20, dt=1 / 14)
    first = [replace(s, covariance=s.covariance * 0.01) for s in sensors]
    open_ones = estimate_sensor_noise(p, first, [task] * 20, recordings)
    gated = estimate_sensor_noise(p, [replace(s, gate=1.0) for s in first], [task] * 20, recordings)
    assert_never_falls(gated)
    np.testing.assert_array_equal(gated.log_likelihoods, open_ones.log_likelihoods)
    np.testing.assert_array_equal(gated.sensors[0].covariance, open_ones.sensors[0].covariance)


def test_units_scale_the_noise():
    p, task = movement("independent", 11)
    camera, gyro = sensors_of(p)
    recordings = drawn(p, task, [camera, gyro], 10, dt=0.1)
    inches = LinearSensor("camera", camera.matrix * 40, camera.covariance * 1600, ("x", "y"))
    seen = [replace(r, channels=dict(r.channels) | dict(zip("xy", 40 * r.positions.T, strict=True))) for r in recordings]
    one = estimate_sensor_noise(p, [camera, gyro], [task] * 10, recordings)
    other = estimate_sensor_noise(p, [inches, gyro], [task] * 10, seen)
    np.testing.assert_allclose(other.sensors[0].covariance, 1600 * one.sensors[0].covariance, rtol=1e-6)
    np.testing.assert_allclose(other.sensors[1].covariance, one.sensors[1].covariance, rtol=1e-6, atol=1e-9)


# --- what cannot be learned -------------------------------------------------------------------------------------------


def without(recordings, *names):
    blank = np.full(recordings[0].n_samples, np.nan)
    return [replace(r, channels={k: blank if k in names else v for k, v in r.channels.items()}) for r in recordings]


@pytest.mark.parametrize("covariance", ["diagonal", "full", "auto"])
def test_an_output_that_was_never_measured_has_no_noise_to_learn(covariance):
    """Least of all one of nothing."""
    p, task = movement("independent", 11)
    sensors = sensors_of(p)
    recordings = drawn(p, task, sensors, 6, dt=0.1)
    for lost in (["velocity_q1"], ["velocity_q0", "velocity_q1"]):
        with pytest.raises(InputError, match=r"recordings in which sensor 'gyro' has measured .* of its outputs.*, got none"):
            estimate_sensor_noise(p, sensors, [task] * 6, without(recordings, *lost), covariance)


@pytest.mark.parametrize(
    ("changes", "error", "match"),
    [
        ({"covariance": "round"}, InputError, "covariance to be one of 'as_given', 'full', 'diagonal', 'auto', got 'round'"),
        ({"tasks": []}, InputError, "one task for each of 3 recordings, got 0"),
        ({"tasks": None}, InputTypeError, "tasks as a list of Task"),
        ({"sensors": []}, InputError, "at least one sensor"),
        ({"sensors": "camera"}, InputTypeError, "sensors as a list of"),
        (
            {"sensors": [LinearSensor("camera", np.eye(6)[[2, 5]], [1.0, np.inf], ("q0", "q1"))]},
            InputError,
            r"a finite first guess of the noise of sensor 'camera', got an infinite one",
        ),
        ({"recordings": [Demonstration(np.zeros((9, 2)), 0.1, names=("q0", "q1"))] * 3}, InputError, "columns velocity_q0"),
    ],
)
def test_arguments_that_cannot_be(changes, error, match):
    p, task = movement("independent", 11)
    sensors = sensors_of(p)
    arguments = {"sensors": sensors, "tasks": [task] * 3, "recordings": drawn(p, task, sensors, 3, dt=0.1)} | changes
    with pytest.raises(error, match=match):
        estimate_sensor_noise(p, **arguments)
