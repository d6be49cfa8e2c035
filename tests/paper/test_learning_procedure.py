""" "Learning Probabilistic DMPs": Bayesian regression for the weights, expectation maximisation for the sensor noise R."""

from dataclasses import fields, replace

import numpy as np
import pytest
from paper import equations as paper
from reference import dense_posterior, system_at
from scipy.optimize import minimize_scalar
from strategies import PAPERS_WEIGHTS, draw_observations, make_primitive

from probdmp import ProbabilisticDMP
from probdmp.dmp import Configuration, Primitive, Task, demonstrated_tasks, linear_gaussian_model, task_for
from probdmp.dmp.transformation_system import DISCRETIZATIONS
from probdmp.execution import roll_out
from probdmp.gaussian import filter_sequence
from probdmp.learning import LearningOptions, estimate_observation_noise, fit_primitive
from probdmp.learning.forcing_targets import forcing_targets
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


@pytest.mark.parametrize("scheme", ["semi_implicit_euler", "exact"])
def test_the_regressors_are_what_is_held_over_a_step(letters, scheme):
    """Sigma_w^-1 = alpha + beta Phi^T Phi, which knows the regressors alone: the basis functions as the scheme holds them."""
    demonstrations, n_basis = letters["s"][:4], 12
    configuration = Configuration(n_basis, 25.0, scheme, "none")
    primitive, _ = fit_primitive(demonstrations, configuration, LearningOptions())
    Phi = []
    for demonstration in demonstrations:
        dt, duration = demonstration.dt, demonstration.duration

        def features(time, duration=duration):
            return np.array(paper.phi(paper.phase(time, duration), n_basis))

        ticks = range(len(demonstration.positions) - 1)
        Phi += [paper.held_input(features, t, dt) if scheme == "exact" else features(t * dt) for t in ticks]
    Phi = np.array(Phi)
    for d in range(2):
        alpha, beta = primitive.weight_precisions[d], primitive.forcing_precisions[d]
        Sigma_w = np.linalg.inv(alpha * np.eye(n_basis) + beta * Phi.T @ Phi)
        np.testing.assert_allclose(primitive.weight_covariances[d], Sigma_w, rtol=0, atol=1e-9 * np.abs(Sigma_w).max())


def test_alpha_and_beta_make_the_demonstrations_likeliest(regression):
    """The paper names alpha and beta among the parameters and not where they come from: they maximise ln N(f | 0, ...)."""
    primitive, data = regression

    for d, (Phi, f) in enumerate(data):
        alpha, beta = primitive.weight_precisions[d], primitive.forcing_precisions[d]
        # f ~ N(0, Phi Phi^T / alpha + 1 / beta): independent along the left singular vectors of Phi, and across them
        vectors, singular, _ = np.linalg.svd(Phi, full_matrices=False)
        along = vectors.T @ f
        across, n_across = f @ f - along @ along, len(f) - len(along)

        def log_evidence(alpha, beta, along=along, variances=singular**2, across=across, n_across=n_across):
            noise = n_across * paper.log_normal(0.0, 0.0, 1 / beta) - 0.5 * beta * across
            return noise + sum(paper.log_normal(a, 0.0, v / alpha + 1 / beta) for a, v in zip(along, variances, strict=True))

        best = log_evidence(alpha, beta)
        for factor in (0.9, 1.1):
            assert log_evidence(factor * alpha, beta) < best
            assert log_evidence(alpha, factor * beta) < best


@pytest.mark.parametrize("scheme", ["semi_implicit_euler", "exact"])
@pytest.mark.parametrize("duration", [0.5, 3.0])
def test_forcing_targets_make_the_movement_they_were_read_from(scheme, duration):
    """Similar to regular DMPs: f is what the equations, solved for it, say it was. A path of the scheme returns to 1e-10."""
    configuration, dt = Configuration(discretization=scheme), duration / 150
    truth = make_primitive(np.random.default_rng(1), n_basis=10, discretization=scheme)
    path = roll_out(truth, task_for(truth, duration=duration), dt)
    other_goal = path.positions[-1]  # the goal of a recording is where it ends
    targets = forcing_targets(path.positions, path.velocities, other_goal, dt, configuration)
    step = DISCRETIZATIONS[scheme].step(25.0, np.asarray(duration), np.asarray(dt))
    for d in range(2):
        state = path.means[0, d]
        for t in range(1, 151):
            state = step.transition @ state + step.input_vector * (25.0 * 25.0 / 4 * other_goal[d] + targets[t - 1, d])
            np.testing.assert_allclose(state[1:] * [duration, 1], path.means[t, d, 1:] * [duration, 1], atol=1e-10)


