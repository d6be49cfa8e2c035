"""Systems side by side are one system: the same numbers, whether they are filtered apart or together."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import dense_posterior, deviation_in_stds, marginal_stds, system_at
from scipy.linalg import block_diag
from strategies import draw_observations, random_covariance, random_system, seeds

from probdmp.gaussian import block_diagonal, couple_systems, filter_sequence, smooth_sequence

BATCHES = ((), (2,), (2, 3))


@given(seeds, st.sampled_from(BATCHES), st.integers(1, 3), st.integers(1, 3), st.integers(0, 2))
def test_blocks_are_on_the_diagonal(seed, batch, n_groups, rows, columns):
    blocks = np.random.default_rng(seed).standard_normal((*batch, n_groups, rows, columns))
    whole = block_diagonal(blocks)
    assert whole.shape == (*batch, n_groups * rows, n_groups * columns)
    for index in np.ndindex(batch):
        np.testing.assert_array_equal(whole[index], block_diag(*blocks[index]))


def side_by_side(rng, batch, n_groups, n_states, n_sensors, n_steps):
    """Independent systems with batch axes (*batch, G), and the same as one with (*batch)."""
    model = random_system(rng, n_states, 1, n_sensors, n_steps, (*batch, n_groups))
    matrix = np.broadcast_to(model.observation_matrix, (*batch, n_groups, n_sensors, n_states))
    noise = np.broadcast_to(model.observation_covariance, (*batch, n_groups, n_sensors, n_sensors))
    return model, couple_systems(model, block_diagonal(matrix), block_diagonal(noise))


@settings(max_examples=30)
@given(seeds, st.sampled_from(BATCHES), st.integers(1, 3), st.integers(1, 3), st.integers(1, 2), st.integers(1, 10))
def test_coupled_is_independent_if_sensors_are(seed, batch, n_groups, n_states, n_sensors, n_steps):
    rng = np.random.default_rng(seed)
    model, coupled = side_by_side(rng, batch, n_groups, n_states, n_sensors, n_steps)
    assert coupled.batch_shape == batch
    observed = draw_observations(model, rng, 0.3)
    together = observed.reshape(n_steps, *batch, -1)
    one, other = filter_sequence(model, observed), filter_sequence(coupled, together)
    np.testing.assert_allclose(other.log_likelihoods, one.log_likelihoods.sum(axis=-1), rtol=1e-11, atol=1e-11)
    prior = filter_sequence(model).filtered
    scale = np.maximum(marginal_stds(prior.covariances), 1e-3)  # of the whole movement; a known state has no spread
    for apart, joined in (
        (one.filtered, other.filtered),
        (smooth_sequence(model, observed), smooth_sequence(coupled, together)),
    ):
        means = joined.means.reshape(apart.means.shape)
        assert np.max(np.abs(means - apart.means) / (scale + np.abs(apart.means))) < 1e-12
        flat = scale.reshape(n_steps, *batch, -1)
        errors = np.abs(joined.covariances - block_diagonal(apart.covariances)) / (flat[..., None] * flat[..., None, :])
        assert errors.max() < 1e-12


@settings(max_examples=20)
@given(seeds, st.integers(2, 3), st.integers(1, 2), st.integers(1, 3), st.integers(1, 6))
def test_a_sensor_of_several_systems_is_brute_force(seed, n_groups, n_states, n_sensors, n_steps):
    """Every output sees all systems, and outputs share noise."""
    rng = np.random.default_rng(seed)
    model = random_system(rng, n_states, 1, 1, n_steps, (n_groups,))
    matrix = rng.standard_normal((n_sensors, n_groups * n_states))
    noise = random_covariance(rng, (), n_sensors, n_sensors) + 0.1 * np.eye(n_sensors)
    coupled = couple_systems(model, matrix, noise)
    for g in range(n_groups):  # what is hidden from the sensors is as it was
        own, system = slice(g * n_states, (g + 1) * n_states), system_at(model, (g,))
        np.testing.assert_array_equal(coupled.transition[own, own], system.A)
        np.testing.assert_array_equal(coupled.initial_covariance[own, own], system.V0)
        np.testing.assert_allclose(coupled.drifts()[:, own], system.u @ system.B.T, rtol=1e-12, atol=1e-14)
    observed = draw_observations(coupled, rng, 0.3)
    expected = dense_posterior(system_at(coupled), observed, digits=40)
    result, stds = filter_sequence(coupled, observed), marginal_stds(expected.prior[1])
    assert deviation_in_stds(*result.filtered, expected.filtered, stds) <= 1e-9
    assert deviation_in_stds(*smooth_sequence(coupled, observed), expected.smoothed, stds) <= 1e-9
    assert result.log_likelihoods.sum() == pytest.approx(expected.log_likelihood, rel=1e-9, abs=1e-9)
