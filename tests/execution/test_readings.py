"""What a user has, as what an array of sensors has observed."""

import numpy as np
import pytest
from strategies import make_joint_primitive

from probdmp.demonstrations import Demonstration, channel_from_times
from probdmp.errors import InputError, InputTypeError
from probdmp.execution import SensorArray, recording_of_readings, state_sensor
from probdmp.execution.readings import observation_of, readings_of, stack_readings

NAN = np.nan


@pytest.fixture(scope="module")
def primitive():
    return make_joint_primitive(np.random.default_rng(0), 2, channels=("force",))


@pytest.fixture(scope="module")
def array(primitive):
    gyro = state_sensor(primitive, "gyro", "velocity", 0.1)
    return SensorArray(primitive, [gyro, state_sensor(primitive, "camera", "position:q1", 0.1)])


def recording(n=4, **channels):
    rng = np.random.default_rng(n)
    return Demonstration(rng.standard_normal((n, 2)), 0.1, names=("q0", "q1"), channels=channels)


# --- a recording ------------------------------------------------------------------------------------------------------


def test_outputs_are_columns_of_their_names(array):
    felt = recording(velocity_q1=np.arange(4.0), velocity_q0=-np.arange(4.0), force=np.ones(4), heat=np.zeros(4))
    table = readings_of(array, felt)
    assert array.outputs == ("velocity_q0", "velocity_q1", "q1", "force")
    wanted = [felt.channels["velocity_q0"], felt.channels["velocity_q1"], felt.positions[:, 1], np.ones(4)]
    np.testing.assert_array_equal(table, np.column_stack(wanted))


def test_a_channel_that_was_not_recorded_was_never_measured(array):
    table = readings_of(array, recording(velocity_q0=np.zeros(4), velocity_q1=np.zeros(4)))
    assert np.isnan(table[:, 3]).all()
    assert not np.isnan(table[:, :3]).any()


def test_a_sensor_that_was_not_recorded_is_an_error(array):
    match = r"recordings with the columns velocity_q0, velocity_q1 of sensor 'gyro', got one without velocity_q1\. The outputs"
    with pytest.raises(InputError, match=match):
        readings_of(array, recording(velocity_q0=np.zeros(4)))


def test_bare_arrays_have_the_columns_of_the_primitive(primitive):
    bare = Demonstration(np.arange(8.0).reshape(4, 2), 0.1)
    camera = SensorArray(primitive, [state_sensor(primitive, "camera", ["position:q1", "position:q0"], 0.1)])
    np.testing.assert_array_equal(readings_of(camera, bare)[:, :2], bare.positions[:, ::-1])


def test_side_by_side_shorter_ones_end_in_nan(primitive):
    array, short, long = SensorArray(primitive), recording(3), recording(5, force=np.ones(5))
    stacked = stack_readings(array, [short, long])
    assert stacked.shape == (5, 2, 3)
    np.testing.assert_array_equal(stacked[:3, 0, :2], short.positions)
    assert np.isnan(stacked[3:, 0]).all()
    np.testing.assert_array_equal(stacked[:, 1], np.column_stack([long.positions, np.ones(5)]))


def test_a_sensor_with_a_clock_of_its_own(primitive):
    """Its readings fall on the nearest samples; in between it has measured nothing."""
    seen = channel_from_times(recording(6), "gyro", [0.0, 0.19, 0.42], [[1.0, 2.0], [3.0, 4.0], [5.0, NAN]])
    gyro = SensorArray(primitive, [state_sensor(primitive, "gyro", "velocity", 0.1, ["gyro_0", "gyro_1"])])
    wanted = np.full((6, 2), NAN)
    wanted[[0, 2, 4]] = [[1, 2], [3, 4], [5, NAN]]
    np.testing.assert_array_equal(readings_of(gyro, seen)[:, :2], wanted)


# --- readings by name -------------------------------------------------------------------------------------------------


def test_readings_become_a_recording_that_gives_them_back(array):
    rng = np.random.default_rng(0)
    given_ones = {"camera": rng.standard_normal((4, 1)), "gyro": rng.standard_normal((4, 2)), "force": rng.standard_normal(4)}
    made = recording_of_readings(array, given_ones, 0.1)
    table = readings_of(array, made)
    for name, values in given_ones.items():
        np.testing.assert_array_equal(table[:, array.slices[name]], values.reshape(4, -1))
    assert np.isnan(made.positions[:, 0]).all()  # nothing measures the position of q0
    assert (made.names, made.dt) == (("q0", "q1"), 0.1)


def test_sensors_that_are_not_named_have_measured_nothing(array):
    table = readings_of(array, recording_of_readings(array, {"camera": np.arange(3.0)}, 0.1))
    np.testing.assert_array_equal(table, np.column_stack([np.full((3, 2), NAN), np.arange(3.0), np.full(3, NAN)]))


@pytest.mark.parametrize(
    ("given_ones", "error", "match"),
    [
        ({}, InputError, r"readings of the sensors 'gyro', 'camera', 'force', got none"),
        ({"radar": np.zeros(3)}, InputError, r"readings of the sensors .*, got one of 'radar'"),
        ({2: np.zeros(3)}, InputTypeError, "readings by name of their sensors, got 2"),
        ({"camera": np.zeros(3), "force": np.zeros(4)}, InputError, r"at the same times, got \[3, 4\] of them\. A sensor that"),
        ({"gyro": np.zeros((3, 3))}, InputError, r"readings of 'gyro' of shape \(T, 2\), got \(3, 3\)"),
        ({"gyro": np.zeros(4)}, InputError, r"readings of 'gyro' of shape \(T, 2\), got \(4,\)"),  # not two times
        ({"camera": np.zeros((3, 1, 1))}, InputError, r"readings of 'camera' of shape \(T, 1\)"),
        ({"camera": np.full(3, np.inf)}, InputError, "readings of 'camera' finite or NaN"),
    ],
)
def test_readings_that_are_none(array, given_ones, error, match):
    with pytest.raises(error, match=match):
        recording_of_readings(array, given_ones, 0.1)


# --- one tick ---------------------------------------------------------------------------------------------------------


def test_one_tick_by_name_or_in_a_row(array):
    for given_one, wanted in (
        (None, [NAN, NAN, NAN, NAN]), ({}, [NAN, NAN, NAN, NAN]), ({"camera": 3.0}, [NAN, NAN, 3.0, NAN]),
        ({"force": None, "gyro": [1, NAN]}, [1.0, NAN, NAN, NAN]), ([1, 2], [1, 2, NAN, NAN]), ([1, 2, 3, 4], [1, 2, 3, 4]),
        ({"camera": np.array([3.0])}, [NAN, NAN, 3.0, NAN]),
    ):  # fmt: skip
        np.testing.assert_array_equal(observation_of(array, given_one), wanted)
