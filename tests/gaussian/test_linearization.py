"""Lines through functions of a Gaussian: exact where the function is one, and otherwise as good as theory says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import random_covariance, seeds

from probdmp.gaussian import AffineObservation, linearize_extended, linearize_unscented, update, wrapped


def gaussian(rng, n, rank):
    """A mean and a covariance of the given rank, of quantities of very different size."""
    scales = 10 ** rng.uniform(-3, 3, n)
    return scales * rng.standard_normal(n), random_covariance(rng, (), n, rank) * scales * scales[:, None], scales


def both(function, mean, covariance, scales, period=None):
    return linearize_extended(function, None, mean, scales, period), linearize_unscented(function, mean, covariance, period)


sizes = st.integers(1, 6).flatmap(lambda n: st.tuples(st.just(n), st.integers(0, n)))


# --- linear functions -------------------------------------------------------------------------------------------------


@given(seeds, sizes, st.integers(1, 3))
def test_a_linear_function_is_its_own_line(seed, size, n_outputs):
    """Also where some directions are known: there the unscented line may have any slope, for nothing lies in them."""
    rng = np.random.default_rng(seed)
    mean, covariance, scales = gaussian(rng, *size)
    matrix, offset = rng.standard_normal((n_outputs, len(mean))) / scales, rng.standard_normal(n_outputs)
    stds = np.sqrt(np.diagonal(covariance))
    for line in both(lambda s: matrix @ s + offset, mean, covariance, scales):
        np.testing.assert_allclose(line.value, matrix @ mean + offset, rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose((line.matrix - matrix) @ covariance / np.where(stds > 0, stds, 1), 0, atol=1e-8)
        np.testing.assert_allclose(line.residual, 0, atol=1e-10)
    np.testing.assert_allclose(
        linearize_extended(lambda s: matrix @ s, None, mean, scales).matrix * scales, matrix * scales, atol=1e-9
    )


@given(seeds, sizes, st.integers(1, 3))
def test_an_update_with_the_line_is_the_update(seed, size, n_outputs):
    rng = np.random.default_rng(seed)
    mean, covariance, scales = gaussian(rng, *size)
    matrix, noise = rng.standard_normal((n_outputs, len(mean))) / scales, 0.1 * np.eye(n_outputs)
    values = matrix @ mean + rng.standard_normal(n_outputs)
    wanted = update(mean, covariance, AffineObservation(values, matrix, noise))
    for line in both(lambda s: matrix @ s, mean, covariance, scales):
        seen = values - line.value + line.matrix @ mean
        got = update(mean, covariance, AffineObservation(seen, line.matrix, noise + line.residual))
        np.testing.assert_allclose(got.mean / scales, wanted.mean / scales, atol=1e-8)
        np.testing.assert_allclose(
            got.covariance / scales / scales[:, None], wanted.covariance / scales / scales[:, None], atol=1e-8
        )
        assert got.log_likelihood == pytest.approx(wanted.log_likelihood, rel=1e-8, abs=1e-8)


# --- curved ones ------------------------------------------------------------------------------------------------------


def arm(angles):
    """Tip of a planar arm with a link of unit length for each joint."""
    turned = np.cumsum(angles)
    return np.array([np.cos(turned).sum(), np.sin(turned).sum()])


def arm_jacobian(angles):
    turned = np.cumsum(angles)
    ahead = [-np.cumsum(np.sin(turned)[::-1])[::-1], np.cumsum(np.cos(turned)[::-1])[::-1]]
    return np.array(ahead)


@given(seeds, st.integers(1, 5))
def test_differences_are_as_good_as_the_jacobian(seed, n):
    angles = np.random.default_rng(seed).uniform(-3, 3, n)
    given_one = linearize_extended(arm, arm_jacobian, angles, np.ones(n))
    by_differences = linearize_extended(arm, None, angles, np.ones(n))
    np.testing.assert_allclose(by_differences.matrix, given_one.matrix, atol=1e-9)
    np.testing.assert_array_equal(by_differences.value, arm(angles))
    assert not by_differences.residual.any()


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_differences_know_how_large_a_quantity_is(size):
    """At zero the value says nothing about the step; the scale does."""
    line = linearize_extended(lambda s: np.sin(s / size), None, np.zeros(1), np.array([size]))
    np.testing.assert_allclose(line.matrix * size, [[1.0]], rtol=1e-9)


@pytest.mark.parametrize(("mean", "std"), [(0.0, 1.0), (2.0, 0.5), (-300.0, 1e-3), (0.1, 40.0)])
def test_the_moments_of_a_square_are_exact(mean, std):
    """Of s^2, s ~ N(m, v): mean m^2 + v, covariance with s 2 m v, variance 4 m^2 v + 2 v^2."""
    v = std**2
    line = linearize_unscented(np.square, np.array([mean]), np.array([[v]]))
    np.testing.assert_allclose(line.value, mean**2 + v, rtol=1e-12)
    np.testing.assert_allclose(line.matrix, 2 * mean, rtol=1e-6, atol=1e-9 * std)
    np.testing.assert_allclose(line.residual, 2 * v**2, rtol=1e-6, atol=1e-9 * mean**2 * v)


@given(seeds, sizes)
def test_mean_and_slope_of_quadratics_are_exact_in_any_dimension(seed, size):
    rng = np.random.default_rng(seed)
    mean, covariance, scales = gaussian(rng, *size)
    a = rng.standard_normal((len(mean),) * 2)
    a = (a + a.T) / scales / scales[:, None]
    line = linearize_unscented(lambda s: np.array([s @ a @ s]), mean, covariance)
    np.testing.assert_allclose(line.value, mean @ a @ mean + np.trace(a @ covariance), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(
        line.matrix @ covariance / scales, 2 * (a @ mean)[None] @ covariance / scales, rtol=1e-7, atol=1e-7
    )


def test_the_unscented_line_of_an_arm_is_that_of_many_draws():
    """Mean and covariance of the tip, and of the tip with the joints, where the spread is wide enough to bend."""
    rng = np.random.default_rng(0)
    mean, covariance = np.array([0.4, 0.8, -0.5]), random_covariance(rng, (), 3, 3) * 0.15**2
    joints = rng.multivariate_normal(mean, covariance, 400_000)
    turned = np.cumsum(joints, axis=1)
    tips = np.column_stack([np.cos(turned).sum(axis=1), np.sin(turned).sum(axis=1)])
    line = linearize_unscented(arm, mean, covariance)
    spread = line.matrix @ covariance @ line.matrix.T + line.residual
    assert np.abs(line.value - tips.mean(axis=0)).max() < 0.05 * np.abs(arm(mean) - tips.mean(axis=0)).max()
    np.testing.assert_allclose(spread, np.cov(tips.T), atol=0.02 * np.trace(spread))
    np.testing.assert_allclose(line.matrix @ covariance, np.cov(tips.T, joints.T)[:2, 2:], atol=0.02 * np.trace(covariance))


@given(seeds, sizes, st.integers(1, 4))
def test_what_is_left_over_is_a_covariance(seed, size, n_outputs):
    rng = np.random.default_rng(seed)
    mean, covariance, scales = gaussian(rng, *size)
    matrix, phases = 3 * rng.standard_normal((n_outputs, len(mean))) / scales, rng.uniform(-3, 3, n_outputs)
    line = linearize_unscented(lambda s: np.sin(matrix @ s + phases) + (matrix @ s) ** 2, mean, covariance)
    np.testing.assert_allclose(line.residual, line.residual.T, atol=1e-12 * np.trace(line.residual))
    assert np.linalg.eigvalsh((line.residual + line.residual.T) / 2)[0] >= -1e-12 * np.trace(line.residual)


# --- quantities that come round again ---------------------------------------------------------------------------------


def test_differences_are_wrapped_into_half_a_period_around_zero():
    np.testing.assert_allclose(
        wrapped(np.array([0.1, 3.5, -3.5, 6.4, 12.0]), 2 * np.pi),
        [0.1, 3.5 - 2 * np.pi, 2 * np.pi - 3.5, 6.4 - 2 * np.pi, 12 - 4 * np.pi],
    )
    np.testing.assert_array_equal(wrapped(np.array([7.0]), None), [7.0])


@given(seeds, st.floats(-20, 20), st.sampled_from([1.0, 2 * np.pi, 360.0]))
def test_where_the_period_begins_does_not_matter(seed, turn, period):
    """An angle that jumps from one end of its range to the other has the line of one that goes on."""
    rng = np.random.default_rng(seed)
    matrix, mean = rng.standard_normal((2, 3)) * period, rng.standard_normal(3)
    covariance = random_covariance(rng, (), 3, 2) * 0.02**2  # a few of these within half a period
    steady = both(lambda s: matrix @ s, mean, covariance, np.ones(3))
    jumping = both(lambda s: np.mod(matrix @ s + turn * period, period), mean, covariance, np.ones(3), period)
    for one, other in zip(steady, jumping, strict=True):
        np.testing.assert_allclose(wrapped(other.value - one.value - turn * period, period), 0, atol=1e-9 * period)
        np.testing.assert_allclose((other.matrix - one.matrix) @ covariance / 0.02, 0, atol=1e-7 * period)
        np.testing.assert_allclose(other.residual, one.residual, atol=1e-9 * period**2)
