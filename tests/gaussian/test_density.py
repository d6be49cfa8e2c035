"""The density of a residual, against scipy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal
from strategies import random_covariance, seeds

from probdmp.gaussian import gaussian_log_density
from probdmp.gaussian.density import invert_covariance


def log_density(residual, covariance):
    precision, log_determinant = invert_covariance(covariance)
    return gaussian_log_density(residual, precision, log_determinant, np.full(residual.shape[:-1], float(residual.shape[-1])))


@given(seeds, st.integers(1, 5), st.sampled_from([(), (3,), (2, 3)]), st.integers(-12, 12))
def test_agrees_with_scipy(seed, size, batch, exponent):
    rng = np.random.default_rng(seed)
    covariance = (random_covariance(rng, batch, size, size) + 0.1 * np.eye(size)) * 10.0**exponent
    residual = rng.standard_normal((*batch, size)) * 10.0 ** (exponent / 2)
    densities = log_density(residual, covariance)
    assert densities.shape == batch
    for index in np.ndindex(batch):
        expected = multivariate_normal(cov=covariance[index]).logpdf(residual[index])
        np.testing.assert_allclose(densities[index], expected, rtol=1e-12, atol=1e-12)


@given(seeds, st.integers(1, 5))
def test_inverse_and_determinant(seed, size):
    covariance = random_covariance(np.random.default_rng(seed), (2,), size, size) + 0.1 * np.eye(size)
    precision, log_determinant = invert_covariance(covariance)
    np.testing.assert_allclose(covariance @ precision, np.broadcast_to(np.eye(size), (2, size, size)), atol=1e-12)
    np.testing.assert_array_equal(precision, precision.mT)
    np.testing.assert_allclose(log_determinant, np.linalg.slogdet(covariance).logabsdet, rtol=1e-12, atol=1e-12)


def test_one_sensor_is_the_scalar_formula():
    variance, residual = 0.25, 1.5
    expected = -0.5 * (residual**2 / variance + np.log(2 * np.pi * variance))
    assert log_density(np.array([residual]), np.array([[variance]])) == pytest.approx(expected, rel=1e-15)


def test_density_of_nothing_is_one():
    assert gaussian_log_density(np.zeros(3), np.eye(3), np.zeros(()), np.zeros(())) == 0


def test_unseen_entry_with_unit_variance_does_not_count():
    covariance = np.diag([4.0, 1.0])
    precision, log_determinant = invert_covariance(covariance)
    got = gaussian_log_density(np.array([1.0, 0.0]), precision, log_determinant, np.array(1.0))
    assert got == pytest.approx(multivariate_normal(cov=4.0).logpdf(1.0), rel=1e-15)
