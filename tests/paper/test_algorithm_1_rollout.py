"""Algorithm 1, "Probabilistic DMP: rollout"."""

import numpy as np
import pytest
from paper import equations as paper
from reference import dense_posterior, integrate_dmp, system_at
from strategies import make_primitive

from probdmp.dmp import linear_gaussian_model, task_for
from probdmp.execution import roll_out

DURATIONS = (0.25, 1.0, 4.0)
"""Times the learned duration."""
MOVES = ((0.0, 0.0), (-5.0, 3.0), (40.0, -25.0))
"""What is added to start and goal, millimetres."""


@pytest.mark.parametrize("slower", DURATIONS)
@pytest.mark.parametrize(("start_moves", "goal_moves"), MOVES)
def test_algorithm_1_line_by_line_is_rollout(learned, slower, start_moves, goal_moves):
    """for t = 1 .. T:  mu_p,t = A mu_p,t-1 + B u_{t-1},  V_p,t = A V_p,t-1 A^T + Q_{t-1}.

    Printed with mu_u and V_u, which nothing updates in a rollout, and with a Q that does not depend on t.
    """
    primitive = learned.primitive_
    start, goal = primitive.start + start_moves, primitive.goal + goal_moves
    duration, dt = slower * primitive.duration, slower * 0.012
    rolled = learned.rollout(start=start, goal=goal, duration=duration, dt=dt)
    for d in range(primitive.n_dof):
        model = paper.system(primitive, d, start[d], goal[d], duration, dt, len(rolled.times))
        mu, V = paper.algorithm_1(model)
        np.testing.assert_allclose(rolled.means[:, d], mu, rtol=0, atol=1e-10 * np.abs(mu).max())
        units = np.sqrt(V[:, [0, 1, 2], [0, 1, 2]].max(axis=0))
        np.testing.assert_allclose(rolled.covariances[:, d] / np.outer(units, units), V / np.outer(units, units), atol=1e-10)


@pytest.mark.parametrize("slower", DURATIONS)
@pytest.mark.parametrize(("start_moves", "goal_moves"), MOVES)
def test_rollout_is_exactly_the_trajectory_of_a_standard_dmp(published, slower, start_moves, goal_moves):
    """ "This will generate exactly the same desired trajectory as a standard DMP, including uncertainty estimates."

    Positions, velocities and accelerations to 1e-10 of their size, against a classical integration of the scalar equations.
    """
    primitive = published.primitive_
    start, goal = primitive.start + start_moves, primitive.goal + goal_moves
    duration, dt = slower * primitive.duration, slower * 0.012
    rolled = published.rollout(start=start, goal=goal, duration=duration, dt=dt)
    for d in range(primitive.n_dof):
        standard = integrate_dmp(
            primitive.weight_means[d],
            start[d],
            goal[d],
            duration,
            dt,
            len(rolled.times),
            primitive.configuration.alpha_z,
            primitive.start_velocities[d] / duration,
            amplitude=(goal[d] - start[d]) / primitive.goal_displacements[d],
        )
        for ours, theirs in zip((rolled.positions, rolled.velocities, rolled.accelerations), standard, strict=True):
            np.testing.assert_allclose(ours[:, d], theirs, rtol=0, atol=1e-10 * np.abs(theirs).max())
    assert np.all(rolled.position_stds[1:] > 0)
    assert np.all(rolled.velocity_stds > 0)
    assert np.all(rolled.acceleration_stds > 0)


@pytest.mark.parametrize("scheme", ["semi_implicit_euler", "exact"])
def test_rollout_gives_the_distribution_of_the_model(scheme):
    """Uncertainty estimates: mean and covariance of every state, by the dense joint Gaussian of all states."""
    primitive = make_primitive(np.random.default_rng(1), discretization=scheme, scaling="paper")
    task = task_for(primitive, goal=primitive.goal + np.array([0.5, -0.5]))
    dt = primitive.duration / 30
    rolled, model = roll_out(primitive, task, dt), linear_gaussian_model(primitive, task, dt, 31)
    for d in range(2):
        means, covariances = dense_posterior(system_at(model, (d,)), np.full((31, 1), np.nan)).prior
        np.testing.assert_allclose(rolled.means[:, d], means, rtol=1e-9, atol=1e-9 * np.abs(means).max())
        np.testing.assert_allclose(rolled.covariances[:, d], covariances, rtol=1e-9, atol=1e-9 * np.abs(covariances).max())


def test_rollout_begins_at_the_start_that_is_asked_for(learned):
    """Initialising with the task parameters (goal, start and duration): the start is certain, the goal attracts."""
    rolled = learned.rollout(start=[3.0, -4.0])
    np.testing.assert_array_equal(rolled.positions[0], [3.0, -4.0])
    np.testing.assert_array_equal(rolled.position_stds[0], 0.0)
    assert rolled.times[-1] == pytest.approx(learned.primitive_.duration, abs=learned.primitive_.dt / 2)


def test_a_start_that_is_not_known_is_as_learned(learned, letters):
    """Q_0: the mean start of the demonstrations with their variance, by degree of freedom; a start that is given has none."""
    starts = np.array([d.positions[0] for d in letters["a"][:10]])
    rolled = learned.rollout(start=[np.nan, -4.0])
    np.testing.assert_allclose(rolled.positions[0], [starts[:, 0].mean(), -4.0], rtol=1e-12)
    np.testing.assert_allclose(rolled.position_stds[0], [starts[:, 0].std(ddof=1), 0.0], rtol=1e-12)
    np.testing.assert_array_equal(learned.rollout().position_stds[0], 0.0)  # planned from the mean start
    primitive = learned.primitive_
    for d, start in enumerate([np.nan, -4.0]):
        mu, V = paper.algorithm_1(
            paper.system(primitive, d, start, primitive.goal[d], primitive.duration, rolled.times[1], len(rolled.times))
        )
        np.testing.assert_allclose(rolled.means[:, d], mu, rtol=0, atol=1e-10 * np.abs(mu).max())
        units = np.sqrt(V[:, [0, 1, 2], [0, 1, 2]].max(axis=0))
        np.testing.assert_allclose(rolled.covariances[:, d] / np.outer(units, units), V / np.outer(units, units), atol=1e-10)


def test_rollout_is_a_full_desired_trajectory(published):
    """ "A rollout of the hidden states produces desired accelerations, velocities and positions" that belong together:
    p'_t = p''_t dt + p'_{t-1},  p_t = p'_t dt + p_{t-1}."""
    rolled = published.rollout(dt=0.01)
    p, v, a = rolled.positions, rolled.velocities, rolled.accelerations
    np.testing.assert_allclose(v[1:], a[1:] * 0.01 + v[:-1], atol=1e-9)
    np.testing.assert_allclose(p[1:], v[1:] * 0.01 + p[:-1], atol=1e-9)


def test_variability_depends_on_the_phase(published):
    """ "Phase-dependent variability": no band at the start, and no constant band after it."""
    primitive = published.primitive_
    rolled = roll_out(primitive, task_for(primitive), primitive.duration / 100)
    stds = rolled.position_stds
    assert np.all(stds[0] == 0)
    assert np.all(stds.max(axis=0) > 1e-3 * primitive.ranges)
    assert np.all(np.ptp(rolled.velocity_stds[1:], axis=0) > 0.05 * rolled.velocity_stds.max(axis=0))
