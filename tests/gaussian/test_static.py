"""Conditioning one observation after the other is conditioning on all of them at once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import random_covariance, seeds

from probdmp.gaussian import Belief, linear_moments, observe, unit_belief


def dense(belief, designs, observed, noise, counted):
    """Mean, covariance and log density, given all that counts."""
    G, o, R = designs[counted], observed[counted], noise[np.ix_(counted, counted)]
    if not counted.any():
        return *belief, 0.0
    S, e = G @ belief.covariance @ G.T + R, o - G @ belief.mean
    gain = belief.covariance @ G.T @ np.linalg.inv(S)
    density = -0.5 * (e @ np.linalg.solve(S, e) + np.linalg.slogdet(2 * np.pi * S)[1])
    return belief.mean + gain @ e, belief.covariance - gain @ S @ gain.T, density


def correlated(rng, n_sensors):
    """A full R whose variances lie orders of magnitude apart."""
    stds = 10 ** rng.uniform(-1.5, 0.5, n_sensors)
    return (random_covariance(rng, (), n_sensors, n_sensors) + 0.1 * np.eye(n_sensors)) * stds * stds[:, None]


@given(seeds, st.integers(1, 6), st.integers(1, 3), st.integers(1, 8), st.floats(0, 1), st.sampled_from([0.0, 0.3]))
def test_sequential_is_dense(seed, size, n_sensors, n_steps, missing, doubted):
    rng = np.random.default_rng(seed)
    designs = rng.standard_normal((n_steps, n_sensors, size))
    observed = rng.standard_normal((n_steps, n_sensors))
    observed[rng.random(observed.shape) < missing] = np.nan
    believed = rng.random(observed.shape) >= doubted
    noise = correlated(rng, n_sensors)
    belief, total = unit_belief((), size), 0.0
    for design, o, which in zip(designs, observed, believed, strict=True):
        seen = observe(belief, o, design, noise, which)
        np.testing.assert_array_equal(np.isnan(seen.innovation), np.isnan(o))
        np.testing.assert_array_equal(seen.fused, which & ~np.isnan(o))
        assert np.all(seen.log_likelihoods[~seen.fused] == 0)
        assert np.linalg.eigvalsh(belief.covariance - seen.belief.covariance)[0] > -1e-9  # never less is known
        belief, total = seen.belief, total + seen.log_likelihoods.sum()
    every, counted = np.kron(np.eye(n_steps), noise), (believed & ~np.isnan(observed)).ravel()
    wanted = dense(unit_belief((), size), designs.reshape(-1, size), observed.ravel(), every, counted)
    np.testing.assert_allclose(belief.mean, wanted[0], atol=1e-8)
    np.testing.assert_allclose(belief.covariance, wanted[1], atol=1e-8)
    assert total == pytest.approx(wanted[2], rel=1e-7, abs=1e-7)


@given(seeds, st.integers(1, 4), st.integers(1, 4))
def test_the_order_of_sensors_permutes_their_shares(seed, size, n_sensors):
    rng = np.random.default_rng(seed)
    design, observed, noise = rng.standard_normal((n_sensors, size)), rng.standard_normal(n_sensors), correlated(rng, n_sensors)
    order = rng.permutation(n_sensors)
    one = observe(unit_belief((), size), observed, design, noise)
    other = observe(unit_belief((), size), observed[order], design[order], noise[np.ix_(order, order)])
    np.testing.assert_allclose(other.log_likelihoods, one.log_likelihoods[order], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(other.belief.mean, one.belief.mean, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(other.belief.covariance, one.belief.covariance, rtol=1e-9, atol=1e-9)


def test_a_batch_is_its_members():
    rng = np.random.default_rng(0)
    designs, observed = rng.standard_normal((2, 3, 2, 4)), rng.standard_normal((2, 3, 2))
    observed[0, 1, 0] = np.nan
    together = observe(unit_belief((2, 3), 4), observed, designs, np.diag([0.1, 0.2]))
    for index in np.ndindex(2, 3):
        alone = observe(unit_belief((), 4), observed[index], designs[index], np.diag([0.1, 0.2]))
        np.testing.assert_allclose(together.belief.covariance[index], alone.belief.covariance, atol=1e-13)
        np.testing.assert_allclose(together.log_likelihoods[index], alone.log_likelihoods, atol=1e-13)


def test_a_sensor_that_says_nothing_changes_nothing():
    belief = Belief(np.array([1.0, -1.0]), np.array([[1.0, 0.5], [0.5, 2.0]]))
    seen = observe(belief, np.array([np.nan]), np.array([[1.0, 1.0]]), np.array([[0.5]]))
    np.testing.assert_array_equal(seen.belief.mean, belief.mean)
    np.testing.assert_array_equal(seen.belief.covariance, belief.covariance)
    np.testing.assert_allclose(seen.innovation_covariance, 4.5)


def test_independent_sensors_have_their_own_density():
    seen = observe(unit_belief((), 2), np.array([1.0, -2.0]), np.diag([3.0, 0.5]), np.diag([0.5, 0.2]))
    alone = [observe(unit_belief((), 1), *map(np.array, given)) for given in (([1], [[3]], [[0.5]]), ([-2], [[0.5]], [[0.2]]))]
    np.testing.assert_allclose(seen.log_likelihoods, [a.log_likelihoods[0] for a in alone], rtol=1e-12)


def test_moments_of_linear_functions():
    belief = Belief(np.array([1.0, -1.0]), np.array([[1.0, 0.5], [0.5, 2.0]]))
    mean, covariance = linear_moments(belief, np.array([[1.0, 1.0], [2.0, 0.0]]))
    np.testing.assert_allclose(mean, [0, 2])
    np.testing.assert_allclose(covariance, [[4.0, 3.0], [3.0, 4.0]])
