"""The variation between demonstrations: symmetries, extremes, and a population that is known."""

from dataclasses import replace

import numpy as np
import pytest

from probdmp.demonstrations import Demonstration, synthetic_letters
from probdmp.dmp import Configuration, path_distribution, task_for
from probdmp.dmp.responses import GOAL, parameter_responses
from probdmp.errors import InputError
from probdmp.execution import roll_out
from probdmp.learning import LearningOptions, fit_primitive
from probdmp.learning.hierarchical import GOAL_TOLERANCE, estimate_variation

SMALL = Configuration(n_basis=10)
OPTIONS = LearningOptions(weight_model="hierarchical")


def learn(demonstrations, configuration=SMALL):
    return fit_primitive(demonstrations, configuration, OPTIONS)[0]


@pytest.fixture(scope="module")
def letters():
    return synthetic_letters(6, letters="s", dt=0.02)


@pytest.fixture(scope="module")
def learned(letters):
    return learn(letters)


def assert_alike(one, other, unit=1.0, rtol=1e-6):
    """`other` is `one` in a unit of length that is `unit` times smaller for each degree of freedom."""
    unit = np.broadcast_to(unit, (one.n_dof,))
    for a, b in zip(path_distribution(one, 40), path_distribution(other, 40), strict=True):
        scale = unit if a.ndim == 2 else unit[:, None, None] * unit
        np.testing.assert_allclose(b / scale, a, rtol=rtol, atol=rtol * np.abs(a).max())
    np.testing.assert_allclose(other.variation.residual_variances / unit**2, one.variation.residual_variances, rtol=1e-3)


# --- symmetries -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", [1e3, 1e-6, np.array([1e3, 1e-4])])
def test_units_scale_the_variation(letters, learned, unit):
    assert_alike(learned, learn([replace(d, positions=d.positions * unit) for d in letters]), unit)


def test_permuted_degrees_of_freedom_permute_the_variation(letters, learned):
    other = learn([replace(d, positions=d.positions[:, ::-1], names=("y", "x")) for d in letters])
    mean, covariance = path_distribution(other, 40)
    np.testing.assert_allclose(mean[:, ::-1], path_distribution(learned, 40).means, atol=1e-6)
    np.testing.assert_allclose(covariance[:, ::-1, :, ::-1], path_distribution(learned, 40).covariance, atol=1e-6)


def test_neither_clock_nor_order_nor_origin_matters(letters, learned):
    assert_alike(learned, learn([replace(d, dt=d.dt * 3) for d in letters]))
    assert_alike(learned, learn(letters[::-1]))
    assert_alike(learned, learn([replace(d, positions=d.positions + 1000) for d in letters]))


# --- what it must learn -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", ["exact", "semi_implicit_euler"])
def test_a_population_is_recovered(scheme):
    """Many movements drawn from a Gaussian over theta: mean and covariance of their paths come back."""
    rng, n, m = np.random.default_rng(0), 8, 60
    responses = parameter_responses(Configuration(n_basis=6, discretization=scheme), 1 / (m - 1), m)[:, 2]
    mean = rng.standard_normal((2, n)) * [1, 1, *[100] * 6]
    factor = rng.standard_normal((2 * n, 3)) * np.tile([0.3, 0.3, *[30] * 6], 2)[:, None]
    theta = mean + (rng.standard_normal((400, 3)) @ factor.T).reshape(-1, 2, n)
    paths = np.einsum("mn,kdn->kmd", responses, theta) + 1e-3 * rng.standard_normal((400, m, 2)) * (np.arange(m) > 0)[:, None]
    ranges = np.ptp(paths, axis=1).mean(axis=0)
    found = estimate_variation(responses, paths, ranges)
    stds = paths.std(axis=0, ddof=1)
    theta_rows = np.column_stack([np.ones(m), responses])  # of the parameters, of which the start is the first
    assert np.abs(theta_rows @ found.means.T - paths.mean(axis=0)).max() < 0.02 * stds.max()
    both = np.kron(np.eye(2), theta_rows)
    got, wanted = both @ found.covariance @ both.T, np.cov(paths.transpose(0, 2, 1).reshape(400, -1), rowvar=False)
    prior = got - 0.5 * wanted  # the other half, of the same size along the path as a whole
    assert np.linalg.eigvalsh(prior)[0] > -0.02 * np.trace(got)
    np.testing.assert_allclose(np.trace(got), np.trace(wanted), rtol=0.2)
    np.testing.assert_array_equal(found.means[:, 0], 0)  # movements are seen from their start
    np.testing.assert_allclose(found.residuals, 1e-6, rtol=0.3, atol=(1.2e-4 * ranges.max()) ** 2)


