"""Algorithm 2, "Probabilistic DMP: executing and tracking a reference signal" (ExecuteAndMonitor), and what follows from it."""

from dataclasses import replace

import numpy as np
import pytest
from paper import equations as paper
from reference import dense_posterior, system_at
from strategies import PAPERS_WEIGHTS, draw_observations, make_primitive

from probdmp import ProbabilisticDMP
from probdmp.dmp import linear_gaussian_model, task_for
from probdmp.execution import OnlineExecution
from probdmp.gaussian import filter_sequence


@pytest.fixture(scope="module")
def recording(letters):
    """An execution that did not train the primitives."""
    return letters["a"][12]


@pytest.fixture(scope="module")
def goal(recording):
    """Where it was told to go."""
    return recording.positions[-1] + [1.0, -1.0]


def typed(primitive, recording, goal):
    """Algorithm 2 as printed, by degree of freedom, with the systems it ran on."""
    for d in range(primitive.n_dof):
        observed = recording.positions[:, d]
        model = paper.system(primitive, d, observed[0], goal[d], recording.duration, recording.dt, len(observed) + 1)
        yield d, model, paper.algorithm_2(model, observed)


def assert_close(ours, theirs, rtol=1e-9):
    """Relative to the largest value of each component."""
    size = np.abs(theirs).max(axis=0)
    np.testing.assert_allclose(ours / np.where(size, size, 1), theirs / np.where(size, size, 1), rtol=0, atol=rtol)


def test_algorithm_2_line_by_line_is_track(learned, recording, goal):
    """S = C V_p C^T + R;  K = V_p C^T S^-1;  mu_u = mu_p + K (o_t - C mu_p);  V_u = V_p - K C V_p;  return loglik."""
    tracked = learned.track(recording, goal=goal)
    log_likelihood = 0.0
    for d, _, run in typed(learned.primitive_, recording, goal):
        assert_close(tracked.means[:, d], run.mu_u)
        assert_close(tracked.covariances[:, d], run.V_u)
        assert_close(tracked.innovation_variances[:, d], run.S)
        assert_close(tracked.innovations[:, d], recording.positions[:, d] - run.mu_p[:, 2])
        assert_close(tracked.contributions[:, d], run.log_likelihoods)
        log_likelihood += run.log_likelihoods.sum()
    assert tracked.log_likelihoods.sum() == pytest.approx(log_likelihood, rel=1e-9)
    scores = learned.score_samples([recording], tasks=[task_of(learned, recording, goal)])
    assert scores[0] == pytest.approx(log_likelihood, rel=1e-9)


def task_of(learned, recording, goal):
    """The task of `typed`."""
    return task_for(learned.primitive_, recording.positions[0], goal, recording.duration)


def test_algorithm_2_line_by_line_is_online_execution(learned, recording, goal):
    """One `step` is lines 5 to 8 for what is measured now and lines 3 and 4 for the next tick, the controller's aim."""
    execution = learned.execute(start=recording.positions[0], goal=goal, duration=recording.duration, dt=recording.dt)
    steps = [execution.step(o) for o in recording.positions]
    for d, model, run in typed(learned.primitive_, recording, goal):
        desired = np.array([[s.acceleration[d], s.velocity[d], s.position[d]] for s in steps])
        last = model.A @ run.mu_u[-1] + model.B * model.u[-1]
        assert_close(desired, np.vstack([run.mu_p[1:], last]))
        last = model.A @ run.V_u[-1] @ model.A.T + model.Q[-1]
        assert_close(np.array([s.covariance[d] for s in steps]), np.concatenate([run.V_p[1:], last[None]]))
        assert_close(np.array([s.contributions[d] for s in steps]), run.log_likelihoods)
        assert_close(np.array([s.innovations[d] for s in steps]), recording.positions[:, d] - run.mu_p[:, 2])


