"""Trajectories with uncertainty: what the properties are called and what they mean."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from strategies import make_primitive

from probdmp.execution import GaussianChannel, GaussianTrajectory, SensorArray, TrackedTrajectory, state_sensor

COVARIANCE = np.array([[4.0, 0.5, 0.1], [0.5, 9.0, 0.2], [0.1, 0.2, 16.0]])


@pytest.fixture
def trajectory():
    means = np.arange(12.0).reshape(2, 2, 3)
    return GaussianTrajectory(np.array([0.0, 0.1]), means, np.broadcast_to(COVARIANCE, (2, 2, 3, 3)), ("x", "y"), "mm")


def test_the_order_is_acceleration_velocity_position(trajectory):
    np.testing.assert_array_equal(trajectory.accelerations, [[0, 3], [6, 9]])
    np.testing.assert_array_equal(trajectory.velocities, [[1, 4], [7, 10]])
    np.testing.assert_array_equal(trajectory.positions, [[2, 5], [8, 11]])


def test_standard_deviations_are_roots_of_the_diagonal(trajectory):
    np.testing.assert_array_equal(trajectory.acceleration_stds, np.full((2, 2), 2.0))
    np.testing.assert_array_equal(trajectory.velocity_stds, np.full((2, 2), 3.0))
    np.testing.assert_array_equal(trajectory.position_stds, np.full((2, 2), 4.0))


def test_a_variance_below_zero_by_rounding_is_zero():
    tiny = GaussianTrajectory(np.zeros(1), np.zeros((1, 1, 3)), np.full((1, 1, 3, 3), -1e-30), ("x",), "")
    np.testing.assert_array_equal(tiny.position_stds, [[0.0]])


def test_it_is_frozen(trajectory):
    with pytest.raises(FrozenInstanceError):
        trajectory.times = np.zeros(2)


@pytest.mark.parametrize("name", ["times", "means", "covariances", "positions", "velocities", "accelerations"])
def test_its_arrays_are_read_only(trajectory, name):
    with pytest.raises(ValueError, match="read-only"):
        getattr(trajectory, name)[0] = 0


def test_a_tracked_trajectory_is_a_trajectory():
    assert issubclass(TrackedTrajectory, GaussianTrajectory)


@pytest.fixture
def tracked(trajectory):
    """Of two degrees of freedom whose positions a sensor measures, and one velocity another; the last reading is rejected."""
    array = SensorArray(primitive := make_primitive(np.random.default_rng(0)), two_sensors(primitive))
    covariances = np.array([np.diag([1.0, 2.0, 3.0]), [[4.0, 0.5, 0.0], [0.5, 5.0, 0.1], [0.0, 0.1, 6.0]]])
    innovations = np.array([[0.1, 0.2, np.nan], [np.nan, 0.4, 9.0]])
    return TrackedTrajectory(
        *(trajectory.times, trajectory.means, trajectory.covariances, primitive.names, "mm"),
        log_likelihoods=np.zeros(2),
        contributions=np.zeros((2, 3)),
        innovations=innovations,
        innovation_covariances=covariances,
        fused=np.array([[True, True, False], [False, True, False]]),
        array=array,
    )


def two_sensors(primitive):
    velocity = state_sensor(primitive, "gyro", "velocity:q1", 1.0, gate=3.0)
    return [state_sensor(primitive, "camera", "position", 1.0), velocity]


def test_innovation_variances_are_on_the_diagonal(tracked):
    np.testing.assert_array_equal(tracked.innovation_variances, [[1, 2, 3], [4, 5, 6]])
    assert tracked.outputs == ("q0", "q1", "velocity_q1")


@pytest.mark.parametrize("name", ["log_likelihoods", "contributions", "innovations", "innovation_covariances", "fused"])
def test_arrays_of_a_tracked_trajectory_are_read_only(tracked, name):
    assert not getattr(tracked, name).flags.writeable


def test_each_sensor_has_its_own_part(tracked):
    camera, gyro = tracked.sensors["camera"], tracked.sensors["gyro"]
    np.testing.assert_array_equal(camera.innovations, tracked.innovations[:, :2])
    np.testing.assert_array_equal(camera.innovation_covariances[1], [[4.0, 0.5], [0.5, 5.0]])
    np.testing.assert_array_equal(gyro.test_ratios, [np.nan, 9.0**2 / (3.0**2 * 6.0)])
    assert (camera.n_fused, camera.n_rejected, camera.n_missing) == (2, 0, 0)  # one output was missing, not the reading
    assert (gyro.n_fused, gyro.n_rejected, gyro.n_missing) == (0, 1, 1)
    assert repr(gyro) == "<SensorTrack: 0 readings used, 1 rejected, 1 missing>"


def test_channels_are_read_only_and_by_name(trajectory):
    force = GaussianChannel(np.zeros(2), np.ones(2))
    fields = (trajectory.times, trajectory.means, trajectory.covariances, ("x", "y"), "mm")
    felt = GaussianTrajectory(*fields, channels={"force": force})
    assert felt.channels["force"] is force
    assert not trajectory.channels
    with pytest.raises(TypeError, match="assignment"):
        felt.channels["torque"] = force
    for name in ("means", "stds"):
        assert not getattr(force, name).flags.writeable
