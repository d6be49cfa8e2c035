"""Series that share their gains: the same as each of them filtered and smoothed by itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from probdmp.errors import InputError
from probdmp.gaussian import (
    LinearGaussianModel,
    filter_sequence,
    sample_sequences,
    score_series,
    shared_gains,
    shifted_paths,
    smooth_sequence,
    smooth_series,
)

seeds = st.integers(0, 2**32 - 1)


@st.composite
def models(draw):
    """A movement's system of D degrees of freedom over T times: acceleration, velocity, position."""
    rng = np.random.default_rng(draw(seeds))
    t, d, dt = draw(st.integers(1, 40)), draw(st.integers(1, 6)), draw(st.sampled_from([0.002, 0.01]))
    a1, a0 = -25.0, -156.25
    transition = np.array([[0, a1, a0], [0, 1 + a1 * dt, a0 * dt], [0, dt + a1 * dt**2, 1 + a0 * dt**2]])
    start = rng.normal(size=(d, 3, 3)) * draw(st.sampled_from([0.0, 0.01]))
    return LinearGaussianModel(
        transition,
        np.array([[1.0], [dt], [dt**2]]),
        rng.normal(size=(t - 1, d, 1)) * 100,
        rng.random((t - 1, d, 1, 1)) * draw(st.sampled_from([1e-6, 1.0, 1e4])),
        np.array([[0.0, 0.0, 1.0]]),
        np.full((d, 1, 1), draw(st.sampled_from([1e-6, 1e-2]))),
        rng.normal(size=(d, 3)),
        start @ start.mT,
    )


def drawn(model, n_series, seed, missing=0.0):
    rng = np.random.default_rng(seed)
    observations = np.ascontiguousarray(sample_sequences(model, n_series, rng)[1][..., 0])
    observations[rng.random(observations.shape) < missing] = np.nan
    return observations


@settings(max_examples=40)
@given(models(), st.integers(1, 9), st.sampled_from([0.0, 0.0, 0.1]), seeds)
def test_a_score_is_that_of_the_series_by_itself(model, n_series, missing, seed):
    observations = drawn(model, n_series, seed, missing)
    scores = score_series(shared_gains(model), observations)
    for score, own in zip(scores, observations, strict=True):
        expected = filter_sequence(model, own[..., None]).log_likelihoods
        np.testing.assert_allclose(score, expected.sum(), rtol=1e-9, atol=1e-9 * np.abs(expected).sum() + 1e-12)


@settings(max_examples=40)
@given(models(), st.integers(1, 9), seeds)
def test_smoothed_states_are_those_of_the_series_by_itself(model, n_series, seed):
    observations = drawn(model, n_series, seed)
    means, covariances = smooth_series(shared_gains(model), observations)
    for mean, own in zip(means, observations, strict=True):
        expected = smooth_sequence(model, own[..., None])
        stds = np.sqrt(np.diagonal(expected.covariances, axis1=-2, axis2=-1))
        size = np.abs(expected.means).max(axis=(0, 1))
        assert np.all(np.abs(mean - expected.means) <= 1e-9 * (stds + size))
        spread = np.abs(expected.covariances).max(axis=(0, 1))
        assert np.all(np.abs(covariances - expected.covariances) <= 1e-9 * spread)


@settings(max_examples=40)
@given(models(), st.integers(2, 40), st.integers(2, 5), seeds)
def test_threads_change_nothing(model, n_series, n_threads, seed):
    observations, gains = drawn(model, n_series, seed, 0.01), shared_gains(model)
    np.testing.assert_array_equal(score_series(gains, observations, n_threads), score_series(gains, observations))
    complete = np.nan_to_num(observations)
    np.testing.assert_array_equal(smooth_series(gains, complete, n_threads).means, smooth_series(gains, complete).means)


@settings(max_examples=40)
@given(models(), seeds)
def test_paths_of_other_starts_and_constant_inputs(model, seed):
    rng = np.random.default_rng(seed)
    if model.n_steps < 2:
        return
    gains, d = shared_gains(model), model.initial_mean.shape[0]
    starts, more = rng.normal(size=(3, d, 3)), rng.normal(size=(3, d))
    paths = shifted_paths(gains, starts, model.inputs[0, :, 0] + more)
    for start, added, path in zip(starts, more, paths, strict=True):
        moved = LinearGaussianModel(
            model.transition,
            model.input_matrix,
            model.inputs + added[:, None],
            model.input_covariances,
            model.observation_matrix,
            model.observation_covariance,
            start,
            model.initial_covariance,
        )
        expected = filter_sequence(moved).filtered.means[..., 2]
        np.testing.assert_allclose(path, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
        observations = drawn(moved, 2, seed)
        scores = score_series(gains, observations, paths=np.stack([path, path]))
        np.testing.assert_allclose(scores, score_series(shared_gains(moved), observations), rtol=1e-7, atol=1e-6)


def test_no_series_have_no_scores(line):
    gains = shared_gains(line)
    for n_threads in (1, 2):
        assert score_series(gains, np.empty((0, line.n_steps, 2)), n_threads).shape == (0,)


@pytest.mark.parametrize("value", [np.inf, -np.inf, 1e101, 1e200])
def test_what_cannot_be_squared_is_an_error(line, value):
    observations = np.zeros((3, line.n_steps, 2))
    observations[1, 4, 1] = value
    with pytest.raises(InputError, match="observations"):
        score_series(shared_gains(line), observations)


def test_what_does_not_fit_is_an_error(line):
    gains = shared_gains(line)
    with pytest.raises(InputError, match=r"observations of shape \(N, 12, 2\).*\(3, 2, 12\)"):
        score_series(gains, np.zeros((3, 2, line.n_steps)))
    with pytest.raises(InputError, match="n_threads"):
        score_series(gains, np.zeros((3, line.n_steps, 2)), 0)
    missing = np.zeros((3, line.n_steps, 2))
    missing[0, 0, 0] = np.nan
    with pytest.raises(InputError, match="smooth_sequence"):
        smooth_series(gains, missing)


def test_systems_with_several_sensors_are_for_the_general_filter(line):
    two = LinearGaussianModel(
        line.transition,
        line.input_matrix,
        line.inputs,
        line.input_covariances,
        np.eye(3)[:2],
        np.eye(2),
        line.initial_mean,
        line.initial_covariance,
    )
    with pytest.raises(InputError, match="filter_sequence takes any model"):
        shared_gains(two)


@pytest.fixture
def line():
    """Two masses on a line, seen twelve times."""
    return LinearGaussianModel(
        np.array([[0.0, 0.0, 0.0], [0.1, 1.0, 0.0], [0.0, 0.1, 1.0]]),
        np.array([[1.0], [0.1], [0.0]]),
        np.ones((11, 2, 1)),
        np.ones((11, 2, 1, 1)),
        np.array([[0.0, 0.0, 1.0]]),
        np.array([[0.1]]),
        np.zeros((2, 3)),
        np.zeros((3, 3)),
    )