@pytest.mark.parametrize("scheme", ["semi_implicit_euler", "exact"])
def test_each_demonstration_has_its_own_start_goal_and_duration(scheme):
    """Given K demonstrations of the same motion primitive: one set of weights makes them all, whatever their tasks were."""
    truth, rng = make_primitive(np.random.default_rng(1), n_basis=10, discretization=scheme), np.random.default_rng(2)
    paths = []
    for duration in (0.8, 1.0, 1.4):
        start, goal = rng.uniform(-1, 1, (2, 2))
        paths.append(roll_out(truth, task_for(truth, start, goal, duration), 0.002).positions)
    learned = ProbabilisticDMP(10, discretization=scheme, smoothing=0.0, **PAPERS_WEIGHTS).fit(paths, dt=0.002)
    assert learned.fit_report_.reproduction_errors.max() < 0.02


def test_the_parameters_of_a_primitive():
    """theta_primitive = {mu_w, Sigma_w, alpha, beta, R} fully describes the representation: nothing else is learned from shape.

    Any other array of a `Primitive` belongs to the task, to the units or to the start; `variation` and `channels` are not the
    paper's.
    """
    theta = {"weight_means", "weight_covariances", "weight_precisions", "forcing_precisions", "observation_variances"}
    task = {"start", "goal", "goal_displacements", "start_velocities", "start_covariances", "ranges"}
    plain = {"configuration", "duration", "dt", "phase_step", "n_demonstrations", "names", "units", "variation", "channels"}
    assert {field.name for field in fields(Primitive)} == theta | task | plain


# --- the sensor noise by expectation maximisation ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def demonstrated():
    """A system of K = 3 demonstrations and D = 2 degrees of freedom, and what it has observed, some of it missing."""
    rng = np.random.default_rng(3)
    primitive = make_primitive(rng, 2, observation_variances=np.array([1e-3, 4e-3]))
    model = linear_gaussian_model(primitive, tasks_of(primitive, rng), 0.02, 16)
    return model, draw_observations(model, rng, missing=0.1)[..., 0]


def tasks_of(primitive, rng):
    """Three tasks as one batch."""
    starts, goals = rng.uniform(-1, 1, (2, 3, 2))
    return Task(starts, goals, np.array([0.3, 0.35, 0.4]))


def with_noise(model, variances):
    """The model with another R."""
    return replace(model, observation_covariance=np.asarray(variances)[:, None, None])


def expected_log_likelihood(posteriors, observations, R):
    """The part of E[ln p(P, S)] that depends on R: sum_k sum_t E[ln N(o_t^k | C s_t^k, R)], under the smoothed states.

    The other two terms, ln N(s_1 | 0, Q_0) and ln N(s_t | A s_{t-1} + B u_{t-1}, Q_t), do not contain R. The latter is no
    density on R^3 at all, as Q_t has rank one; it need not be evaluated.
    """
    total = 0.0
    for posterior, o in zip(posteriors, observations, strict=True):
        means, covariances = posterior.smoothed
        for t in np.flatnonzero(~np.isnan(o)):
            total += paper.log_normal(o[t], means[t, 2], R) - 0.5 * covariances[t, 2, 2] / R
    return total


def test_complete_data_log_likelihood_is_maximised_by_the_M_step(demonstrated):
    """ln p(P, S | tau, g) = sum_k sum_t ln N(o_t^k | C s_t^k, R) + ...; its expectation Q(theta, theta_old), maximised over R.

    By brute force: the states from the dense joint Gaussian of each demonstration, the maximum by numerical search.
    """
    model, observations = demonstrated
    for R_old in (np.array([1e-3, 4e-3]), np.array([1e-2, 1e-4])):
        current = with_noise(model, R_old)
        ours = maximize_observation_noise(current, observations, filter_sequence(current, observations[..., None]))
        for d in range(2):
            posteriors = [dense_posterior(system_at(current, (k, d)), observations[:, k, d, None]) for k in range(3)]
            search = minimize_scalar(
                lambda ln_R, p=posteriors, d=d: -expected_log_likelihood(p, observations[:, :, d].T, np.exp(ln_R)),
                bounds=(np.log(R_old[d]) - 8, np.log(R_old[d]) + 8),
                method="bounded",
                options={"xatol": 1e-9},
            )
            assert ours[d] == pytest.approx(np.exp(search.x), rel=1e-6)