def test_the_likelihood_of_a_step_is_that_of_the_prediction(default, recording, goal):
    """Algorithm 2 returns loglik and does not say of what. It is ln N(o_t | C mu_p,t, S): its sum is ln p(o_1 .. o_T)."""
    short = replace(recording, positions=recording.positions[:25])
    tracked = default.track(short, goal=goal, duration=recording.duration)
    model = linear_gaussian_model(default.primitive_, task_of(default, recording, goal), recording.dt, 25)
    joint = sum(dense_posterior(system_at(model, (d,)), short.positions[:, d, None]).log_likelihood for d in range(2))
    assert tracked.log_likelihoods.sum() == pytest.approx(joint, rel=1e-9)


@pytest.mark.parametrize("scheme", ["semi_implicit_euler", "exact"])
def test_kalman_filtering_and_smoothing_are_inference(scheme):
    """ "Kalman filtering and smoothing are directly applicable": both agree with conditioning the dense joint Gaussian."""
    rng = np.random.default_rng(1)
    estimator = ProbabilisticDMP(discretization=scheme, **PAPERS_WEIGHTS)
    estimator.primitive_ = make_primitive(rng, discretization=scheme)
    task, dt = task_for(estimator.primitive_), estimator.primitive_.duration / 24
    model = linear_gaussian_model(estimator.primitive_, task, dt, 25)
    observations = draw_observations(model, rng, missing=0.2)[..., 0]
    arguments = {"dt": dt, "start": task.start, "duration": float(task.duration)}
    for name, ours in (
        ("filtered", estimator.track(observations, **arguments)),
        ("smoothed", estimator.smooth(observations, **arguments)),
    ):
        for d in range(2):
            means, covariances = getattr(dense_posterior(system_at(model, (d,)), observations[:, d, None], digits=40), name)
            assert_close(ours.means[:, d], means)
            assert_close(ours.covariances[:, d].reshape(25, 9), covariances.reshape(25, 9))


# --- the feedback term ------------------------------------------------------------------------------------------------


def test_the_feedback_term_appears_by_itself(learned, recording, goal):
    """mu_{p,t+1} = A (mu_p,t + K (o_t - h(s_t))) + B u_t = A mu_p,t + B u_t + A K (o_t - h(s_t))."""
    execution = learned.execute(start=recording.positions[0], goal=goal, duration=recording.duration, dt=recording.dt)
    steps = [execution.step(o) for o in recording.positions]
    for d, model, run in typed(learned.primitive_, recording, goal):
        desired = np.array([[s.acceleration[d], s.velocity[d], s.position[d]] for s in steps])
        feedforward = run.mu_p @ model.A.T + model.B * model.u[:, None]
        innovations = np.array([s.innovations[d] for s in steps])
        feedback = (run.K * innovations[:, None]) @ model.A.T
        assert_close(desired, feedforward + feedback)
        assert np.abs(feedback[:, 2]).max() > 1e-3 * learned.primitive_.ranges[d]  # it is not nothing


@pytest.mark.parametrize("known", [True, False], ids=["start-known", "start-unknown"])
def test_without_feedback_execution_is_the_rollout(learned, known):
    """Instead of inference, simply forward predicting the hidden state: no observation, no feedback term."""
    rolled = learned.rollout() if known else learned.rollout(start=[np.nan, np.nan])
    execution = learned.execute(start=learned.primitive_.start) if known else learned.execute()
    steps = [execution.step() for _ in rolled.times[1:]]
    np.testing.assert_allclose([s.position for s in steps], rolled.positions[1:], rtol=1e-12)
    np.testing.assert_allclose([s.covariance for s in steps], rolled.covariances[1:], rtol=1e-9, atol=1e-12)


def test_the_first_observation_tells_an_unknown_start(learned, recording):
    """Line 7 at the first tick: where the start is not known, what is measured is weighed with what was learned."""
    execution = learned.execute(dt=recording.dt)
    steps = [execution.step(o) for o in recording.positions]
    primitive = learned.primitive_
    for d in range(primitive.n_dof):
        observed = recording.positions[:, d]
        model = paper.system(primitive, d, np.nan, primitive.goal[d], primitive.duration, recording.dt, len(observed) + 1)
        run = paper.algorithm_2(model, observed)
        desired = np.array([[s.acceleration[d], s.velocity[d], s.position[d]] for s in steps])
        assert_close(desired[:-1], run.mu_p[1:])
        assert_close(np.array([s.contributions[d] for s in steps]), run.log_likelihoods)
        variance = primitive.start_covariances[d, 1, 1]
        assert run.K[0, 2] == pytest.approx(variance / (variance + primitive.observation_variances[d]), rel=1e-12)


