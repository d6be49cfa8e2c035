"""What is known about a path before it begins, against dense Gaussian conditioning."""

from dataclasses import replace

import numpy as np
import pytest
from strategies import make_joint_primitive

from probdmp.detection.path_model import CLOCK_SHARE, CLOCK_STD, NOISE_FLOOR, path_model
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.profile import ExecutionProfile
from probdmp.dmp import path_distribution


@pytest.fixture(scope="module")
def primitive(varied):
    return varied["s"].primitive_


@pytest.fixture(scope="module")
def profile(training):
    return ExecutionProfile.of(training["s"])


@pytest.fixture(scope="module")
def dense(primitive):
    """Mean (M D,) and covariance of displacements in ranges, before anything is told."""
    path = path_distribution(primitive, TICKS + 1)
    ranges = np.tile(primitive.ranges, TICKS + 1)
    return path.means.ravel() / ranges, path.covariance.reshape(len(ranges), -1) / np.outer(ranges, ranges)


@pytest.fixture(scope="module")
def clock(primitive, dense):
    """(M D, M D) covariance of m'(t) e_t - m'(0) e_0 where the times e of samples are off independently."""
    std = max(CLOCK_STD, CLOCK_SHARE * TICKS * primitive.phase_step)
    slopes = std * np.gradient(dense[0].reshape(-1, 2), axis=0)
    errors = np.zeros((TICKS + 1, 2, TICKS + 1))
    for t in range(1, TICKS + 1):
        errors[t, :, t], errors[t, :, 0] = slopes[t], -slopes[0]
    errors = errors.reshape(-1, TICKS + 1)
    return errors @ errors.T


@pytest.mark.parametrize("told", [[0.3, -0.8], [1.1, 0.2]])
def test_a_told_goal_is_conditioned_on(primitive, profile, dense, clock, told):
    mean, covariance = dense
    noise = np.diag((profile.noise_stds / primitive.ranges) ** 2 + NOISE_FLOOR**2)
    end = slice(TICKS * 2, None)
    gain = covariance[:, end] @ np.linalg.inv(covariance[end, end] + noise)
    model = path_model(primitive, profile, knows_goal=True)
    np.testing.assert_allclose(model.noise_variances, np.diag(noise), rtol=1e-12)
    np.testing.assert_allclose(model.means_for(np.array([told]))[0].ravel(), mean + gain @ (told - mean[end]), atol=1e-9)
    found = model.covariance.reshape(covariance.shape)
    np.testing.assert_allclose(found, covariance - gain @ covariance[end] + clock, atol=1e-9)


def test_a_goal_that_is_not_told_moves_nothing(primitive, profile, dense):
    """In one degree of freedom: as if it were where it is expected."""
    mean = dense[0].reshape(-1, 2)
    model = path_model(primitive, profile, knows_goal=True)
    partly, expected, untold = model.means_for(np.array([[0.4, np.nan], [0.4, mean[-1, 1]], [np.nan, np.nan]]))
    np.testing.assert_allclose(partly, expected, atol=1e-12)
    np.testing.assert_allclose(untold, mean, atol=1e-12)


def test_without_a_goal_executions_may_be_slower_or_faster(primitive, profile, dense, clock):
    mean, covariance = dense
    model = path_model(primitive, profile, knows_goal=False)
    for goals in ([[0.4, -3.0]], [[np.nan, np.nan]]):
        np.testing.assert_allclose(model.means_for(np.array(goals))[0].ravel(), mean, atol=1e-12)
    phases = np.linspace(0, 1, TICKS + 1)
    velocities = np.gradient(mean.reshape(-1, 2), phases, axis=0)
    stretch = (float(profile.tempo_std) * phases[:, None] * velocities).ravel()
    found = model.covariance.reshape(covariance.shape)
    np.testing.assert_allclose(found, covariance + np.outer(stretch, stretch) + clock, atol=1e-12)


@pytest.mark.parametrize("knows_goal", [True, False])
def test_covariances_are_those_of_something(primitive, profile, knows_goal):
    covariance = path_model(primitive, profile, knows_goal).covariance.reshape((TICKS + 1) * 2, -1)
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-12)
    assert np.linalg.eigvalsh(covariance).min() > -1e-9
    np.testing.assert_allclose(covariance[:2], 0, atol=1e-12)  # displacements count from the start


# --- with sensor channels ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def felt():
    """A random movement with a force that varies with it, and what its demonstrations have shown."""
    felt = make_joint_primitive(np.random.default_rng(3), 2, channels=("force",))
    shown = [np.asarray(0.1), *np.array([[0.02, 0.03, 0.01], [0, 0, 0], [0.1, 0.1, 0.1], [0.01, 0.01, 0.05]])]
    return felt, ExecutionProfile(*shown), ExecutionProfile(shown[0], *[each[:2] for each in shown[1:]])


@pytest.mark.parametrize("told", [True, False])
def test_channels_stand_beside_the_movement_as_they_are(felt, told):
    """They change nothing of it, and count from zero; a goal moves them as far as they vary with it."""
    primitive, profile, of_positions = felt
    whole = path_model(primitive, profile, told)
    movement, bare = whole.of_movement(), path_model(replace(primitive, channels=None), of_positions, told)
    for name in ("means", "covariance", "goal_gains", "noise_variances"):
        np.testing.assert_allclose(getattr(movement, name), getattr(bare, name), rtol=1e-9, atol=1e-9, err_msg=name)
    path = path_distribution(primitive, TICKS + 1)
    np.testing.assert_allclose(whole.means[:, 2], path.means[:, 2] / primitive.signals.ranges[2], rtol=1e-9)
    assert whole.noise_variances[2] == pytest.approx((0.01 / primitive.signals.ranges[2]) ** 2 + NOISE_FLOOR**2)
    assert np.any(whole.goal_gains[:, 2] != 0) == told


def test_a_goal_tells_of_a_channel_what_conditioning_says(felt):
    """Dense: the channel at every tick given the noisy end of the movement."""
    primitive, profile, _ = felt
    told, mean_path = path_model(primitive, profile, True), path_distribution(primitive, TICKS + 1)
    ranges = primitive.signals.ranges
    joint = mean_path.covariance / np.multiply.outer(ranges, ranges)[:, None, :]
    end = joint[-1, :2, -1, :2] + np.diag(told.noise_variances[:2])
    gain = joint[:, 2, -1, :2] @ np.linalg.inv(end)
    np.testing.assert_allclose(told.goal_gains[:, 2], gain, rtol=1e-7, atol=1e-9)
    goal = mean_path.means[-1, :2] / primitive.ranges + [0.2, -0.1]
    expected = mean_path.means[:, 2] / ranges[2] + gain @ [0.2, -0.1]
    np.testing.assert_allclose(told.means_for(goal[None])[0, :, 2], expected, rtol=1e-9, atol=1e-9)
    left = joint[:, 2, :, 2] - gain @ joint[-1, :2, :, 2]
    slopes = max(CLOCK_STD, CLOCK_SHARE * TICKS * primitive.phase_step) * np.gradient(mean_path.means[:, 2] / ranges[2])
    off = np.diag(np.where(np.arange(TICKS + 1) > 0, slopes**2, 0.0))  # each sample may be off its time
    np.testing.assert_allclose(told.covariance[:, 2, :, 2], left + off, rtol=1e-7, atol=1e-9)
