"""What a sensor may be, and what is said of one that cannot be."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from strategies import make_joint_primitive, make_primitive

from probdmp.errors import InputError, InputTypeError
from probdmp.execution import ChannelSensor, LinearSensor, NonlinearSensor, SensorArray, default_sensors, state_sensor

C = np.array([[0.0, 0.0, 1.0, 0.0, 1.0, 0.0]])
BOTH = np.array([[0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 1.0, 0.0]])


@pytest.fixture(scope="module")
def primitive():
    return make_primitive(np.random.default_rng(0), 2)


@pytest.fixture(scope="module")
def felt():
    return make_joint_primitive(np.random.default_rng(0), 2, channels=("force", "torque"))


def total(position):
    return np.array([position.sum()])


# --- what they become -------------------------------------------------------------------------------------------------


def test_variances_become_a_covariance():
    for given, wanted in (
        ([1.0, 4.0], [[1, 0], [0, 4]]),
        (np.array([[2.0, 1.0], [1.0, 3.0]]), [[2, 1], [1, 3]]),
        ([1, np.inf], [[1, 0], [0, np.inf]]),
        ([[2.0, 1.0], [1.0, np.inf]], [[2, 0], [0, np.inf]]),  # what says nothing shares nothing
    ):
        np.testing.assert_array_equal(LinearSensor("s", BOTH, given).covariance, wanted)
        np.testing.assert_array_equal(NonlinearSensor("s", total, given).covariance, wanted)
    np.testing.assert_array_equal(NonlinearSensor("s", total, 0.5).covariance, [[0.5]])
    np.testing.assert_array_equal(ChannelSensor("force", 0.5).covariance, [[0.5]])


def test_outputs_are_named_after_the_sensor_unless_given():
    assert LinearSensor("s", C, [1.0]).outputs == ("s",)
    assert LinearSensor("s", BOTH, [1.0, 1.0]).outputs == ("s_0", "s_1")
    assert LinearSensor("s", BOTH, [1.0, 1.0], ["a", "b"]).outputs == ("a", "b")
    assert NonlinearSensor("s", total, [1.0, 1.0]).outputs == ("s_0", "s_1")
    assert ChannelSensor("force", 1.0).outputs == ("force",)
    assert [s.n_outputs for s in (LinearSensor("s", BOTH, [1, 1]), NonlinearSensor("s", total, 1), ChannelSensor("f", 1))] == [
        2,
        1,
        1,
    ]


def test_one_quantity_may_be_read_without_a_list():
    assert NonlinearSensor("s", total, 1.0, reads="velocity").reads == ("velocity",)
    assert NonlinearSensor("s", total, 1.0, reads=["velocity", "position"]).reads == ("velocity", "position")


def test_they_are_frozen_and_keep_copies():
    matrix, noise = C.copy(), np.array([1.0])
    sensor = LinearSensor("s", matrix, noise)
    matrix[:], noise[:] = 7.0, 7.0
    np.testing.assert_array_equal(sensor.matrix, C)
    np.testing.assert_array_equal(sensor.covariance, [[1.0]])
    for array in (sensor.matrix, sensor.covariance):
        assert not array.flags.writeable
    with pytest.raises(FrozenInstanceError):
        sensor.gate = 3.0


# --- states as they are -----------------------------------------------------------------------------------------------


def test_a_state_sensor_has_a_one_for_each_output(primitive):
    velocity = state_sensor(primitive, "gyro", "velocity", [0.1, 0.2])
    np.testing.assert_array_equal(velocity.matrix, [[0, 1, 0, 0, 0, 0], [0, 0, 0, 0, 1, 0]])
    np.testing.assert_allclose(velocity.covariance, np.diag([0.01, 0.04]), rtol=1e-15)
    assert velocity.outputs == ("velocity_q0", "velocity_q1")
    mixed = state_sensor(primitive, "mixed", ["position:q1", "acceleration:q0"], 0.5, gate=3.0)
    np.testing.assert_array_equal(mixed.matrix, [[0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 0]])
    assert (mixed.outputs, mixed.gate) == (("q1", "acceleration_q0"), 3.0)
    single = state_sensor(primitive, "single", "acceleration:q1", np.inf, ["a"])
    np.testing.assert_array_equal(single.covariance, [[np.inf]])
    assert (single.matrix.tolist(), single.outputs) == ([[0, 0, 0, 1, 0, 0]], ("a",))


def test_by_default_positions_and_channels_are_measured(primitive, felt):
    (position,) = default_sensors(primitive)
    np.testing.assert_array_equal(position.matrix, np.eye(6)[[2, 5]])
    np.testing.assert_array_equal(position.covariance, np.diag(primitive.observation_variances))  # to the last bit
    assert (position.name, position.outputs) == ("position", primitive.names)
    _, force, torque = default_sensors(felt)
    assert (force.name, torque.name) == ("force", "torque")
    np.testing.assert_array_equal(torque.covariance[0], felt.channels.observation_variances[1:])


@pytest.mark.parametrize(
    ("measures", "stds", "error", "match"),
    [
        (
            "speed",
            1.0,
            InputError,
            r"what sensor 's' measures to be one of 'acceleration', 'velocity', .*, got 'speed'",
        ),
        (
            "velocity:z",
            1.0,
            InputError,
            r"degree of freedom after the colon in 'velocity:z' to be one of 'q0', 'q1', got 'z'",
        ),
        (["velocity"], 1.0, InputError, r"the degree of freedom after the colon in 'velocity' to be one of"),
        ("position", [1.0, 2.0, 3.0], InputError, r"stds of sensor 's' of shape \(2,\), got \(3,\)"),
        ("position", 0.0, InputError, r"stds of sensor 's' > 0, got 0"),
        ("position", [0.1, -0.1], InputError, r"stds of sensor 's' > 0, got -0\.1"),
        ("position", np.nan, InputError, r"stds of sensor 's' finite, got nan"),
        ("position", "small", InputTypeError, r"stds of sensor 's' as real numbers"),
        (
            ["position:q0", "position:q0"],
            1.0,
            InputError,
            r"2 different names for the outputs of .*, got \('q0', 'q0'\)",
        ),
        ([], 1.0, InputError, r"matrix of sensor 's'|at least one output"),
    ],
)
def test_states_that_cannot_be_measured(primitive, measures, stds, error, match):
    with pytest.raises(error, match=match):
        state_sensor(primitive, "s", measures, stds)


# --- what cannot be ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "error", "match"),
    [
        (
            {"matrix": np.ones((1, 5))},
            InputError,
            r"matrix of sensor 's' with 3 D columns, got \(1, 5\)\. Three for",
        ),
        ({"matrix": np.ones((0, 6))}, InputError, r"matrix of sensor 's' with 3 D columns"),
        ({"matrix": np.ones(6)}, InputError, r"matrix of sensor 's' of shape \(O, 3 D\), got \(6,\)"),
        ({"matrix": np.full((1, 6), np.nan)}, InputError, r"matrix of sensor 's' finite"),
        ({"matrix": [["a"] * 6]}, InputTypeError, r"matrix of sensor 's' as real numbers"),
        ({"covariance": [1.0, 1.0]}, InputError, r"covariance of sensor 's' of shape \(1, 1\), got \(2,\)"),
        (
            {"covariance": [0.0]},
            InputError,
            r"covariance of sensor 's' symmetric and positive .* infinite if it says",
        ),
        ({"covariance": [-1.0]}, InputError, "symmetric and positive definite"),
        ({"covariance": [-np.inf]}, InputError, r"covariance of sensor 's' finite"),
        ({"covariance": [np.nan]}, InputError, r"covariance of sensor 's' finite"),
        ({"covariance": ["1"]}, InputTypeError, r"covariance of sensor 's' as real numbers, got dtype"),
        ({"matrix": BOTH, "covariance": [[1.0, 0.5], [0.4, 1.0]]}, InputError, "symmetric and positive definite"),
        ({"matrix": BOTH, "covariance": [[1.0, 2.0], [2.0, 1.0]]}, InputError, "symmetric and positive definite"),
        ({"name": 3}, InputTypeError, r"the name of a sensor as text, and its outputs as a list of names, got 3"),
        ({"name": ""}, InputTypeError, "the name of a sensor as text"),
        ({"outputs": "x"}, InputTypeError, "outputs as a list of names, got 's', 'x'"),
        ({"outputs": ("x", "y")}, InputError, r"1 different names for the outputs of sensor 's', got \('x', 'y'\)"),
        ({"outputs": (1,)}, InputError, "1 different names for the outputs"),
        ({"matrix": BOTH, "covariance": [1, 1], "outputs": ("x", "x")}, InputError, "2 different names"),
        ({"gate": 0.0}, InputError, r"gate of sensor 's' > 0 in standard deviations, got 0\.0"),
        ({"gate": "wide"}, InputTypeError, "gate of sensor 's' > 0"),
    ],
)
def test_linear_sensors_that_cannot_be(changes, error, match):
    with pytest.raises(error, match=match):
        LinearSensor(**({"name": "s", "matrix": C, "covariance": [1.0]} | changes))


@pytest.mark.parametrize(
    ("changes", "error", "match"),
    [
        ({"function": 3}, InputTypeError, r"functions for sensor 's', got 3 and None"),
        ({"jacobian": np.ones((1, 2))}, InputTypeError, "functions for sensor 's'"),
        ({"reads": ("speed",)}, InputError, r"what sensor 's' reads to be one of .*, got 'speed'"),
        ({"reads": ()}, InputError, r"different quantities that sensor 's' reads, got \(\)"),
        ({"reads": ("position", "position")}, InputError, "different quantities"),
        ({"linearization": "particles"}, InputError, r"linearization to be one of 'extended', 'unscented', got 'particles'"),
        ({"period": 0.0}, InputError, "period > 0"),
        ({"covariance": [[1.0, 0.0]]}, InputError, r"covariance of sensor 's' of shape \(1, 1\), got \(1, 2\)"),
        ({"covariance": []}, InputError, r"at least one output of sensor 's'"),
        ({"covariance": [0.0]}, InputError, "symmetric and positive definite"),
    ],
)
def test_nonlinear_sensors_that_cannot_be(changes, error, match):
    with pytest.raises(error, match=match):
        NonlinearSensor(**({"name": "s", "function": total, "covariance": [1.0]} | changes))


# --- all of them together ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("sensors", "error", "match"),
    [
        ([], InputError, "at least one sensor, got none"),
        (LinearSensor("s", C, [1.0]), InputTypeError, "sensors as a list of LinearSensor, NonlinearSensor or ChannelSensor"),
        ([C], InputTypeError, "sensors as a list"),
        ([LinearSensor("s", C, [1.0])] * 2, InputError, r"sensors with different names, got \['s', 's'"),
        (
            [LinearSensor("s", C, [1.0], ["x"]), LinearSensor("t", C, [1.0], ["x"])],
            InputError,
            r"sensors with different outputs, got \['x', 'x'",
        ),
        ([LinearSensor("s", np.ones((1, 9)), [1.0])], InputError, r"matrix of sensor 's' with 6 columns, got 9\. Acceleration"),
        (
            [ChannelSensor("heat", 1.0)],
            InputError,
            r"channel that was learned, one of \('force', 'torque'\), got 'heat'\. Learn",
        ),
        # It would hide the channel, which nothing else measures.
        (
            [LinearSensor("force", C, [1.0], ["x"])],
            InputError,
            r"sensors with different names, got \['force', 'force', 'torque'\]",
        ),
        (
            [LinearSensor("s", C, [1.0], ["force"])],
            InputError,
            r"sensors with different outputs, got \['force', 'force', 'torque'\]",
        ),
    ],
)
def test_sensors_that_do_not_go_together(felt, sensors, error, match):
    with pytest.raises(error, match=match):
        SensorArray(felt, sensors)