def test_an_execution_on_the_mean_is_not_modulated(learned):
    """The update adds a term proportional to how much the reference deviates from the feedback: no deviation, no term."""
    rolled, execution = learned.rollout(), learned.execute()
    steps = [execution.step(o) for o in rolled.positions]
    np.testing.assert_allclose([s.position for s in steps[:-1]], rolled.positions[1:], rtol=1e-9)
    # ... and the covariances do not depend on what was observed
    wrong = learned.execute()
    others = [wrong.step(o + 5.0) for o in rolled.positions]
    np.testing.assert_allclose([s.covariance for s in others], [s.covariance for s in steps], rtol=1e-12)


def test_the_feedback_is_proportional_to_the_deviation(learned):
    """K (o_t - h(s_t)): twice the disturbance, twice the modulation."""
    rolled = learned.rollout()
    modulations = []
    for size in (1.0, 2.0):
        execution = learned.execute()
        disturbed = rolled.positions + size * np.sin(rolled.times)[:, None]
        desired = np.array([execution.step(o).position for o in disturbed])
        modulations.append(desired[:-1] - rolled.positions[1:])
    np.testing.assert_allclose(modulations[1], 2 * modulations[0], atol=1e-8)


def test_the_desired_behaviour_follows_the_measured_one(learned):
    """ "Automatically leads to online adaptation": after a displacement the next desired position lies on the side of it."""
    rolled, execution = learned.rollout(), learned.execute()
    half = len(rolled.times) // 2
    for o in rolled.positions[:half]:
        execution.step(o)
    shift = np.array([2.0, -2.0])
    step = execution.step(rolled.positions[half] + shift)
    fraction = (step.position - rolled.positions[half + 1]) / shift
    assert np.all(fraction > 0)
    assert np.all(fraction < 1.5)


def gains(primitive, n_steps=60):
    """K of the position at each step, by the library's filter: (S - R) / S, as C picks the position."""
    model = linear_gaussian_model(primitive, task_for(primitive), primitive.duration / n_steps, n_steps)
    observations = np.zeros((n_steps, primitive.n_dof, 1))
    S = filter_sequence(model, observations).innovation_covariances[..., 0, 0]
    return 1 - primitive.observation_variances / S


def test_the_gain_is_scaled_by_uncertainty(published):
    """The feedback term is scaled by an uncertainty based gain matrix: more with Q, less with R."""
    primitive = published.primitive_
    own = gains(primitive)[1:]
    assert np.all((own > 0) & (own < 1))
    unsure = replace(
        primitive,
        weight_covariances=4 * primitive.weight_covariances,
        forcing_precisions=primitive.forcing_precisions / 4,
    )
    noisy = replace(primitive, observation_variances=4 * primitive.observation_variances)
    assert np.all(gains(unsure)[1:] > own)
    assert np.all(gains(noisy)[1:] < own)
    sure = replace(
        primitive, weight_covariances=0 * primitive.weight_covariances, forcing_precisions=1e30 * primitive.forcing_precisions,
        start_covariances=0 * primitive.start_covariances,
    )  # fmt: skip
    np.testing.assert_allclose(gains(sure), 0, atol=1e-12)  # nothing to learn from what is measured


def test_beyond_its_duration_an_execution_goes_on_to_the_goal(learned):
    """The algorithm ends at T; ours does not stop there: the phase decays on, the goal attracts."""
    execution = learned.execute(goal=[30.0, 40.0])
    n = len(learned.rollout().times)
    for _ in range(5 * n):
        step = execution.step()
    np.testing.assert_allclose(step.position, [30.0, 40.0], atol=1e-3)


def test_ticks_are_the_algorithms_t(published):
    """t = 1 in print is the first observation; here it is tick 0, which updates the start and returns the state at tick 1."""
    execution = OnlineExecution(published.primitive_, task_for(published.primitive_), 0.01)
    first = execution.step(published.primitive_.start)
    assert first.time == pytest.approx(0.01)
    assert first.phase == 1.0
