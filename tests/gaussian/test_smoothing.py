"""The smoother against brute-force conditioning, and the laws that any such smoother obeys."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import dense_posterior, deviation_in_stds, marginal_stds, rts_smoother, system_at
from strategies import batch_indices, dmp_system, draw_observations, random_system, seeds, single, stacked, systems

from probdmp.errors import InputError
from probdmp.gaussian import filter_sequence, smooth_sequence
from probdmp.gaussian.smoothing import smooth_filtered

# --- agreement with brute force ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("known_start", [False, True], ids=["uncertain start", "known start"])
@pytest.mark.parametrize("scheme", ["exact", "semi_implicit_euler"])
@pytest.mark.parametrize("variance", [1e-12, 1e-6, 1e-2])
@pytest.mark.parametrize("n_dof", [1, 2])
def test_dmp_agrees_with_brute_force(n_dof, variance, scheme, known_start):
    rng = np.random.default_rng(n_dof)
    changes = {"start_covariances": np.zeros((n_dof, 2, 2))} if known_start else {}
    variances = np.full(n_dof, variance)  # of positions that move by about one unit
    model = dmp_system(rng, n_dof, n_steps=30, observation_variances=variances, discretization=scheme, **changes)
    observations = draw_observations(model, rng, missing=0.2)
    means, covariances = smooth_sequence(model, observations)
    for d in range(n_dof):
        expected = dense_posterior(system_at(model, (d,)), observations[:, d], digits=50)
        one = means[:, d], covariances[:, d], expected.smoothed
        assert deviation_in_stds(*one, marginal_stds(expected.prior[1])) <= 1e-9
        # Even of the little that is left after all observations, as far as double precision carries.
        tolerance = 1e-9 if variance > 1e-12 else 1e-6
        assert deviation_in_stds(*one, marginal_stds(expected.smoothed[1]), least=1e-7) <= tolerance


@given(systems(), st.sampled_from([0.0, 0.3]), seeds)
def test_random_system_agrees_with_brute_force(model, missing, seed):
    observations = draw_observations(model, np.random.default_rng(seed), missing)
    means, covariances = smooth_sequence(model, observations)
    for index in batch_indices(model):
        at = (slice(None), *index)
        expected = dense_posterior(system_at(model, index), observations[at], digits=40)
        stds = marginal_stds(expected.prior[1])
        assert deviation_in_stds(means[at], covariances[at], expected.smoothed, stds) <= 1e-9


def test_long_recording_agrees_with_the_textbook():
    rng = np.random.default_rng(3)
    model = random_system(rng, n_states=2, n_inputs=2, n_sensors=2, n_steps=400, batch=(3,))
    observations = draw_observations(model, rng, missing=0.3)
    smoothed = smooth_sequence(model, observations)
    for d in range(3):
        means, covariances = rts_smoother(system_at(model, (d,)), observations[:, d])
        np.testing.assert_allclose(smoothed.means[:, d], means, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(smoothed.covariances[:, d], covariances, rtol=1e-9, atol=1e-9)


# --- laws -------------------------------------------------------------------------------------------------------------


@given(systems(), seeds)
def test_last_state_has_no_future(model, seed):
    observations = draw_observations(model, np.random.default_rng(seed), missing=0.2)
    filtered, smoothed = filter_sequence(model, observations).filtered, smooth_sequence(model, observations)
    np.testing.assert_array_equal(smoothed.means[-1], filtered.means[-1])
    np.testing.assert_array_equal(smoothed.covariances[-1], filtered.covariances[-1])


@given(systems(), seeds)
def test_smoothing_never_increases_variance(model, seed):
    observations = draw_observations(model, np.random.default_rng(seed), missing=0.2)
    filtered, smoothed = filter_sequence(model, observations).filtered, smooth_sequence(model, observations)
    scale = np.abs(filter_sequence(model).filtered.covariances).max() + 1e-300
    assert np.linalg.eigvalsh(filtered.covariances - smoothed.covariances).min() > -1e-12 * scale
    assert np.linalg.eigvalsh(smoothed.covariances).min() > -1e-12 * scale
    np.testing.assert_array_equal(smoothed.covariances, smoothed.covariances.mT)


@given(systems(), seeds)
def test_future_in_which_nothing_is_seen_says_nothing(model, seed):
    rng = np.random.default_rng(seed)
    observations = draw_observations(model, rng, missing=0.2)
    end = int(rng.integers(0, model.n_steps))
    observations[end + 1 :] = np.nan
    filtered, smoothed = filter_sequence(model, observations).filtered, smooth_sequence(model, observations)
    np.testing.assert_array_equal(smoothed.means[end:], filtered.means[end:])
    np.testing.assert_array_equal(smoothed.covariances[end:], filtered.covariances[end:])


def test_nothing_seen_leaves_the_rollout():
    model = dmp_system(np.random.default_rng(0), n_dof=2, n_steps=40)
    smoothed, rollout = smooth_sequence(model, np.full((40, 2, 1), np.nan)), filter_sequence(model).filtered
    np.testing.assert_array_equal(smoothed.means, rollout.means)
    np.testing.assert_array_equal(smoothed.covariances, rollout.covariances)


def test_future_is_used():
    """One observation at the end moves every state before it, and narrows it."""
    rng = np.random.default_rng(0)
    model = dmp_system(rng, n_dof=1, n_steps=20, observation_variances=np.array([1e-6]))
    rollout = filter_sequence(model).filtered
    observations = np.full((20, 1, 1), np.nan)
    observations[-1, 0, 0] = rollout.means[-1, 0, 2] + 3 * np.sqrt(rollout.covariances[-1, 0, 2, 2])
    smoothed = smooth_sequence(model, observations)
    for t in range(5, 20):
        assert smoothed.means[t, 0, 2] > rollout.means[t, 0, 2]
        assert smoothed.covariances[t, 0, 2, 2] < rollout.covariances[t, 0, 2, 2]


def test_known_start_stays_known():
    rng = np.random.default_rng(0)
    model = random_system(rng, n_states=3, n_inputs=1, n_sensors=1, n_steps=20, batch=(2,), known_start=True)
    smoothed = smooth_sequence(model, draw_observations(model, rng))
    np.testing.assert_array_equal(smoothed.means[0], np.broadcast_to(model.initial_mean, (2, 3)))
    assert np.all(smoothed.covariances[0] == 0)


@given(systems(), seeds)
def test_smoothed_path_obeys_the_equations_where_there_is_no_noise(model, seed):
    certain = replace(model, input_covariances=np.zeros_like(model.input_covariances))
    observations = draw_observations(certain, np.random.default_rng(seed), missing=0.2)
    means = smooth_sequence(certain, observations).means
    driven = np.matmul(model.transition, means[:-1, ..., None])[..., 0] + certain.drifts()
    np.testing.assert_allclose(means[1:], driven, rtol=1e-9, atol=1e-9)


@given(systems(), seeds)
def test_backward_pass_alone_needs_only_the_forward_pass(model, seed):
    observations = draw_observations(model, np.random.default_rng(seed), missing=0.2)
    forward = filter_sequence(model, observations)
    kept = forward.filtered.means.copy()
    for one, other in zip(smooth_filtered(model, forward), smooth_sequence(model, observations), strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(forward.filtered.means, kept)  # and leaves it as it was


# --- batches ----------------------------------------------------------------------------------------------------------


@given(systems(), seeds)
def test_batch_is_its_entries_one_by_one(model, seed):
    observations = draw_observations(model, np.random.default_rng(seed), missing=0.2)
    result = smooth_sequence(model, observations)
    for index in batch_indices(model):
        at = (slice(None), *index)
        alone = smooth_sequence(single(model, index), observations[at])
        np.testing.assert_allclose(result.means[at], alone.means, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(result.covariances[at], alone.covariances, rtol=1e-12, atol=1e-12)


@given(systems(batches=((2,), (2, 3))), seeds)
def test_permuted_batch_gives_permuted_results(model, seed):
    rng = np.random.default_rng(seed)
    observations = draw_observations(model, rng, missing=0.2)
    indices = [tuple(i) for i in rng.permutation(batch_indices(model))]
    permuted = stacked([single(model, index) for index in indices])
    other = smooth_sequence(permuted, np.stack([observations[(slice(None), *i)] for i in indices], axis=1))
    result = smooth_sequence(model, observations)
    for k, index in enumerate(indices):
        at = (slice(None), *index)
        np.testing.assert_allclose(other.means[:, k], result.means[at], rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(other.covariances[:, k], result.covariances[at], rtol=1e-12, atol=1e-12)


def test_smoothing_needs_a_recording():
    model = dmp_system(np.random.default_rng(0), n_dof=2, n_steps=10)
    with pytest.raises(InputError, match=r"Expected observations of shape \(10, 2, 1\), got \(10, 2\)"):
        smooth_sequence(model, np.zeros((10, 2)))