def test_an_EM_iteration_never_lowers_the_likelihood(demonstrated):
    """EM iterates between the posterior of the hidden state and the maximum of the expected log-likelihood.

    Counted by brute force: the log density of all that was observed, under the dense joint Gaussian.
    """
    model, observations = demonstrated
    R, before = np.array([1e-1, 1e-5]), np.full(2, -np.inf)
    for _ in range(6):
        current = with_noise(model, R)
        after = np.array(
            [
                sum(dense_posterior(system_at(current, (k, d)), observations[:, k, d, None]).log_likelihood for k in range(3))
                for d in range(2)
            ]
        )
        assert np.all(after >= before - 1e-9 * np.abs(after))
        R = maximize_observation_noise(current, observations, filter_sequence(current, observations[..., None]))
        before = after


def test_EM_ends_where_the_likelihood_is_largest(demonstrated):
    """The updates for R can be derived by setting the derivative to 0: at the end that of the log-likelihood itself is 0."""
    model, observations = demonstrated
    guesses = [np.array([1e-1, 1e-1])]
    found = estimate_observation_noise(model, observations, guesses, floor=np.full(2, 1e-12), tolerance=1e-4)
    assert found.converged

    def log_likelihood(R):
        return filter_sequence(with_noise(model, R), observations[..., None]).log_likelihoods.sum()

    best = log_likelihood(found.variances)
    for factors in ([0.97, 1], [1.03, 1], [1, 0.97], [1, 1.03]):
        assert log_likelihood(found.variances * factors) < best


@pytest.mark.parametrize("forcing_noise", ["predictive", "posterior"])
@pytest.mark.parametrize("configuration", ["published", "default"])
def test_EM_never_lowers_the_likelihood_while_learning(letters, configuration, forcing_noise):
    """As learned from recordings: the log-likelihood of the demonstrations at each iteration, and it converges."""
    learned = ProbabilisticDMP(forcing_noise=forcing_noise, **PAPERS_WEIGHTS)
    if configuration == "published":
        learned = ProbabilisticDMP.as_published(forcing_noise=forcing_noise)
    noise = learned.fit(letters["s"][:10]).fit_report_.observation_noise
    history = noise.log_likelihoods
    assert np.all(np.diff(history) >= -1e-9 * np.abs(history[1:]))
    assert noise.converged
    np.testing.assert_array_equal(noise.variances, learned.primitive_.observation_variances)


def test_the_commanded_start_is_no_measurement(letters):
    """Ours: R is the likeliest for samples 1 .. T - 1. Sample 0 is the start that is commanded, so it is no evidence on noise.

    By brute force: Algorithm 2 in plain loops, the maximum over R by numerical search. Coarse recordings, so that one sample
    of each counts; with it R would be smaller.
    """
    coarse = [replace(d, positions=d.positions[::8], dt=8 * d.dt) for d in letters["s"][:5]]
    configuration = Configuration(n_basis=5, forcing_noise="posterior")
    primitive, _ = fit_primitive(coarse, configuration, LearningOptions())
    for d in range(2):

        def likeliest(first, d=d):
            def loss(ln_R):
                total = 0.0
                for demonstration in coarse:
                    p, dt, duration = demonstration.positions[:, d], demonstration.dt, demonstration.duration
                    model = paper.system(primitive, d, p[0], p[-1], duration, dt, len(p))
                    total -= paper.algorithm_2(model._replace(R=np.exp(ln_R)), p).log_likelihoods[first:].sum()
                return total

            guess = np.log(primitive.observation_variances[d])
            return np.exp(minimize_scalar(loss, bounds=(guess - 2, guess + 2), method="bounded", options={"xatol": 1e-6}).x)

        R, with_the_start = likeliest(1), likeliest(0)
        assert primitive.observation_variances[d] == pytest.approx(R, rel=2e-3)
        assert with_the_start < 0.95 * R


def test_R_is_recovered_from_demonstrations_of_the_model():
    """What EM is for: the noise that a sensor was simulated with, to 5 % from 200 demonstrations."""
    rng = np.random.default_rng(4)
    truth = np.array([1e-3, 4e-3])
    primitive = make_primitive(rng, 2, observation_variances=truth)
    task = task_for(primitive)
    tasks = Task(np.tile(task.start, (200, 1)), np.tile(task.goal, (200, 1)), np.full(200, float(task.duration)))
    model = linear_gaussian_model(primitive, tasks, primitive.duration / 30, 31)
    observations = draw_observations(model, rng)[..., 0]
    found = estimate_observation_noise(model, observations, [np.full(2, 1e-1)], floor=np.full(2, 1e-12))
    np.testing.assert_allclose(found.variances, truth, rtol=0.05)
