"""The same movement in statsmodels, an independent Kalman filter and smoother."""

import numpy as np
import pytest
from reference import deviation_in_stds, marginal_stds, system_at
from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother
from strategies import dmp_system, draw_observations, random_system

from probdmp.gaussian import filter_sequence, smooth_sequence


def statsmodels_smoother(system):
    """statsmodels writes a[t+1] = T[t] a[t] + c[t] + R[t] e[t]: what it indexes by t drives t to t + 1, as our u[t] does.

    Its arrays have T columns, time last; nothing follows the last one.
    """
    A, B, u, U, C, R, m0, V0 = system
    n_steps = len(u) + 1
    model = KalmanSmoother(k_endog=len(C), k_states=len(A), k_posdef=B.shape[1], nobs=n_steps)
    intercepts, noises = np.zeros((len(A), n_steps)), np.zeros((*U.shape[1:], n_steps))
    intercepts[:, :-1], noises[..., :-1] = (u @ B.T).T, np.moveaxis(U, 0, -1)
    model["design"], model["obs_cov"] = C, R
    model["transition"], model["selection"] = A, B
    model["state_intercept"], model["state_cov"] = intercepts, noises
    model.initialize_known(m0, V0)
    model.tolerance = 0  # always compute the covariance, even if it seems to have converged
    return model


def assert_agreement(model, observations, tolerance=1e-9):
    """tolerance : of states, in marginal standard deviations."""
    filtered, smoothed = filter_sequence(model, observations), smooth_sequence(model, observations)
    rollout = filter_sequence(model).filtered
    for index in np.ndindex(model.batch_shape):
        at = (slice(None), *index)
        other = statsmodels_smoother(system_at(model, index))
        other.bind(np.ascontiguousarray(observations[at]))
        result = other.smooth()
        log_likelihoods = filtered.log_likelihoods[at]
        assert log_likelihoods.sum() == pytest.approx(result.llf, rel=1e-10)
        np.testing.assert_allclose(log_likelihoods, result.llf_obs, rtol=1e-9, atol=1e-9)
        stds = marginal_stds(rollout.covariances[at])
        theirs = result.filtered_state.T, np.moveaxis(result.filtered_state_cov, -1, 0)
        assert deviation_in_stds(filtered.filtered.means[at], filtered.filtered.covariances[at], theirs, stds) <= tolerance
        theirs = result.smoothed_state.T, np.moveaxis(result.smoothed_state_cov, -1, 0)
        assert deviation_in_stds(smoothed.means[at], smoothed.covariances[at], theirs, stds) <= tolerance


@pytest.mark.parametrize("missing", [0.0, 0.3])
@pytest.mark.parametrize("scheme", ["exact", "semi_implicit_euler"])
@pytest.mark.parametrize("variance", [1e-12, 1e-6, 1e-2])
def test_movement(variance, scheme, missing):
    rng = np.random.default_rng(0)
    model = dmp_system(rng, n_dof=3, n_steps=300, observation_variances=np.full(3, variance), discretization=scheme)
    # statsmodels does not update in Joseph form: at R = 1e-12 it is the less exact of the two.
    assert_agreement(model, draw_observations(model, rng, missing), tolerance=1e-9 if variance > 1e-12 else 1e-8)


@pytest.mark.parametrize("known_start", [False, True], ids=["uncertain start", "known start"])
def test_partly_missing_vectors(known_start):
    rng = np.random.default_rng(0)
    model = random_system(
        rng, n_states=4, n_inputs=2, n_sensors=3, n_steps=300, batch=(2,), noise_rank=1, known_start=known_start
    )
    observations = draw_observations(model, rng, missing=0.3)
    seen = np.sum(~np.isnan(observations), axis=-1)
    assert {0, 1, 2, 3} == set(np.unique(seen))
    assert_agreement(model, observations)
