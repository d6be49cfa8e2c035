"""Draws against the joint Gaussian written out in full. Bounds are five standard errors; the seed is fixed."""

from dataclasses import replace

import numpy as np
import pytest
from reference import dense_joint, system_at
from strategies import dmp_system, random_system

from probdmp.gaussian import filter_sequence, sample_sequences

N_SAMPLES = 20_000
N_ERRORS = 5
"""Standard errors; one in two million normal variables is further off."""


def assert_moments(samples, mean, covariance):
    """`samples` (N_SAMPLES, k) have this mean (k) and covariance (k, k)."""
    variances = np.diagonal(covariance)
    rounding = 1e-9 * (1 + np.abs(mean))
    assert np.all(np.abs(samples.mean(axis=0) - mean) <= N_ERRORS * np.sqrt(variances / N_SAMPLES) + rounding)
    errors = np.sqrt((np.outer(variances, variances) + covariance**2) / N_SAMPLES)
    centred = samples - mean
    assert np.all(np.abs(centred.T @ centred / N_SAMPLES - covariance) <= N_ERRORS * errors + np.outer(rounding, rounding))


def flat_joint(system):
    """Mean and covariance of all states and all observations in one vector."""
    joint = dense_joint(system)
    n_values, n_observed = joint.state_means.size, joint.observation_means.size
    cross = joint.cross_covariance.reshape(n_observed, n_values)
    covariance = np.block(
        [
            [joint.state_covariance.reshape(n_values, n_values), cross.T],
            [cross, joint.observation_covariance.reshape(n_observed, n_observed)],
        ]
    )
    return np.concatenate([joint.state_means.ravel(), joint.observation_means.ravel()]), covariance


SYSTEMS = {
    "full": {"n_states": 3, "n_inputs": 2, "n_sensors": 2, "n_steps": 6},
    "rank-one noise": {"n_states": 3, "n_inputs": 2, "n_sensors": 1, "n_steps": 6, "noise_rank": 1},
    "known start": {"n_states": 3, "n_inputs": 1, "n_sensors": 3, "n_steps": 6, "known_start": True},
    "one state": {"n_states": 2, "n_inputs": 1, "n_sensors": 1, "n_steps": 1},
    "batch": {"n_states": 2, "n_inputs": 1, "n_sensors": 2, "n_steps": 4, "batch": (2, 2)},
}


@pytest.mark.parametrize("sizes", SYSTEMS.values(), ids=SYSTEMS)
def test_moments_are_those_of_the_joint_gaussian(sizes):
    rng = np.random.default_rng(0)
    model = random_system(rng, **sizes)
    states, observations = sample_sequences(model, N_SAMPLES, rng)
    assert states.shape == (N_SAMPLES, model.n_steps, *model.batch_shape, sizes["n_states"])
    assert observations.shape == (N_SAMPLES, model.n_steps, *model.batch_shape, sizes["n_sensors"])
    for index in np.ndindex(model.batch_shape):
        at = (slice(None), slice(None), *index)
        values = np.concatenate([states[at].reshape(N_SAMPLES, -1), observations[at].reshape(N_SAMPLES, -1)], axis=1)
        assert_moments(values, *flat_joint(system_at(model, index)))


@pytest.mark.parametrize("scheme", ["exact", "semi_implicit_euler"])
def test_moments_of_a_movement(scheme):
    rng = np.random.default_rng(0)
    model = dmp_system(rng, n_dof=2, n_steps=20, discretization=scheme, start_covariances=np.zeros((2, 2, 2)))
    states, observations = sample_sequences(model, N_SAMPLES, rng)
    for d in range(2):
        values = [states[:, :, d].reshape(N_SAMPLES, -1), observations[:, :, d].reshape(N_SAMPLES, -1)]
        assert_moments(np.concatenate(values, axis=1), *flat_joint(system_at(model, (d,))))


def test_entries_of_a_batch_are_drawn_independently():
    rng = np.random.default_rng(0)
    model = random_system(rng, n_states=2, n_inputs=1, n_sensors=1, n_steps=5, batch=(2,))
    states, observations = sample_sequences(model, N_SAMPLES, rng)
    for values in (states, observations):
        one, other = (values[:, :, d].reshape(N_SAMPLES, -1) for d in range(2))
        k = one.shape[1]
        correlations = np.corrcoef(one.T, other.T)[:k, k:]
        assert np.all(np.abs(correlations) < N_ERRORS / np.sqrt(N_SAMPLES))


def test_process_noise_of_rank_one_moves_the_state_along_one_line():
    rng = np.random.default_rng(0)
    model = dmp_system(rng, n_dof=1, n_steps=10)
    states, _ = sample_sequences(model, 50, rng)
    push = states[:, 1:, 0] - states[:, :-1, 0] @ model.transition[0].T - model.drifts()[:, 0]
    b = model.input_matrix[0, :, 0]
    along = push @ b / (b @ b)
    np.testing.assert_allclose(push, along[..., None] * b, atol=1e-11 * np.abs(push).max())
    assert np.all(along.std(axis=0) > 0)


def test_without_uncertainty_every_draw_is_the_rollout():
    rng = np.random.default_rng(0)
    model = random_system(rng, n_states=3, n_inputs=2, n_sensors=2, n_steps=20, batch=(2,), known_start=True)
    model = replace(model, input_covariances=np.zeros_like(model.input_covariances))
    states, observations = sample_sequences(model, 3, rng)
    means = filter_sequence(model).filtered.means
    np.testing.assert_allclose(states, np.broadcast_to(means, states.shape), rtol=1e-12, atol=1e-12)
    noise = observations - np.matmul(model.observation_matrix, states[..., None])[..., 0]
    assert np.all(np.abs(noise) > 0)


def test_same_seed_same_draws():
    model = dmp_system(np.random.default_rng(0), n_dof=2, n_steps=10)
    first, again, other = (sample_sequences(model, 2, np.random.default_rng(seed)) for seed in (7, 7, 8))
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])
    assert not np.any(first[1] == other[1])


def test_filter_expects_the_draws_as_they_come():
    """Squared innovations over their variance are chi-squared; their mean is 1, that of each step and of all."""
    rng = np.random.default_rng(0)
    model = dmp_system(rng, n_dof=1, n_steps=30, observation_variances=np.array([1e-6]))
    n_samples = 2000
    _, observations = sample_sequences(model, n_samples, rng)  # the draws become the batch
    many = replace(model, inputs=np.broadcast_to(model.inputs, (29, n_samples, 1)))
    result = filter_sequence(many, observations[:, :, 0].swapaxes(0, 1))
    ratio = result.innovations[..., 0] ** 2 / result.innovation_covariances[..., 0, 0]
    assert ratio.shape == (30, n_samples)
    assert np.all(np.abs(ratio.mean(axis=1) - 1) < N_ERRORS * np.sqrt(2 / n_samples))
    assert abs(ratio.mean() - 1) < N_ERRORS * np.sqrt(2 / ratio.size)
