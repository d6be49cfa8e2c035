"""Trajectories with uncertainty: what the properties are called and what they mean."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from probdmp.execution import GaussianTrajectory, TrackedTrajectory

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


def test_innovation_covariances_are_diagonal(trajectory):
    zeros, variances = np.zeros((2, 2)), np.array([[1.0, 2.0], [3.0, 4.0]])
    fields = (trajectory.times, trajectory.means, trajectory.covariances, ("x", "y"), "mm", zeros[0], zeros, zeros)
    tracked = TrackedTrajectory(*fields, innovation_variances=variances)
    np.testing.assert_array_equal(tracked.innovation_covariances, [[[1, 0], [0, 2]], [[3, 0], [0, 4]]])
    for name in ("log_likelihoods", "contributions", "innovations", "innovation_variances"):
        assert not getattr(tracked, name).flags.writeable
