"""The movement as planned, and draws from it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_primitive, primitives, seeds

from probdmp.demonstrations import synthetic_letters
from probdmp.dmp import Configuration, linear_gaussian_model, stack_tasks, step_count, task_for
from probdmp.execution import position_covariances, roll_out, sample_trajectories
from probdmp.gaussian import filter_sequence
from probdmp.learning import LearningOptions, fit_primitive

N_DRAWS = 4000


@settings(max_examples=20)
@given(primitives(), st.floats(0.6, 3), st.sampled_from([0.01, 0.02, 0.037]))
def test_rollout_is_the_filter_with_nothing_observed(primitive, duration, dt):
    task = task_for(primitive, duration=duration)
    rolled = roll_out(primitive, task, dt)
    n_steps = step_count(duration, dt)
    nothing = np.full((n_steps, 1, primitive.n_dof, 1), np.nan)
    model = linear_gaussian_model(primitive, stack_tasks([task]), np.array([dt]), n_steps)  # a batch of one
    wanted = filter_sequence(model, nothing).filtered
    np.testing.assert_array_equal(rolled.means, wanted.means[:, 0])
    np.testing.assert_array_equal(rolled.covariances, wanted.covariances[:, 0])
    np.testing.assert_allclose(rolled.times, np.arange(n_steps) * dt, rtol=1e-15)
    assert (rolled.names, rolled.units) == (primitive.names, primitive.units)


@settings(max_examples=20)
@given(seeds)
def test_it_begins_at_the_start_and_ends_near_the_goal(seed):
    rng = np.random.default_rng(seed)
    primitive = make_primitive(rng, weight_means=np.zeros((2, 8)))
    start, goal = rng.uniform(-2, 2, (2, 2))
    rolled = roll_out(primitive, task_for(primitive, start, goal), primitive.duration / 100)
    np.testing.assert_allclose(rolled.positions[0], start, rtol=1e-12)
    np.testing.assert_array_equal(rolled.position_stds[0], 0)
    np.testing.assert_allclose(rolled.positions[-1], goal, atol=1e-3)


@pytest.fixture(scope="module", params=["exact", "semi_implicit_euler"])
def drawn(request):
    """A rollout, draws of positions (n, T, D) from it, and draws as a sensor sees them."""
    rng = np.random.default_rng(0)
    primitive = make_primitive(rng, 2, 6, discretization=request.param, duration=0.8)
    task, dt = task_for(primitive, [np.nan, np.nan], duration=1.0), 0.02  # from a start that is drawn too
    draws = [np.stack(sample_trajectories(primitive, task, dt, N_DRAWS, rng, noisy)) for noisy in (False, True)]
    return primitive, roll_out(primitive, task, dt), *draws


def test_bands_cover_95_percent_of_the_draws(drawn):
    primitive, rolled, positions, seen = drawn
    inside = np.abs(positions - rolled.positions) <= 1.96 * rolled.position_stds
    assert np.mean(inside) == pytest.approx(0.95, abs=0.01)
    spread = np.sqrt(rolled.position_stds**2 + primitive.observation_variances)
    assert np.mean(np.abs(seen - rolled.positions) <= 1.96 * spread) == pytest.approx(0.95, abs=0.01)


def test_draws_have_the_moments_of_the_rollout(drawn):
    primitive, rolled, positions, seen = drawn
    for draws, variances in (
        (positions, rolled.position_stds**2),
        (seen, rolled.position_stds**2 + primitive.observation_variances),
    ):
        errors = (draws.mean(axis=0) - rolled.positions) / np.sqrt(variances / N_DRAWS)
        assert np.abs(errors).max() < 5
        np.testing.assert_allclose(draws.var(axis=0), variances, rtol=6 * np.sqrt(2 / N_DRAWS))


def test_draws_of_different_degrees_of_freedom_are_independent(drawn):
    positions = drawn[2][:, -1]
    assert abs(np.corrcoef(positions.T)[0, 1]) < 5 / np.sqrt(N_DRAWS)


def test_sensor_noise_is_white_and_as_learned(drawn):
    primitive = drawn[0]
    rng = np.random.default_rng(1)
    task = task_for(primitive)
    clean = np.stack(sample_trajectories(primitive, task, 0.02, 50, np.random.default_rng(1), False))
    noisy = np.stack(sample_trajectories(primitive, task, 0.02, 50, rng, True))
    noise = noisy - clean
    np.testing.assert_allclose(noise.var(axis=(0, 1)), primitive.observation_variances, rtol=0.1)
    assert abs(np.mean(noise[:, 1:] * noise[:, :-1])) < 0.05 * noise.var()


def test_the_same_seed_gives_the_same_draws():
    primitive = make_primitive(np.random.default_rng(0))
    one, same, other = (
        sample_trajectories(primitive, task_for(primitive), 0.02, 2, np.random.default_rng(seed), True) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one, same)
    assert np.any(one[0] != other[0])
    assert np.any(one[0] != one[1])


def test_draws_are_as_long_as_the_rollout():
    primitive = make_primitive(np.random.default_rng(0))
    for duration, dt in ((1.0, 0.01), (0.5, 0.03)):
        task = task_for(primitive, duration=duration)
        (draw,) = sample_trajectories(primitive, task, dt, 1, np.random.default_rng(0), True)
        assert draw.shape == roll_out(primitive, task, dt).positions.shape == (step_count(duration, dt), 2)


@pytest.mark.parametrize("uncertainty", ["joint", "independent"])
def test_covariances_of_positions_have_the_variances_of_the_rollout(uncertainty):
    primitive = learned(uncertainty)
    task = task_for(primitive, duration=1.5)
    covariances = position_covariances(primitive, task, 0.02)
    planned = roll_out(primitive, task, 0.02)
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    np.testing.assert_allclose(variances, planned.position_stds**2, atol=1e-9 * primitive.ranges.max() ** 2)
    assert np.all(np.linalg.eigvalsh(covariances) >= -1e-9)
    assert np.any(np.abs(covariances[:, 0, 1]) > 1e-3) == (uncertainty == "joint")


def test_covariances_of_positions_are_those_of_samples():
    primitive = learned("joint")
    task = task_for(primitive)
    paths = np.array(sample_trajectories(primitive, task, 0.05, 4000, np.random.default_rng(0), sensor_noise=False))
    expected = position_covariances(primitive, task, 0.05)
    for t in (5, 15, paths.shape[1] - 1):
        scale = np.sqrt(np.outer(*[np.diag(expected[t])] * 2))
        np.testing.assert_allclose(np.cov(paths[:, t].T) / scale, expected[t] / scale, atol=0.08)


def learned(uncertainty):
    letters = synthetic_letters(6, seed=1, letters="a", dt=0.02)
    return fit_primitive(letters, Configuration(n_basis=8, weight_uncertainty=uncertainty), LearningOptions("hierarchical"))[0]
