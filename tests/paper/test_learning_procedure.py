""" "Learning Probabilistic DMPs": Bayesian regression for the weights, expectation maximisation for the sensor noise R."""

from dataclasses import fields, replace

import numpy as np
import pytest
from paper import equations as paper
from reference import dense_posterior, system_at
from scipy.optimize import minimize_scalar
from strategies import draw_observations, dmp_system, make_primitive

from probdmp import ProbabilisticDMP
from probdmp.dmp import Configuration, Primitive, demonstrated_tasks, linear_gaussian_model, task_for
from probdmp.execution import roll_out
from probdmp.gaussian import filter_sequence
from probdmp.learning import LearningOptions, estimate_observation_noise, fit_primitive
from probdmp.learning.observation_noise import maximize_observation_noise


# --- the forcing term by Bayesian regression --------------------------------------------------------------------------


def regression_of(demonstrations, d, amplitudes, n_basis, alpha_z=25.0):
    """Phi, f: regressors s phi and targets s f of all demonstrations, by solving the three reduced equations for s f."""
    rows, targets = [], []
    for demonstration, s in zip(demonstrations, amplitudes, strict=True):
        p, dt, duration = demonstration.positions[:, d], demonstration.dt, demonstration.duration
        p_dot = np.diff(p) / dt  # p_t = p'_t dt + p_{t-1}
        p_dot = np.concatenate([[2 * p_dot[0] - p_dot[1]], p_dot])  # none before the first: extrapolated
        for t in range(1, len(p)):
            p_dot_dot = (p_dot[t] - p_dot[t - 1]) / dt  # p'_t = p''_t dt + p'_{t-1}
            targets.append(duration**2 * p_dot_dot - alpha_z * (alpha_z / 4 * (p[-1] - p[t - 1]) - duration * p_dot[t - 1]))
            rows.append([s * value for value in paper.phi(paper.phase((t - 1) * dt, duration), n_basis)])
    return np.array(rows), np.array(targets)


@pytest.fixture(scope="module")
def regression(letters):
    """A primitive learned from raw positions, and the regression it should be: Phi and f by degree of freedom."""
    demonstrations = letters["s"][:4]
    configuration = Configuration(12, 25.0, "semi_implicit_euler", "paper")
    primitive, _ = fit_primitive(demonstrations, configuration, LearningOptions(smoothing=0.0))
    amplitudes = primitive.amplitudes(demonstrated_tasks(demonstrations))
    assert np.ptp(amplitudes) > 0  # the demonstrations differ in s
    return primitive, [regression_of(demonstrations, d, amplitudes[:, d], 12) for d in range(2)]


def test_weights_are_the_posterior_of_a_bayesian_regression(regression):
    """The distribution over the non-linear function term f via Bayesian regression: Sigma_w, mu_w from the joint Gaussian.

    w ~ N(0, 1/alpha), f = Phi w + e, e ~ N(0, 1/beta); (w, f) is Gaussian, and is conditioned on f by brute force.
    """
    primitive, data = regression
    for d, (Phi, f) in enumerate(data):
        alpha, beta = primitive.weight_precisions[d], primitive.forcing_precisions[d]
        covariance_of_f = Phi @ Phi.T / alpha + np.eye(len(f)) / beta
        gain = np.linalg.solve(covariance_of_f, Phi / alpha).T
        mu_w, Sigma_w = gain @ f, np.eye(12) / alpha - gain @ Phi / alpha
        np.testing.assert_allclose(primitive.weight_means[d], mu_w, rtol=0, atol=1e-6 * np.abs(mu_w).max())
        np.testing.assert_allclose(primitive.weight_covariances[d], Sigma_w, rtol=0, atol=1e-6 * np.abs(Sigma_w).max())


def test_alpha_and_beta_make_the_demonstrations_likeliest(regression):
    """The paper names alpha and beta among the parameters and not where they come from: they maximise ln N(f | 0, ...)."""
    primitive, data = regression

    def log_evidence(Phi, f, alpha, beta):
        covariance = Phi @ Phi.T / alpha + np.eye(len(f)) / beta
        return -0.5 * (f @ np.linalg.solve(covariance, f) + np.linalg.slogdet(2 * np.pi * covariance)[1])

    for d, (Phi, f) in enumerate(data):
        alpha, beta = primitive.weight_precisions[d], primitive.forcing_precisions[d]
        best = log_evidence(Phi, f, alpha, beta)
        for factor in (0.9, 1.1):
            assert log_evidence(Phi, f, factor * alpha, beta) < best
            assert log_evidence(Phi, f, alpha, factor * beta) < best


@pytest.mark.parametrize("scheme", ["semi_implicit_euler", "exact"])
def test_each_demonstration_has_its_own_start_goal_and_duration(scheme):
    """K demonstrations of the same primitive: made by one set of weights for different tasks, they give back these weights' paths."""
    truth = make_primitive(np.random.default_rng(1), n_basis=10, discretization=scheme, duration=1.0)
    rng, tasks, paths = np.random.default_rng(2), [], []
    for _ in range(3):
        start, goal = rng.uniform(-1, 1, (2, 2))
        tasks.append(task_for(truth, start, goal, float(rng.choice([0.8, 1.0, 1.4]))))
        paths.append(roll_out(truth, tasks[-1], 0.002))
    unforced = ProbabilisticDMP(10, discretization=scheme, smoothing=0.0).fit([path.positions for path in paths], dt=0.002)
    for task, path in zip(tasks, paths, strict=True):
        velocity = path.velocities[0]
        goal = path.positions[-1]
        own = roll_out(unforced.primitive_, task_for(unforced.primitive_, task.start, goal, float(task.duration), velocity), 0.002)
        assert np.abs(own.positions - path.positions).max() < 0.1
