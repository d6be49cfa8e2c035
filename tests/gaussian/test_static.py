"""Conditioning one observation after the other is conditioning on all of them at once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import seeds

from probdmp.gaussian import Belief, linear_moments, observe, unit_belief


def dense(belief, designs, observed, variances):
    """Mean, covariance and log density, given all that is not NaN."""
    k = ~np.isnan(observed)
    G, o, R = designs[k], observed[k], np.diag(variances[k])
    if not k.any():
        return *belief, 0.0
    S, e = G @ belief.covariance @ G.T + R, o - G @ belief.mean
    gain = belief.covariance @ G.T @ np.linalg.inv(S)
    density = -0.5 * (e @ np.linalg.solve(S, e) + np.linalg.slogdet(2 * np.pi * S)[1])
    return belief.mean + gain @ e, belief.covariance - gain @ S @ gain.T, density


@given(seeds, st.integers(1, 6), st.integers(1, 3), st.integers(1, 8), st.floats(0, 1))
def test_sequential_is_dense(seed, size, n_sensors, n_steps, missing):
    rng = np.random.default_rng(seed)
    designs = rng.standard_normal((n_steps, n_sensors, size))
    observed = rng.standard_normal((n_steps, n_sensors))
    observed[rng.random(observed.shape) < missing] = np.nan
    variances = 10 ** rng.uniform(-3, 1, n_sensors)
    belief, total = unit_belief((), size), 0.0
    for design, o in zip(designs, observed, strict=True):
        seen = observe(belief, o, design, variances)
        np.testing.assert_array_equal(np.isnan(seen.innovation), np.isnan(o))
        assert np.all(seen.log_likelihoods[np.isnan(o)] == 0)
        assert np.linalg.eigvalsh(belief.covariance - seen.belief.covariance)[0] > -1e-9  # never less is known
        belief, total = seen.belief, total + seen.log_likelihoods.sum()
    wanted = dense(unit_belief((), size), designs.reshape(-1, size), observed.ravel(), np.tile(variances, n_steps))
    np.testing.assert_allclose(belief.mean, wanted[0], atol=1e-8)
    np.testing.assert_allclose(belief.covariance, wanted[1], atol=1e-8)
    assert total == pytest.approx(wanted[2], rel=1e-7, abs=1e-7)


def test_a_batch_is_its_members():
    rng = np.random.default_rng(0)
    designs, observed = rng.standard_normal((2, 3, 2, 4)), rng.standard_normal((2, 3, 2))
    observed[0, 1, 0] = np.nan
    together = observe(unit_belief((2, 3), 4), observed, designs, np.array([0.1, 0.2]))
    for index in np.ndindex(2, 3):
        alone = observe(unit_belief((), 4), observed[index], designs[index], np.array([0.1, 0.2]))
        np.testing.assert_allclose(together.belief.covariance[index], alone.belief.covariance, atol=1e-13)
        np.testing.assert_allclose(together.log_likelihoods[index], alone.log_likelihoods, atol=1e-13)


def test_a_sensor_that_says_nothing_changes_nothing():
    belief = Belief(np.array([1.0, -1.0]), np.array([[1.0, 0.5], [0.5, 2.0]]))
    seen = observe(belief, np.array([np.nan]), np.array([[1.0, 1.0]]), np.array([0.5]))
    np.testing.assert_array_equal(seen.belief.mean, belief.mean)
    np.testing.assert_array_equal(seen.belief.covariance, belief.covariance)
    np.testing.assert_allclose(seen.innovation_covariance, 4.5)


def test_independent_sensors_have_their_own_density():
    seen = observe(unit_belief((), 2), np.array([1.0, -2.0]), np.diag([3.0, 0.5]), np.array([0.5, 0.2]))
    alone = [
        observe(unit_belief((), 1), np.array([o]), np.array([[g]]), np.array([r])) for o, g, r in ((1, 3, 0.5), (-2, 0.5, 0.2))
    ]
    np.testing.assert_allclose(seen.log_likelihoods, [a.log_likelihoods[0] for a in alone], rtol=1e-12)


def test_moments_of_linear_functions():
    belief = Belief(np.array([1.0, -1.0]), np.array([[1.0, 0.5], [0.5, 2.0]]))
    mean, covariance = linear_moments(belief, np.array([[1.0, 1.0], [2.0, 0.0]]))
    np.testing.assert_allclose(mean, [0, 2])
    np.testing.assert_allclose(covariance, [[4.0, 3.0], [3.0, 4.0]])
