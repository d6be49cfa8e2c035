"""How likely points of a path are, held to the multivariate t of SciPy; and what is made of it, of one execution or of many."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_t

from probdmp.detection.comparison import Candidates
from probdmp.detection.diagnosis import LOOKED_AT, diagnose
from probdmp.detection.evidence import DEGREES_OF_FREEDOM
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.point_densities import densities_of_points

D = 2
ARC = np.linspace(0, np.pi, TICKS + 1)[:, None]
MEANS = np.hstack([1 - np.cos(ARC), np.sin(ARC)]) / 2


def path_covariance(rng, scale=0.05):
    """Of smooth deviations, (M, D, M, D)."""
    waves = scale * np.sin(ARC * np.arange(1, 7)) @ rng.normal(size=(6, D * 6)) / np.arange(1, D * 6 + 1)
    halves = waves.reshape(TICKS + 1, D, 6)
    return np.einsum("mdk,nek->mdne", halves, halves)


@given(st.integers(1, 3), st.integers(1, 4), st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_densities_differ_as_those_of_a_multivariate_t(n_paths, n_accounts, n_points, seed):
    rng = np.random.default_rng(seed)
    covariances = np.stack([path_covariance(rng) for _ in range(n_paths)])
    noise = 0.01 * (1 + rng.random((n_paths, D)))
    phases, aside = (
        rng.integers(0, TICKS + 1, (n_paths, n_accounts, n_points)),
        rng.normal(size=(n_paths, n_accounts, n_points)),
    )
    residuals = rng.normal(size=(n_paths, n_accounts, n_points, D))
    unseen = rng.random((n_points, D)) < 0.2
    residuals[..., unseen] = np.nan
    densities, squares = densities_of_points(covariances, noise, phases, aside, residuals)
    assert not squares[..., unseen].any()
    seen, expected = np.flatnonzero(~unseen), np.empty((n_paths, n_accounts))
    for k, e in np.ndindex(n_paths, n_accounts):
        at = phases[k, e]
        whole = covariances[k][at][:, :, at].reshape(n_points * D, -1) + np.diag(np.tile(noise[k], n_points))
        whole += np.kron(np.outer(aside[k, e], aside[k, e]), np.eye(D))
        own = whole[np.ix_(seen, seen)], residuals[k, e].ravel()[seen]
        expected[k, e] = multivariate_t(shape=own[0], df=DEGREES_OF_FREEDOM).logpdf(own[1]) if len(seen) else 0.0
        assert squares[k, e].sum() == pytest.approx(own[1] @ np.linalg.solve(*own), rel=1e-9)
    np.testing.assert_allclose(densities - densities[0, 0], expected - expected[0, 0], rtol=1e-9, atol=1e-9)


@pytest.fixture(scope="module")
def model():
    covariance = path_covariance(np.random.default_rng(0))
    return PathModel(MEANS, covariance, np.zeros((TICKS + 1, D, D)), np.full(D, 1e-4))


def executions(rng, n):
    """As they should be, slower, faster, paused, held or aside since a while ago; some seen in part, some just begun."""
    ticks = rng.integers(0, 140, n)
    ago = np.arange(LOOKED_AT.max(), -1, -1)
    instants = (ticks[:, None] - ago).astype(float)
    since = np.maximum(instants - (ticks - rng.integers(5, 60, n))[:, None], 0)
    lost = np.stack([0 * since, 0.5 * since, -since, np.minimum(since, 15), since, 0 * since])[np.arange(n) % 6, np.arange(n)]
    recent = MEANS[np.clip(np.rint(instants - lost), 0, TICKS).astype(int)] + 0.01 * rng.standard_normal((n, len(ago), D))
    recent[5::6] += 0.02 * since[5::6, :, None]
    recent[rng.random(recent.shape) < 0.05 * rng.integers(0, 2, (n, 1, 1))] = np.nan
    recent[instants < 0] = np.nan
    return recent, ticks


def test_executions_together_are_explained_as_each_by_itself(model):
    rng, n = np.random.default_rng(1), 120
    recent, ticks = executions(rng, n)
    means, since, noise = np.tile(MEANS, (n, 1, 1)), rng.integers(0, 9, n), np.full(D, 0.01)
    together = diagnose(model, means, recent, ticks, noise, since)
    each = [diagnose(model, *(x[k : k + 1] for x in (means, recent, ticks)), noise, since[k : k + 1])[0] for k in range(n)]
    assert together == each
    assert {cause for _, cause in together} == {"off the path", "slow", "fast", "paused", "held"}


def test_nothing_is_read_from_what_was_not_seen(model):
    recent, ticks = executions(np.random.default_rng(2), 6)
    found = diagnose(model, np.tile(MEANS, (6, 1, 1)), np.full_like(recent, np.nan), ticks, np.full(D, 0.01), np.zeros(6, int))
    assert {cause for _, cause in found} == {"off the path"}
    assert diagnose(model, MEANS[None][:0], recent[:0], ticks[:0], np.full(D, 0.01), ticks[:0]) == []


@pytest.fixture(scope="module")
def candidates():
    rng = np.random.default_rng(3)
    return Candidates(
        np.stack([MEANS * scale for scale in (1.0, -1.0, 0.5)]),
        np.stack([path_covariance(rng) for _ in range(3)]),
        np.full((3, D), 1e-4),
        np.array([[1.0, 2.0], [3.0, 1.0], [1.0, 1.0]]),
        np.array([1.0, 1.1, 0.9]),
    )


@pytest.fixture(scope="module")
def moved():
    """Times and displacements of five executions."""
    rng = np.random.default_rng(4)
    return np.sort(rng.random((5, 7)), axis=1), rng.normal(size=(5, 7, D))


def test_executions_together_are_compared_as_each_by_itself(candidates, moved):
    together = candidates.log_densities(*moved)
    for k in range(5):
        one = candidates.log_densities(*(x[k : k + 1] for x in moved))
        np.testing.assert_allclose([x[:, k : k + 1] for x in together], one, rtol=1e-12)


def test_candidates_are_compared_in_data_units(candidates, moved):
    densities, mean_squares = candidates.log_densities(*moved)
    exact = np.empty(3)
    for r, duration in enumerate(candidates.durations):
        at = np.clip(np.rint(TICKS * moved[0][0] / duration).astype(int), 0, TICKS)
        units = np.tile(candidates.ranges[r], 7)
        covariance = candidates.covariances[r][at][:, :, at].reshape(14, 14) + 1e-4 * np.eye(14)
        covariance *= np.outer(units, units)
        deviation = moved[1][0].ravel() - candidates.means[r, at].ravel() * units
        exact[r] = multivariate_t(shape=covariance, df=DEGREES_OF_FREEDOM).logpdf(deviation)
        assert mean_squares[r, 0] == pytest.approx(deviation @ np.linalg.solve(covariance, deviation) / 14, rel=1e-9)
    np.testing.assert_allclose(densities[:, 0] - densities[0, 0], exact - exact[0], rtol=1e-9, atol=1e-9)
