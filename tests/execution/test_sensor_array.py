"""All sensors of an execution as one observation: how outputs are grouped, drawn, and turned into lines."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_joint_primitive, make_primitive, random_sensors, seeds

from probdmp.dmp import task_for
from probdmp.errors import InputError, InputTypeError
from probdmp.execution import (
    ChannelSensor,
    LinearSensor,
    NonlinearSensor,
    OnlineExecution,
    SensorArray,
    sample_states,
    state_sensor,
)

NAN = np.nan


@pytest.fixture(scope="module")
def primitive():
    return make_primitive(np.random.default_rng(0), 2)


@pytest.fixture(scope="module")
def felt():
    return make_joint_primitive(np.random.default_rng(0), 2, channels=("force",))


# --- groups -----------------------------------------------------------------------------------------------------------


@given(seeds, st.integers(1, 4), st.sampled_from([False, "noise", True]))
def test_groups_hold_what_each_output_is(seed, n_sensors, coupling):
    """C, R and observations by group, put back into the order of the sensors, are those of the sensors."""
    rng = np.random.default_rng(seed)
    p = make_joint_primitive(rng, 3, 2, ("force",))
    sensors = random_sensors(rng, p, 0.1, n_sensors, coupling)
    array = SensorArray(p, sensors)
    assert array.is_coupled == bool(coupling)
    n_groups, size, n_states = array.matrix.shape
    assert n_groups * n_states == 3 * 4
    values = rng.standard_normal((5, len(array.outputs)))
    values[rng.random(values.shape) < 0.3] = NAN
    grouped = array.grouped(values)
    np.testing.assert_array_equal(array.flat(grouped.reshape(5, -1)), values)
    assert np.isnan(grouped).sum() - np.isnan(values).sum() == 5 * (n_groups * size - len(array.outputs))
    whole, noise = np.zeros((n_groups * size, 12)), np.zeros((n_groups * size,) * 2)
    for g in range(n_groups):
        rows = slice(g * size, (g + 1) * size)
        whole[rows, g * n_states : (g + 1) * n_states], noise[rows, rows] = array.matrix[g], array.noise[g]
    np.testing.assert_array_equal(array.flat_covariances(noise), array.covariance)
    expected = np.zeros((len(array.outputs), 12))
    for sensor in sensors:
        expected[array.slices[sensor.name], :9] = sensor.matrix
    expected[-1, 11] = 1.0  # the channel that no other measures keeps its own sensor
    np.testing.assert_array_equal(array.flat(whole.T).T, expected)
    seen = expected.reshape(-1, 3).any(axis=0)
    assert array.kinds == tuple(np.flatnonzero(seen))


def test_what_couples_degrees_of_freedom(primitive):
    position, velocity = (state_sensor(primitive, name, name, 0.1) for name in ("position", "velocity"))
    both = LinearSensor("sum", [[0, 0, 1, 0, 0, 1]], [1.0])
    shared = LinearSensor("shared", position.matrix, [[1.0, 0.5], [0.5, 1.0]], ["a", "b"])
    apart = LinearSensor("apart", position.matrix, [[1.0, 0.0], [0.0, 1.0]], ["a", "b"])
    one = LinearSensor("one", [[0, 0, 1, 0, 0, 0], [0, 1, 0, 0, 0, 0]], [[1.0, 0.5], [0.5, 1.0]], ["a", "b"])
    nothing = LinearSensor("nothing", [[0, 0, 0, 0, 0, 0]], [1.0])
    bent = NonlinearSensor("bent", lambda q: q[:1], 1.0)
    for sensors, coupled in (
        ([position, velocity], False), ([position, both], True), ([shared], True), ([apart], False), ([one], False),
        ([nothing], False), ([position, bent], True),
    ):  # fmt: skip
        assert SensorArray(primitive, sensors).is_coupled == coupled


def test_where_outputs_are(felt):
    camera, gyro = state_sensor(felt, "camera", "position", 0.1), state_sensor(felt, "gyro", "velocity:q1", 0.2)
    array = SensorArray(felt, [gyro, camera])
    assert array.names == ("gyro", "camera", "force")
    assert array.outputs == ("velocity_q1", "q0", "q1", "force")
    assert array.slices == {"gyro": slice(0, 1), "camera": slice(1, 3), "force": slice(3, 4)}
    variances = [0.2**2, 0.1**2, 0.1**2, felt.channels.observation_variances[0]]
    np.testing.assert_allclose(array.covariance, np.diag(variances), rtol=1e-15)
    np.testing.assert_array_equal(array.chosen(["force", "gyro"]), [True, False, False, True])
    assert not array.chosen(()).any()
    own = SensorArray(felt, [ChannelSensor("force", 0.5), camera])
    assert own.names == ("force", "camera")  # in the order given


# --- positions and channels as they are -------------------------------------------------------------------------------


def test_signals_are_what_is_measured_as_it_is(felt):
    scaled = LinearSensor("scaled", [[0, 0, 2, 0, 0, 0]], [1e-9], ["a"])  # twice the position is another thing
    silent = state_sensor(felt, "silent", "position:q0", np.inf, ["b"])
    fine, coarse = (
        state_sensor(felt, "fine", "position:q1", 0.01, ["c"]),
        state_sensor(felt, "coarse", "position:q1", 1.0, ["d"]),
    )
    values = np.array([[1.0, 2.0, 3.0, 4.0, 5.0], [1.0, 2.0, 3.0, NAN, 5.0]])
    array = SensorArray(felt, [scaled, silent, coarse, fine])
    np.testing.assert_array_equal(array.signals(values), [[NAN, 4.0, 5.0], [NAN, NAN, 5.0]])
    np.testing.assert_array_equal(SensorArray(felt).signals(values[:, :3]), values[:, :3])


# --- draws ------------------------------------------------------------------------------------------------------------


def test_draws_have_the_noise_of_the_sensors(primitive):
    rng = np.random.default_rng(1)
    sensors = [
        LinearSensor("linear", [[0, 0, 1, 0, 1, 0], [1, 0, 0, 0, 0, 1]], [[2.0, 0.8], [0.8, 1.0]]),
        NonlinearSensor("bent", lambda q: np.array([q[0] * q[1]]), 0.5),
        LinearSensor("silent", [[0, 0, 1, 0, 0, 0]], [np.inf]),
    ]
    array = SensorArray(primitive, sensors)
    states = rng.standard_normal((2000, 3, 6))
    drawn = array.draw(states, rng)
    assert drawn.shape == (2000, 3, 4)
    assert np.isnan(drawn[..., 3]).all()
    means = np.concatenate([states @ sensors[0].matrix.T, (states[..., 2] * states[..., 5])[..., None]], axis=-1)
    noise = (drawn[..., :3] - means).reshape(-1, 3)
    np.testing.assert_allclose(np.cov(noise.T), array.covariance[:3, :3], atol=0.07)
    assert np.abs(np.corrcoef(noise[:-3, 0], noise[3:, 0])[0, 1]) < 0.04  # white


# --- functions --------------------------------------------------------------------------------------------------------


def test_functions_get_the_states_they_read(felt):
    """By quantity, (D,) each, without channels; what they return may be a number."""
    shown = []

    def look(velocity, position):
        shown.append((velocity.copy(), position.copy()))
        return velocity[0] + position[1]

    array = SensorArray(felt, [NonlinearSensor("s", look, 0.1, reads=("velocity", "position"))])
    mean = np.arange(9.0)
    shown.clear()
    values, matrix, noise = array.lines(np.array([3.0, 0.0]), mean, np.eye(9))
    np.testing.assert_array_equal(shown[0], ([1.0, 4.0], [2.0, 5.0]))
    np.testing.assert_allclose(matrix, [[0, 1, 0, 0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0, 0, 1]], atol=1e-9)
    np.testing.assert_allclose(values, [3.0, 0.0], atol=1e-9)  # a linear function is its own line: the reading is the reading
    np.testing.assert_allclose(noise, array.covariance, rtol=1e-12)


def test_a_reading_that_wraps_is_compared_the_short_way_round(primitive):
    for linearization in ("extended", "unscented"):
        compass = NonlinearSensor("compass", lambda q: np.mod(q[:1], 1.0), 0.1, period=1.0, linearization=linearization)
        array = SensorArray(primitive, [compass])
        mean, covariance = np.array([0, 0, 0.98, 0, 0, 0.0]), 1e-4 * np.eye(6)
        values, matrix, _ = array.lines(np.array([0.03]), mean, covariance)
        np.testing.assert_allclose(values - matrix @ mean, [0.05], atol=1e-8)
        values, matrix, _ = array.lines(np.array([NAN]), mean, covariance)
        assert np.isnan(values).all()


@pytest.mark.parametrize(
    ("changes", "error", "match"),
    [
        ({"function": lambda q: q}, InputError, r"what the function of sensor 's' returns of shape \(1,\), got \(2,\)"),
        ({"function": lambda q: np.array([NAN])}, InputError, r"what the function of sensor 's' returns finite, got nan"),
        ({"function": lambda q: "left"}, InputTypeError, r"what the function of sensor 's' returns as real numbers"),
        ({"jacobian": lambda q: q}, InputError, r"what the Jacobian of sensor 's' returns of shape \(1, 2\), got \(2,\)"),
        ({"jacobian": lambda q: [[1.0, np.inf]]}, InputError, r"what the Jacobian of sensor 's' returns finite"),
    ],
)
def test_functions_that_return_something_else(primitive, changes, error, match):
    sensor = NonlinearSensor(**({"name": "s", "function": lambda q: q[:1], "covariance": 1.0} | changes))
    with pytest.raises(error, match=match):
        OnlineExecution(primitive, task_for(primitive), 0.1, sensors=SensorArray(primitive, [sensor])).step([0.1])


@settings(max_examples=10)
@given(seeds)
def test_lines_of_a_batch_are_those_of_its_members(seed):
    rng = np.random.default_rng(seed)
    p = make_primitive(rng, 2)
    bent = NonlinearSensor("bent", lambda q: np.array([np.sin(q[0]) * q[1]]), 0.1, linearization="unscented")
    array = SensorArray(p, [bent, state_sensor(p, "gyro", "velocity", 0.2)])
    states = sample_states(p, task_for(p), p.duration / 4, 3, rng).reshape(3, -1, 6)
    covariances = np.einsum("ntij,ntkj->ntik", *[rng.standard_normal((*states.shape[:2], 6, 6))] * 2)
    readings = array.draw(states, rng)
    readings[0, 1, 0] = NAN
    together = array.lines(readings, states, covariances)
    for index in np.ndindex(readings.shape[:2]):
        alone = array.lines(readings[index], states[index], covariances[index])
        for a, b in zip(together, alone, strict=True):
            np.testing.assert_array_equal(a[index], b)
