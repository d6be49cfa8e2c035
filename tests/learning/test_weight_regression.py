"""Bayesian regression, against the formulas of Bishop and against the evidence itself."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from strategies import seeds

from probdmp.dmp.basis import basis_features
from probdmp.dmp.phase import phases_at
from probdmp.learning.weight_regression import log_evidence, regress_weights


def problem(seed, n_samples, n_weights, signal_to_noise, basis=True):
    """Features Phi and targets of about unit size, drawn from the model."""
    rng = np.random.default_rng(seed)
    if basis:
        phi = basis_features(phases_at((np.arange(n_samples) + 0.5) / n_samples, 1.0), n_weights)
    else:
        phi = rng.standard_normal((n_samples, n_weights))
    clean = phi @ rng.standard_normal(n_weights)
    clean /= np.sqrt(np.mean(clean**2))
    return phi, clean + rng.standard_normal(n_samples) / np.sqrt(signal_to_noise)


def evidence_of(phi, targets):
    """(alpha, beta) to ln N(f; 0, 1/beta I + 1/alpha Phi Phi^T), along the principal axes: nothing cancels at any of them."""
    u, s, _ = np.linalg.svd(phi, full_matrices=False)
    along = (u.T @ targets) ** 2
    across = np.sum((targets - u @ (u.T @ targets)) ** 2)

    def evidence(alpha, beta):
        variances = 1 / beta + s**2 / alpha
        beside = (len(targets) - len(s)) * np.log(2 * np.pi / beta) + across * beta
        return -0.5 * (np.sum(np.log(2 * np.pi * variances) + along / variances) + beside)

    return evidence


problems = {
    "seed": seeds,
    "n_samples": st.sampled_from([12, 40, 200]),
    "n_weights": st.sampled_from([1, 3, 10]),
    "log_snr": st.floats(0, 6),
    "basis": st.booleans(),
}


@given(**problems)
def test_posterior_is_bishops(seed, n_samples, n_weights, log_snr, basis):
    """Equations 3.53 and 3.54, solved directly."""
    phi, f = problem(seed, n_samples, n_weights, 10**log_snr, basis)
    w = regress_weights(phi, f, 1e-9)
    precision = w.alpha * np.eye(n_weights) + w.beta * phi.T @ phi
    np.testing.assert_allclose(precision @ w.covariance, np.eye(n_weights), atol=1e-6)
    np.testing.assert_allclose(w.mean, w.beta * np.linalg.solve(precision, phi.T @ f), rtol=1e-6, atol=1e-9)
    np.testing.assert_array_equal(w.covariance, w.covariance.T)


@given(**problems)
def test_no_nearby_alpha_or_beta_has_more_evidence(seed, n_samples, n_weights, log_snr, basis):
    assume(n_samples > n_weights)
    phi, f = problem(seed, n_samples, n_weights, 10**log_snr, basis)
    w = regress_weights(phi, f, 1e-9)
    evidence = evidence_of(phi, f)
    reached = evidence(w.alpha, w.beta)
    for step in (1e-3, 0.1, 1.0):
        for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            assert evidence(w.alpha * np.exp(a * step), w.beta * np.exp(b * step)) <= reached + 1e-6


@given(**problems)
def test_the_evidence_is_stationary(seed, n_samples, n_weights, log_snr, basis):
    """Numerical gradient with respect to ln alpha and ln beta, in nats."""
    assume(n_samples > n_weights + 2)
    phi, f = problem(seed, n_samples, n_weights, 10 ** (log_snr / 2), basis)
    w = regress_weights(phi, f, 1e-9)
    evidence, h = evidence_of(phi, f), 1e-4
    by_alpha = (evidence(w.alpha * np.exp(h), w.beta) - evidence(w.alpha * np.exp(-h), w.beta)) / (2 * h)
    by_beta = (evidence(w.alpha, w.beta * np.exp(h)) - evidence(w.alpha, w.beta * np.exp(-h))) / (2 * h)
    assert abs(by_beta) < 1e-4
    assert abs(by_alpha) < 1e-4


@settings(max_examples=20)
@given(seeds, st.floats(0, 4))
def test_no_other_alpha_and_beta_have_much_more_evidence(seed, log_snr):
    """A grid over 12 decades; enough samples that there is one maximum."""
    phi, f = problem(seed, 200, 8, 10**log_snr)
    w = regress_weights(phi, f, 1e-9)
    evidence = evidence_of(phi, f)
    best = max(evidence(10.0**a, 10.0**b) for a in np.arange(-6, 6.5, 0.5) for b in np.arange(-2, 8.5, 0.5))
    assert best <= evidence(w.alpha, w.beta) + 1e-6


@given(seeds, st.sampled_from([5, 30, 100]), st.sampled_from([1, 4, 8]), st.floats(-2, 4), st.floats(-2, 4))
def test_log_evidence_is_the_marginal_density_of_the_targets(seed, n_samples, n_weights, log_alpha, log_beta):
    phi, f = problem(seed, n_samples, n_weights, 10.0)
    alpha, beta = 10**log_alpha, 10**log_beta
    marginal = np.eye(n_samples) / beta + phi @ phi.T / alpha
    direct = -0.5 * (np.linalg.slogdet(2 * np.pi * marginal)[1] + f @ np.linalg.solve(marginal, f))
    np.testing.assert_allclose(log_evidence(phi, f, alpha, beta), direct, rtol=1e-6, atol=1e-6)


def test_precisions_of_many_samples_are_found():
    rng = np.random.default_rng(0)
    phi = rng.standard_normal((4000, 200))
    f = phi @ (rng.standard_normal(200) * 2) + rng.standard_normal(4000) * 0.5
    w = regress_weights(phi, f, 1e-9)
    assert 1 / np.sqrt(w.alpha) == pytest.approx(2, rel=0.1)
    assert 1 / np.sqrt(w.beta) == pytest.approx(0.5, rel=0.05)


def test_weights_lie_within_their_posterior():
    z = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        phi, true = rng.standard_normal((60, 8)), rng.standard_normal(8)
        w = regress_weights(phi, phi @ true + 0.3 * rng.standard_normal(60), 1e-9)
        z.append(np.linalg.solve(np.linalg.cholesky(w.covariance), w.mean - true))
    assert np.std(z) == pytest.approx(1.0, abs=0.08)


@given(seeds, st.sampled_from([1e-20, 1e-6, 1e6, 1e20]))
def test_units_of_the_targets_scale_everything(seed, unit):
    phi, f = problem(seed, 60, 8, 100.0)
    one, other = regress_weights(phi, f, 1e-9), regress_weights(phi, f * unit, 1e-9 * unit)
    np.testing.assert_allclose(other.mean, one.mean * unit, rtol=1e-6, atol=1e-9 * unit)
    np.testing.assert_allclose(other.covariance, one.covariance * unit**2, rtol=1e-6, atol=1e-12 * unit**2)
    np.testing.assert_allclose([other.alpha, other.beta], np.array([one.alpha, one.beta]) / unit**2, rtol=1e-6)


# --- where there is not enough to learn from --------------------------------------------------------------------------


def assert_usable(w):
    assert 0 < w.alpha < np.inf
    assert 0 < w.beta < np.inf
    assert np.isfinite(w.mean).all()
    assert np.isfinite(w.covariance).all()
    assert np.linalg.eigvalsh(w.covariance).min() >= -1e-9 * np.abs(w.covariance).max()


@pytest.mark.parametrize(("n_samples", "n_weights"), [(1, 1), (11, 30), (200, 30)])
def test_zero_targets_need_no_weights(n_samples, n_weights):
    phi, _ = problem(0, n_samples, n_weights, 1.0)
    w = regress_weights(phi, np.zeros(n_samples), 1e-9)
    assert_usable(w)
    np.testing.assert_array_equal(w.mean, 0)
    assert np.sqrt(w.covariance.max() * phi.max() ** 2 + 1 / w.beta) < 1e-8  # and the forcing term is sure to be nothing


@given(seeds, st.sampled_from([3, 12, 200]), st.sampled_from([1, 2]))
def test_a_perfect_fit_has_a_large_but_finite_precision(seed, n_samples, n_weights):
    phi, _ = problem(seed, n_samples, n_weights, 1.0)
    true = np.random.default_rng(seed).standard_normal(n_weights) + 3
    f = phi @ true
    w = regress_weights(phi, f, 1e-9)
    assert_usable(w)
    assert w.beta * np.mean(f**2) > 1e9
    np.testing.assert_allclose(phi @ w.mean, f, atol=1e-5 * np.abs(f).max())


@settings(max_examples=300)
@given(
    seeds,
    st.integers(1, 30),
    st.sampled_from([1, 2, 8, 30, 60]),
    st.floats(-6, 40),
    st.sampled_from([1e-30, 1.0, 1e30]),
    st.booleans(),
)
def test_fewer_samples_than_weights(seed, n_samples, n_weights, log_snr, unit, basis):
    """The prior decides; whatever fits exactly or not at all, nothing overflows and no precision is lost."""
    phi, f = problem(seed, n_samples, n_weights, 10**log_snr, basis)
    w = regress_weights(phi, f * unit, 1e-9 * unit)
    assert_usable(SimpleNamespace(
        alpha=w.alpha * unit**2, beta=w.beta * unit**2, mean=w.mean / unit, covariance=w.covariance / unit**2
    ))  # fmt: skip
    assert np.abs(phi @ w.mean).max() < 1.5 * np.abs(f * unit).max()


def test_repeated_features_share_their_weight():
    rng = np.random.default_rng(0)
    phi = np.repeat(rng.standard_normal((50, 1)), 4, axis=1)
    w = regress_weights(phi, phi[:, 0] * 8 + 0.01 * rng.standard_normal(50), 1e-9)
    assert_usable(w)
    np.testing.assert_allclose(w.mean, 2, rtol=0.01)


def test_noise_alone_needs_no_weights():
    shrunk = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        phi = rng.standard_normal((2000, 10))
        w = regress_weights(phi, rng.standard_normal(2000), 1e-9)
        assert_usable(w)
        assert 1 / w.beta == pytest.approx(1, rel=0.15)
        shrunk.append(np.abs(w.mean).max())
    assert np.median(shrunk) < 0.05