def test_the_goal_is_where_demonstrations_end(letters, learned):
    ends = np.array([d.positions[-1] - d.positions[0] for d in letters])
    np.testing.assert_allclose(
        learned.variation.means[:, GOAL], ends.mean(axis=0), atol=10 * GOAL_TOLERANCE * learned.ranges.max()
    )
    np.testing.assert_allclose(learned.goal, np.mean([d.positions[-1] for d in letters], axis=0), atol=1e-2)


def test_the_rollout_is_the_mean_path(learned):
    n = 50
    rolled = roll_out(learned, task_for(learned), learned.duration / (n - 1))
    np.testing.assert_allclose(rolled.positions - learned.start, path_distribution(learned, n).means, atol=1e-10)


def test_the_variation_does_not_vanish_with_more_data():
    few, many = (learn(synthetic_letters(k, letters="s", dt=0.02)) for k in (5, 40))
    one, other = (np.sqrt(np.einsum("mdmd->md", path_distribution(p, 40).covariance).mean()) for p in (few, many))
    assert 0.6 < other / one < 1.6


def test_bands_hold_what_they_should(letters, learned):
    """New executions of the built-in letters, point by point."""
    fresh = synthetic_letters(30, letters="s", dt=0.02, seed=7)
    mean, covariance = path_distribution(learned, 60)
    stds = np.sqrt(np.einsum("mdmd->md", covariance) + learned.observation_variances)
    phases = np.linspace(0, 1, 60)
    paths = np.stack([np.column_stack([np.interp(phases, np.linspace(0, 1, len(c)), c) for c in d.positions.T]) for d in fresh])
    inside = np.abs(paths - paths[:, :1] - mean)[:, 1:] < 1.96 * stds[1:]
    assert 0.88 < inside.mean() <= 1


# --- extremes ---------------------------------------------------------------------------------------------------------


def test_one_demonstration_has_the_prior_alone(letters):
    primitive = learn(letters[:1])
    stds = np.sqrt(np.einsum("mdmd->md", path_distribution(primitive, 60).covariance))
    assert np.all((stds.max(axis=0) > 0.05 * primitive.ranges) & (stds.max(axis=0) < 0.5 * primitive.ranges))


@pytest.mark.parametrize("positions", [[np.full((40, 2), 0.3)], [np.zeros((40, 2))] * 3, [np.arange(6.0).reshape(3, 2)] * 2])
def test_demonstrations_without_variation_or_movement(positions):
    primitive = learn([Demonstration(p, 0.01) for p in positions], Configuration())
    assert np.isfinite(path_distribution(primitive, 50).covariance).all()
    np.testing.assert_allclose(path_distribution(primitive, 3).means[-1], positions[0][-1] - positions[0][0], atol=0.05)


def test_two_demonstrations_keep_their_variation_finite(letters):
    primitive = learn(letters[:2], Configuration())
    assert np.einsum("mdmd->md", path_distribution(primitive, 40).covariance).max() < (2 * primitive.ranges.max()) ** 2


def test_paper_scaling_is_refused_in_words(letters):
    with pytest.raises(InputError, match=r'scaling="none" with weight_model="hierarchical", got scaling="paper"'):
        learn(letters, Configuration(scaling="paper"))
    with pytest.raises(InputError, match=r'scaling="none" with weight_uncertainty="joint"'):
        Configuration(scaling="paper", weight_uncertainty="joint")
