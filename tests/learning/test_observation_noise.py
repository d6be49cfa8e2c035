"""Sensor noise by EM: it never goes downhill and finds what was there."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_primitive, seeds

from probdmp.dmp import Task, linear_gaussian_model
from probdmp.gaussian import filter_sequence, sample_sequences
from probdmp.learning.observation_noise import estimate_observation_noise, maximize_observation_noise

NO_FLOOR = np.full(2, 1e-30)


def recorded(seed, n_demonstrations, n_steps, variances, missing=0.0, **changes):
    """A model and K demonstrations (T, K, D) drawn from it, each of its own length, with the given R."""
    rng = np.random.default_rng(seed)
    primitive = make_primitive(rng, 2, 4, observation_variances=np.asarray(variances), **changes)
    lengths = rng.integers(n_steps // 2, n_steps + 1, n_demonstrations)
    lengths[0] = n_steps
    tasks = Task(*rng.uniform(-1, 1, (2, n_demonstrations, 2)), (lengths - 1) * 0.01)
    model = linear_gaussian_model(primitive, tasks, 0.01, n_steps)
    observed = sample_sequences(model, 1, rng)[1][0, ..., 0]
    observed[np.arange(n_steps)[:, None] >= lengths] = np.nan
    observed[rng.random(observed.shape) < missing] = np.nan
    return model, observed


def likelihoods(model, observed, variances):
    """(D,) log-likelihood of each degree of freedom with another R."""
    other = type(model)(*(getattr(model, name) for name in model.__slots__[:5]), variances[:, None, None], *(
        getattr(model, name) for name in model.__slots__[6:]
    ))  # fmt: skip
    return filter_sequence(other, observed[..., None]).log_likelihoods.sum(axis=(0, 1))


@settings(max_examples=15)
@given(seeds, st.sampled_from([1e-8, 1e-4, 1e-1]), st.sampled_from([1e-3, 1.0, 1e3]), st.floats(0, 0.3))
def test_the_likelihood_never_falls(seed, variance, wrong, missing):
    model, observed = recorded(seed, 3, 30, [variance, variance * 3], missing)
    noise = estimate_observation_noise(model, observed, [np.full(2, variance * wrong)], NO_FLOOR, max_iterations=30)
    rises = np.diff(noise.log_likelihoods)
    assert np.all(rises >= -1e-9 * np.abs(noise.log_likelihoods[:-1]))
    last = likelihoods(model, observed, noise.variances).sum()
    assert last >= noise.log_likelihoods[-1] - 1e-9 * abs(last)


@settings(max_examples=15)
@given(seeds, st.sampled_from([1e-6, 1e-3]))
def test_one_plain_step_never_lowers_the_likelihood_of_any_degree_of_freedom(seed, variance):
    model, observed = recorded(seed, 3, 30, [variance] * 2, 0.2)
    forward = filter_sequence(model, observed[..., None])
    stepped = maximize_observation_noise(model, observed, forward)
    before = forward.log_likelihoods.sum(axis=(0, 1))
    assert np.all(likelihoods(model, observed, stepped) >= before - 1e-9 * np.abs(before))


@settings(max_examples=10)
@given(seeds)
def test_no_nearby_variance_is_likelier(seed):
    model, observed = recorded(seed, 10, 60, [1e-4, 1e-3])
    noise = estimate_observation_noise(model, observed, [np.full(2, 1e-2)], NO_FLOOR)
    assert noise.converged
    reached = likelihoods(model, observed, noise.variances)
    for factor in (0.8, 0.95, 1.05, 1.25):
        assert np.all(likelihoods(model, observed, noise.variances * factor) <= reached + 0.02)


@pytest.mark.parametrize("variances", [(1e-6, 1e-4), (1e-2, 1e-3)])
@pytest.mark.parametrize("wrong", [0.01, 100.0])
def test_the_noise_of_200_demonstrations_is_recovered(variances, wrong):
    model, observed = recorded(1, 200, 100, variances, missing=0.1)
    noise = estimate_observation_noise(model, observed, [np.array(variances) * wrong], NO_FLOOR)
    np.testing.assert_allclose(noise.variances, variances, rtol=0.05)


def test_it_begins_with_the_likeliest_guess_of_each_degree_of_freedom():
    variances = np.array([1e-5, 1e-2])
    model, observed = recorded(2, 20, 40, variances)
    guesses = [variances * [1, 1000], variances * [1000, 1], variances * 1e6]
    noise = estimate_observation_noise(model, observed, guesses, NO_FLOOR, max_iterations=1)
    assert noise.log_likelihoods[0] == pytest.approx(likelihoods(model, observed, variances).sum(), rel=1e-12)


def test_what_was_not_seen_does_not_count():
    model, observed = recorded(3, 20, 40, [1e-3, 1e-2], missing=0.3)
    longer = np.concatenate([observed, np.full((25, 20, 2), np.nan)])
    primitive = make_primitive(np.random.default_rng(3), 2, 4, observation_variances=np.array([1e-3, 1e-2]))
    rng = np.random.default_rng(3)
    make_primitive(rng, 2, 4)
    lengths = rng.integers(20, 41, 20)
    lengths[0] = 40
    tasks = Task(*rng.uniform(-1, 1, (2, 20, 2)), (lengths - 1) * 0.01)
    further = linear_gaussian_model(primitive, tasks, 0.01, 65)
    np.testing.assert_array_equal(further.inputs[:39], model.inputs)
    one = estimate_observation_noise(model, observed, [np.full(2, 1e-4)], NO_FLOOR)
    other = estimate_observation_noise(further, longer, [np.full(2, 1e-4)], NO_FLOOR)
    np.testing.assert_allclose(other.variances, one.variances, rtol=1e-9)


def test_the_floor_holds():
    """Demonstrations that the model predicts exactly leave no noise at all."""
    model, _ = recorded(4, 3, 30, [1e-4, 1e-4])
    mean = filter_sequence(model).filtered.means[..., 2]
    floor = np.array([1e-9, 1e-7])
    noise = estimate_observation_noise(model, mean, [np.full(2, 1e-12), np.full(2, 1e-20)], floor)
    assert np.all(noise.variances >= floor)
    np.testing.assert_allclose(noise.variances, floor, rtol=1e-6)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_units_scale_the_noise(unit):
    model, observed = recorded(5, 5, 30, [1e-4, 1e-3])
    one = estimate_observation_noise(model, observed, [np.full(2, 1e-2)], NO_FLOOR)
    scaled = type(model)(
        model.transition, model.input_matrix, model.inputs * unit, model.input_covariances * unit**2, model.observation_matrix,
        model.observation_covariance * unit**2, model.initial_mean * unit, model.initial_covariance * unit**2,
    )  # fmt: skip
    other = estimate_observation_noise(scaled, observed * unit, [np.full(2, 1e-2 * unit**2)], NO_FLOOR * unit**2)
    np.testing.assert_allclose(other.variances, one.variances * unit**2, rtol=1e-6)


def test_stopped_early_it_says_so():
    model, observed = recorded(6, 5, 30, [1e-6, 1e-6])
    noise = estimate_observation_noise(model, observed, [np.full(2, 1.0)], NO_FLOOR, max_iterations=2)
    assert not noise.converged
    assert len(noise.log_likelihoods) <= 2
