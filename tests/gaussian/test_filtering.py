"""The filter against the joint Gaussian written out in full, and the laws that any such filter obeys."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import dense_posterior, deviation_in_stds, kalman_filter, marginal_stds, system_at
from scipy.stats import multivariate_normal
from strategies import (
    batch_indices,
    dmp_system,
    draw_observations,
    random_covariance,
    random_system,
    seeds,
    single,
    stacked,
    systems,
)

from probdmp.gaussian import AffineObservation, LinearGaussianModel, filter_sequence, predict, update

SCHEMES = ("exact", "semi_implicit_euler")


# --- agreement with brute force ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("known_start", [False, True], ids=["uncertain start", "known start"])
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("variance", [1e-12, 1e-6, 1e-2])
@pytest.mark.parametrize("n_dof", [1, 2, 7])
def test_dmp_agrees_with_brute_force(n_dof, variance, scheme, known_start):
    rng = np.random.default_rng(n_dof)
    changes = {"start_covariances": np.zeros((n_dof, 2, 2))} if known_start else {}
    variances = np.full(n_dof, variance)  # of positions that move by about one unit
    model = dmp_system(rng, n_dof, n_steps=30, observation_variances=variances, discretization=scheme, **changes)
    observations = draw_observations(model, rng, missing=0.2)
    result, total = filter_sequence(model, observations), 0.0
    for d in range(n_dof):
        expected = dense_posterior(system_at(model, (d,)), observations[:, d], digits=50)
        total += expected.log_likelihood
        assert result.log_likelihoods[:, d].sum() == pytest.approx(expected.log_likelihood, rel=1e-11)
        np.testing.assert_allclose(result.log_likelihoods[:, d], expected.log_likelihoods, rtol=1e-9, atol=1e-9)
        means, covariances = result.filtered.means[:, d], result.filtered.covariances[:, d]
        assert deviation_in_stds(means, covariances, expected.filtered, marginal_stds(expected.prior[1])) <= 1e-9
        # Even of the little that is left after the observation, as far as double precision carries.
        left = marginal_stds(expected.filtered[1])
        tolerance = 1e-9 if variance > 1e-12 else 1e-6
        assert deviation_in_stds(means, covariances, expected.filtered, left, least=1e-7) <= tolerance
    assert result.log_likelihoods.sum() == pytest.approx(total, rel=1e-11)


@given(systems(), st.sampled_from([0.0, 0.3]), seeds)
def test_random_system_agrees_with_brute_force(model, missing, seed):
    observations = draw_observations(model, np.random.default_rng(seed), missing)
    result = filter_sequence(model, observations)
    for index in batch_indices(model):
        at = (slice(None), *index)
        expected = dense_posterior(system_at(model, index), observations[at], digits=40)
        scale = np.abs(expected.log_likelihoods).sum() + 1  # the total may happen to be near zero
        assert abs(result.log_likelihoods[at].sum() - expected.log_likelihood) <= 1e-11 * scale
        np.testing.assert_allclose(result.log_likelihoods[at], expected.log_likelihoods, rtol=1e-11, atol=1e-11)
        stds = marginal_stds(expected.prior[1])
        filtered = result.filtered.means[at], result.filtered.covariances[at]
        assert deviation_in_stds(*filtered, expected.filtered, stds) <= 1e-9


@pytest.mark.parametrize("n_sensors", [1, 3])
def test_long_recording_agrees_with_the_textbook(n_sensors):
    rng = np.random.default_rng(3)
    model = random_system(rng, n_states=4, n_inputs=2, n_sensors=n_sensors, n_steps=400, batch=(3,))
    observations = draw_observations(model, rng, missing=0.3)
    result = filter_sequence(model, observations)
    for d in range(3):
        means, covariances, log_likelihoods = kalman_filter(system_at(model, (d,)), observations[:, d])
        np.testing.assert_allclose(result.filtered.means[:, d], means, rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(result.filtered.covariances[:, d], covariances, rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(result.log_likelihoods[:, d], log_likelihoods, rtol=1e-10, atol=1e-10)


# --- what was not seen ------------------------------------------------------------------------------------------------


@given(systems(), seeds)
def test_all_missing_is_a_rollout(model, seed):
    nothing = np.full((model.n_steps, *model.batch_shape, model.observation_matrix.shape[-2]), np.nan)
    unseen, rollout = filter_sequence(model, nothing), filter_sequence(model)
    for one, other in zip(unseen.filtered, rollout.filtered, strict=True):
        np.testing.assert_array_equal(one, other)
    assert np.all(unseen.log_likelihoods == 0)
    assert np.all(np.isnan(unseen.innovations))
    for index in batch_indices(model):
        at = (slice(None), *index)
        prior = dense_posterior(system_at(model, index), nothing[at]).prior
        assert (
            deviation_in_stds(rollout.filtered.means[at], rollout.filtered.covariances[at], prior, marginal_stds(prior[1]))
            <= 1e-9
        )


@given(systems(), seeds)
def test_missing_observation_is_prediction_only(model, seed):
    rng = np.random.default_rng(seed)
    observations = draw_observations(model, rng)
    gap = rng.random(model.n_steps) < 0.5
    observations[gap] = np.nan
    result = filter_sequence(model, observations)
    drifts, noises = model.drifts(), model.process_covariances()
    assert np.all(result.log_likelihoods[gap] == 0)
    assert np.all(np.isnan(result.innovations[gap]))
    assert not np.any(np.isnan(result.innovations[~gap]))
    assert np.all(np.isfinite(result.innovation_covariances))
    for t in np.flatnonzero(gap[1:]) + 1:
        before = result.filtered.means[t - 1], result.filtered.covariances[t - 1]
        mean, covariance = predict(*before, model.transition, drifts[t - 1], noises[t - 1])
        np.testing.assert_allclose(result.filtered.means[t], mean, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(result.filtered.covariances[t], covariance, rtol=1e-12, atol=1e-14)


@given(systems(), seeds, st.data())
def test_sensor_that_is_never_seen_might_as_well_not_exist(model, seed, data):
    n_sensors = model.observation_matrix.shape[-2]
    kept = np.array(data.draw(st.lists(st.booleans(), min_size=n_sensors, max_size=n_sensors).filter(any)))
    observations = draw_observations(model, np.random.default_rng(seed))
    fewer = replace(
        model,
        observation_matrix=model.observation_matrix[..., kept, :],
        observation_covariance=model.observation_covariance[..., kept, :][..., kept],
    )
    expected = filter_sequence(fewer, observations[..., kept])
    result = filter_sequence(model, np.where(kept, observations, np.nan))
    np.testing.assert_allclose(result.log_likelihoods, expected.log_likelihoods, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(result.filtered.means, expected.filtered.means, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(result.filtered.covariances, expected.filtered.covariances, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(result.innovations[..., kept], expected.innovations, rtol=1e-11, atol=1e-11)
    np.testing.assert_array_equal(np.isnan(result.innovations), np.broadcast_to(~kept, result.innovations.shape))


# --- index convention -------------------------------------------------------------------------------------------------


@pytest.fixture
def quiet():
    """A system at rest at zero, known exactly and not driven: only what a test adds moves it."""
    model = random_system(np.random.default_rng(1), n_states=3, n_inputs=2, n_sensors=1, n_steps=8, known_start=True)
    nothing = np.zeros_like(model.inputs), np.zeros_like(model.input_covariances), np.zeros(3)
    return replace(model, inputs=nothing[0], input_covariances=nothing[1], initial_mean=nothing[2])


@pytest.mark.parametrize("k", range(7))
def test_input_k_first_moves_state_k_plus_1(quiet, k):
    inputs = quiet.inputs.copy()
    inputs[k, 0] = 1.0
    means = filter_sequence(replace(quiet, inputs=inputs)).filtered.means
    assert np.all(means[: k + 1] == 0)
    np.testing.assert_array_equal(means[k + 1], quiet.input_matrix[:, 0])


@pytest.mark.parametrize("k", range(7))
def test_input_covariance_k_first_spreads_state_k_plus_1(quiet, k):
    uncertain = quiet.input_covariances.copy()
    uncertain[k] = random_covariance(np.random.default_rng(k), (), 2, 2)
    covariances = filter_sequence(replace(quiet, input_covariances=uncertain)).filtered.covariances
    assert np.all(covariances[: k + 1] == 0)
    np.testing.assert_allclose(covariances[k + 1], quiet.input_matrix @ uncertain[k] @ quiet.input_matrix.T, atol=1e-14)


def test_first_observation_updates_the_initial_state_without_a_prediction(quiet):
    model = replace(quiet, initial_mean=np.ones(3), initial_covariance=np.eye(3))
    observations = np.full((8, 1), np.nan)
    observations[0] = 2.5
    result = filter_sequence(model, observations)
    c, r = model.observation_matrix[0], model.observation_covariance[0, 0]
    assert result.innovations[0, 0] == pytest.approx(2.5 - c.sum(), rel=1e-14)
    assert result.innovation_covariances[0, 0, 0] == pytest.approx(c @ c + r, rel=1e-14)
    np.testing.assert_allclose(result.filtered.means[0], 1 + c * (2.5 - c.sum()) / (c @ c + r), rtol=1e-13)
    np.testing.assert_allclose(result.filtered.covariances[0], np.eye(3) - np.outer(c, c) / (c @ c + r), atol=1e-14)


def test_recording_is_less_likely_if_inputs_are_shifted_by_one():
    rng = np.random.default_rng(0)
    precise = {"weight_covariances": np.zeros((2, 8, 8)), "forcing_precisions": np.ones(2)}
    model = dmp_system(rng, n_dof=2, n_steps=60, observation_variances=np.full(2, 1e-6), **precise)
    observations = draw_observations(model, rng)
    right = filter_sequence(model, observations).log_likelihoods.sum()
    for shift in (-1, 1):
        shifted = replace(model, inputs=np.roll(model.inputs, shift, axis=0))
        assert filter_sequence(shifted, observations).log_likelihoods.sum() < right - 300


# --- the log-likelihood -----------------------------------------------------------------------------------------------


@given(systems(batches=((),)), seeds)
def test_log_likelihood_of_a_step_is_the_density_of_the_prediction(model, seed):
    observations = draw_observations(model, np.random.default_rng(seed))
    result, system = filter_sequence(model, observations), system_at(model)
    predicted, covariances = dense_posterior(system, observations).predicted
    for t in range(model.n_steps):
        mean, spread = system.C @ predicted[t], system.C @ covariances[t] @ system.C.T + system.R
        np.testing.assert_allclose(result.innovations[t], observations[t] - mean, atol=1e-10)
        np.testing.assert_allclose(result.innovation_covariances[t], spread, rtol=1e-10, atol=1e-10)
        expected = multivariate_normal(mean, spread).logpdf(observations[t])
        assert result.log_likelihoods[t] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_noisier_sensor_widens_the_innovation_by_just_its_variance(quiet):
    model = replace(quiet, initial_covariance=np.eye(3))
    variances = np.array([1e-6, 1.0, 1e6])
    widths = [
        filter_sequence(replace(model, observation_covariance=np.array([[r]]))).innovation_covariances[0, 0, 0]
        for r in variances
    ]
    np.testing.assert_allclose(np.diff(widths), np.diff(variances), rtol=1e-12)


@given(systems(), st.sampled_from([1e-6, 1e-3, 1e3, 1e6]), seeds)
def test_units_shift_the_log_likelihood_by_their_logarithm(model, factor, seed):
    observations = draw_observations(model, np.random.default_rng(seed), missing=0.2)
    scaled = replace(
        model,
        inputs=model.inputs * factor,
        input_covariances=model.input_covariances * factor**2,
        observation_covariance=model.observation_covariance * factor**2,
        initial_mean=model.initial_mean * factor,
        initial_covariance=model.initial_covariance * factor**2,
    )
    one, other = filter_sequence(model, observations), filter_sequence(scaled, observations * factor)
    n_seen = np.sum(~np.isnan(observations), axis=-1)
    np.testing.assert_allclose(other.log_likelihoods, one.log_likelihoods - n_seen * np.log(factor), rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(other.filtered.means, one.filtered.means * factor, rtol=1e-9, atol=1e-9 * factor)


@given(systems(), seeds)
def test_order_of_sensors_does_not_matter(model, seed):
    observations = draw_observations(model, np.random.default_rng(seed), missing=0.2)
    backwards = replace(
        model,
        observation_matrix=model.observation_matrix[..., ::-1, :],
        observation_covariance=model.observation_covariance[..., ::-1, ::-1],
    )
    one, other = filter_sequence(model, observations), filter_sequence(backwards, observations[..., ::-1])
    np.testing.assert_allclose(other.log_likelihoods, one.log_likelihoods, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(other.filtered.means, one.filtered.means, rtol=1e-11, atol=1e-11)


# --- one code path ----------------------------------------------------------------------------------------------------


@given(systems(), seeds)
def test_batch_is_its_entries_one_by_one(model, seed):
    observations = draw_observations(model, np.random.default_rng(seed), missing=0.2)
    result = filter_sequence(model, observations)
    for index in batch_indices(model):
        at = (slice(None), *index)
        alone = filter_sequence(single(model, index), observations[at])
        for whole, part in zip((*result.filtered, *result[1:]), (*alone.filtered, *alone[1:]), strict=True):
            np.testing.assert_allclose(whole[at], part, rtol=1e-12, atol=1e-12)


@given(systems(batches=((2,), (2, 3))), seeds)
def test_permuted_batch_gives_permuted_results(model, seed):
    rng = np.random.default_rng(seed)
    observations = draw_observations(model, rng, missing=0.2)
    indices = [tuple(i) for i in rng.permutation(batch_indices(model))]
    permuted = stacked([single(model, index) for index in indices])
    other = filter_sequence(permuted, np.stack([observations[(slice(None), *i)] for i in indices], axis=1))
    result = filter_sequence(model, observations)
    for k, index in enumerate(indices):
        at = (slice(None), *index)
        np.testing.assert_allclose(other.filtered.means[:, k], result.filtered.means[at], rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(other.filtered.covariances[:, k], result.filtered.covariances[at], rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(other.log_likelihoods[:, k], result.log_likelihoods[at], rtol=1e-12, atol=1e-12)


@given(systems(), seeds)
def test_step_by_step_is_the_same_as_all_at_once(model, seed):
    observations = draw_observations(model, np.random.default_rng(seed), missing=0.2)
    result = filter_sequence(model, observations)
    mean, covariance = model.initial_mean, model.initial_covariance
    for t, observation in enumerate(observations):
        if t > 0:
            drift, noise = model.drifts()[t - 1], model.process_covariances()[t - 1]
            mean, covariance = predict(mean, covariance, model.transition, drift, noise)
        seen = AffineObservation(observation, model.observation_matrix, model.observation_covariance)
        step = update(mean, covariance, seen)
        mean, covariance = step.mean, step.covariance
        expected = np.broadcast_to(mean, result.filtered.means[t].shape)
        np.testing.assert_allclose(result.filtered.means[t], expected, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(step.log_likelihood, result.log_likelihoods[t], rtol=1e-12, atol=1e-12)


# --- covariances stay covariances -------------------------------------------------------------------------------------


def four_corners(rng, n_steps, scheme, copies=1):
    """(copies, 4) systems that go on for many durations: R and the forcing variance each either tiny or large."""
    noise, variances = np.array([1e-8, 1e-8, 1.0, 1.0]), np.array([1e-12, 1e-2, 1e-12, 1e-2])
    model = dmp_system(rng, n_dof=4, n_steps=101, discretization=scheme, observation_variances=variances)
    inputs = np.resize(model.inputs, (n_steps - 1, copies, 4, 1))
    covariance = noise[:, None, None] * 156.25**2  # (alpha_z^2 / 4)^2: a forcing term that moves the attractor by one unit
    return replace(model, inputs=inputs, input_covariances=np.broadcast_to(covariance, (n_steps - 1, 1, 4, 1, 1)))


def least_scaled_eigenvalue(covariances):
    """Of the correlation matrices; a variable without variance is left out."""
    stds = marginal_stds(covariances)
    stds = np.where(stds > 0, stds, 1)
    return np.linalg.eigvalsh(covariances / (stds[..., :, None] * stds[..., None, :])).min()


@pytest.mark.parametrize("scheme", SCHEMES)
def test_covariances_stay_symmetric_and_positive_over_a_long_run(scheme):
    rng = np.random.default_rng(0)
    model = four_corners(rng, n_steps=10_000, scheme=scheme)
    observations = draw_observations(model, rng, missing=0.1)
    observations[5000:5500] = np.nan
    result = filter_sequence(model, observations)
    covariances = result.filtered.covariances
    np.testing.assert_array_equal(covariances, covariances.mT)
    assert least_scaled_eigenvalue(covariances) > -1e-12
    assert np.all(np.diagonal(covariances, axis1=-2, axis2=-1) > 0)
    # The recording came from the model: squared innovations are as large as the filter says, or the covariance drifted.
    ratio = np.nanmean(result.innovations[..., 0] ** 2 / result.innovation_covariances[..., 0, 0], axis=0)
    np.testing.assert_allclose(ratio, 1, atol=5 * np.sqrt(2 / 8000))


@pytest.mark.slow
@pytest.mark.parametrize("scheme", SCHEMES)
def test_covariances_stay_symmetric_and_positive_over_ten_million_steps(scheme):
    rng = np.random.default_rng(0)
    n_steps, copies = 12_500, 200  # times four corners; step by step, as the whole would not fit into memory
    model = four_corners(rng, n_steps, scheme, copies)
    drifts, noises = model.drifts(), model.process_covariances()
    mean, covariance = model.initial_mean, model.initial_covariance
    stds = np.sqrt(model.observation_covariance[..., 0])
    for t in range(n_steps):
        if t > 0:
            mean, covariance = predict(mean, covariance, model.transition, drifts[t - 1], noises[t - 1])
        seen = mean[..., 2:] + stds * rng.standard_normal((copies, 4, 1))
        observation = np.where(rng.random(seen.shape) < 0.1, np.nan, seen)
        sensed = AffineObservation(observation, model.observation_matrix, model.observation_covariance)
        step = update(mean, covariance, sensed)
        mean, covariance = step.mean, step.covariance
        assert np.array_equal(covariance, covariance.mT)
        assert least_scaled_eigenvalue(covariance) > -1e-12
    assert np.all(np.isfinite(mean))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_spread_along_one_line_leaves_only_rounding_beside_it(scheme):
    """After a known start and one step the covariance has rank one, and an observation shrinks it up to 1e12 times."""
    covariances, before = known_start_run(scheme)
    stds = marginal_stds(before)
    scaled = covariances / (stds[..., :, None] * stds[..., None, :])
    assert np.linalg.eigvalsh(scaled).min() > -1e-12


def known_start_run(scheme):
    """Filtered covariances of the four corners and those of their rollout, from the first step on."""
    rng = np.random.default_rng(0)
    model = four_corners(rng, n_steps=50, scheme=scheme)
    model = replace(model, initial_covariance=np.zeros((3, 3)))
    filtered, rollout = filter_sequence(model, draw_observations(model, rng)).filtered, filter_sequence(model).filtered
    return filtered.covariances[1:, 0], rollout.covariances[1:, 0]


@given(systems(), seeds)
def test_observation_never_increases_variance(model, seed):
    observations = draw_observations(model, np.random.default_rng(seed), missing=0.2)
    filtered, rollout = filter_sequence(model, observations).filtered, filter_sequence(model).filtered
    gained = rollout.covariances - filtered.covariances
    scale = np.abs(rollout.covariances).max() + 1e-300
    assert np.linalg.eigvalsh(gained).min() > -1e-12 * scale
    assert np.linalg.eigvalsh(filtered.covariances).min() > -1e-12 * scale


def test_covariances_do_not_depend_on_what_was_observed():
    rng = np.random.default_rng(0)
    model = LinearGaussianModel(*system_at(dmp_system(rng, n_dof=1, n_steps=30), (0,)))
    one, other = (filter_sequence(model, rng.standard_normal((30, 1))) for _ in range(2))
    np.testing.assert_array_equal(one.filtered.covariances, other.filtered.covariances)
    assert not np.any(one.log_likelihoods == other.log_likelihoods)
