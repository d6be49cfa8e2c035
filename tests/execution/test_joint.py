"""Executions whose parameters are constant and unknown agree with brute-force conditioning of the dense joint density."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_primitive, random_covariance, seeds

from probdmp.demonstrations import Demonstration
from probdmp.dmp import Variation, linear_gaussian_model, task_for
from probdmp.dmp.deviations import lasting_variances
from probdmp.errors import InputError
from probdmp.execution import (
    OnlineExecution,
    filter_recordings,
    roll_out,
    sample_trajectories,
    score_recordings,
    smooth_recording,
    track_recording,
)
from probdmp.gaussian import filter_sequence

DT, STEPS = 0.05, 21
NAN = np.nan


def varied(seed=0, n_dof=2, n_basis=4, **changes):
    """A primitive with a random joint Gaussian over its parameters, movements of about one unit."""
    rng = np.random.default_rng(seed)
    changes = {"duration": DT * (STEPS - 1), "observation_variances": np.full(n_dof, 1e-4)} | changes
    p = make_primitive(rng, n_dof, n_basis, weight_uncertainty="joint", **changes)
    scale = np.tile([1.0, 0.3, *[0.1 * p.configuration.stiffness] * n_basis], n_dof)
    covariance = random_covariance(rng, (), len(scale), len(scale)) * scale * scale[:, None]
    means = np.column_stack([p.start_velocities, p.goal - p.start, p.weight_means])
    return replace(p, variation=Variation(means, covariance, np.full(n_dof, 1e-6)))


class Dense:
    """The joint Gaussian of x = (p0, v0, g - p0, w, eps) of all degrees of freedom, and of everything linear in it."""

    def __init__(self, primitive, dt=DT, steps=STEPS, duration=None):
        p, self.p = primitive, primitive
        d, n = p.n_dof, p.configuration.n_basis + 3
        self.d, self.steps = d, steps
        duration = p.duration if duration is None else duration
        columns = []
        for j in range(n):  # H, column by column, from rollouts of primitives with one parameter
            unit = np.eye(n)[j]
            one = make_primitive(
                np.random.default_rng(0), 1, n - 3, discretization=p.configuration.discretization, start=unit[:1],
                goal=unit[:1] + unit[2], start_velocities=unit[1:2], weight_means=unit[None, 3:], duration=p.duration,
            )  # fmt: skip
            task = task_for(one, one.start, one.goal, duration)
            columns.append(filter_sequence(linear_gaussian_model(one, task, dt, steps)).filtered.means[:, 0])
        A, B, variances = self.noise(duration, dt)
        E = np.zeros((steps, 3, steps - 1))
        for t in range(1, steps):
            E[t] = A @ E[t - 1]
            E[t, :, t - 1] += B
        self.H = np.concatenate([np.stack(columns, axis=-1), E], axis=-1)  # (T, 3, n + T - 1)
        self.n, self.n_parameters = n + steps - 1, n
        self.mean = np.column_stack([p.start, p.variation.means, np.zeros((d, steps - 1))]).ravel()
        V = np.zeros((d, self.n, d, self.n))
        V[:, 1:n, :, 1:n] = p.variation.covariance.reshape(d, n - 1, d, n - 1)
        for i in range(d):
            V[i, 0, i, 0] = p.start_covariances[i, 1, 1]
            V[i, 0, i, 1] = V[i, 1, i, 0] = p.start_covariances[i, 0, 1]
            V[i, n:, i, n:] = variances[i] * np.eye(steps - 1)
        self.V = V.reshape(d * self.n, d * self.n)

    def noise(self, duration, dt):
        """A, B and the variances of eps, as the paper's system has them for weights that are known."""
        independent = replace(self.p.configuration, weight_uncertainty="independent")
        p = replace(self.p, configuration=independent, weight_covariances=np.zeros_like(self.p.weight_covariances))
        model = linear_gaussian_model(p, task_for(p, duration=duration), dt, 2)
        return model.transition[0], model.input_matrix[0, :, 0], model.input_covariances[0, :, 0, 0]

    def rows(self, step, dof, derivative=2, deviating=True):
        row = np.zeros((self.d, self.n))
        row[dof] = self.H[step, derivative]
        row[dof, self.n_parameters :] *= deviating
        return row.ravel()

    def know_start(self, start):
        for i, value in enumerate(start):
            if not np.isnan(value):
                k = i * self.n
                self.mean[k], self.V[k], self.V[:, k] = value, 0, 0
        return self

    def know(self, rows, values, variances):
        """Condition on rows x = values, all at once; returns their log density."""
        rows, values = np.array(rows), np.array(values)
        S = rows @ self.V @ rows.T + np.diag(variances)
        gain, e = self.V @ rows.T @ np.linalg.inv(S), values - rows @ self.mean
        self.mean, self.V = self.mean + gain @ e, self.V - gain @ rows @ self.V
        return -0.5 * (e @ np.linalg.solve(S, e) + np.linalg.slogdet(2 * np.pi * S)[1])

    def see(self, observed, until=None):
        """Condition on positions (T, D) up to a time."""
        which = [(t, d) for t, d in zip(*np.nonzero(~np.isnan(observed)), strict=True) if until is None or t <= until]
        if not which:
            return 0.0
        variances = [self.p.observation_variances[d] for _, d in which]
        return self.know([self.rows(t, d) for t, d in which], [observed[t, d] for t, d in which], variances)

    def states(self, step):
        blocks = [np.array([self.rows(step, i, k) for k in range(3)]) for i in range(self.d)]
        return np.array([b @ self.mean for b in blocks]), np.array([b @ self.V @ b.T for b in blocks])


def prepared(primitive, start, goal=None, start_velocity=None, dt=DT, steps=STEPS, duration=None):
    """The dense density with what a task tells, all of it conditioned on."""
    dense = Dense(primitive, dt, steps, duration).know_start(start)
    duration = primitive.duration if duration is None else duration
    if start_velocity is not None:
        told = [i for i in range(dense.d) if not np.isnan(start_velocity[i])]
        unit = np.eye(dense.d * dense.n)
        dense.know([unit[i * dense.n + 1] for i in told], [start_velocity[i] * duration for i in told], [1e-12] * len(told))
    if goal is not None:
        last, own = round(duration / dt), range(dense.d)
        dense.know([dense.rows(last, i, deviating=False) for i in own], goal, primitive.variation.residual_variances)
    return dense


def movement(seed, missing=0.0, n_dof=2):
    rng = np.random.default_rng(seed + 100)
    path = sample_trajectories(varied(seed, n_dof), task_for(varied(seed, n_dof)), DT, 1, rng, True)[0]
    path[rng.random(path.shape) < missing] = NAN
    return path


def close(got, wanted, rtol=1e-6):
    np.testing.assert_allclose(got, wanted, rtol=rtol, atol=rtol * np.max(np.abs(wanted)))


TASKS = [
    {}, {"start": [NAN, NAN]}, {"goal": [0.2, 0.3]}, {"goal": [0.2, 0.3], "start": [NAN, 0.1]},
    {"start_velocity": [0.4, NAN]}, {"start_velocity": [0.4, -0.2], "goal": [0.0, 0.5], "start": [0.3, -0.2]},
]  # fmt: skip


@pytest.mark.parametrize("scheme", ["exact", "semi_implicit_euler"])
@pytest.mark.parametrize("told", TASKS, ids=lambda told: "+".join(told) or "nothing")
def test_rollout_filter_and_smoother_are_dense_conditioning(scheme, told):
    p, observed = varied(1, discretization=scheme, goal_handling="condition"), movement(1, 0.3)
    task, recording = task_for(p, **told), Demonstration(observed, DT)
    start, known = task.start, {k: v for k, v in told.items() if k != "start"}
    rolled, tracked, smoothed = roll_out(p, task, DT), track_recording(p, task, recording), smooth_recording(p, task, recording)
    everything = prepared(p, start, **known)
    total = everything.see(observed)
    for t in range(0, STEPS, 4):
        for trajectory, until in ((rolled, -1), (tracked, t), (smoothed, None)):
            dense = prepared(p, start, **known)
            dense.see(observed, until)
            means, covariances = dense.states(t)
            close(trajectory.means[t], means, 1e-5)
            close(trajectory.covariances[t], covariances, 2e-5)
    assert tracked.log_likelihoods.sum() == pytest.approx(total, rel=1e-6)
    np.testing.assert_allclose(tracked.contributions.sum(axis=1), tracked.log_likelihoods)
    assert np.all(tracked.log_likelihoods[np.isnan(observed).all(axis=1)] == 0)


@settings(max_examples=10)
@given(seeds, st.integers(1, 3), st.floats(0, 0.9))
def test_online_is_offline_and_missing_says_nothing(seed, n_dof, missing):
    p = varied(seed, n_dof)
    observed = movement(seed, missing, n_dof)
    task = task_for(p, np.full(n_dof, NAN), p.goal + 0.1)
    tracked = track_recording(p, task, Demonstration(observed, DT))
    e = OnlineExecution(p, task, DT)
    for t, o in enumerate(observed):
        step = e.step(o)
        np.testing.assert_allclose(step.contributions, tracked.contributions[t], rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(step.innovations, tracked.innovations[t], rtol=1e-7, atol=1e-7)
    nothing = track_recording(p, task, Demonstration(np.full((STEPS, n_dof), NAN), DT))
    rolled = roll_out(p, task, DT)
    np.testing.assert_allclose(nothing.means, rolled.means, atol=1e-8 * np.abs(rolled.means).max())
    assert nothing.log_likelihoods.sum() == 0


def test_what_is_commanded_is_the_prediction_from_what_was_seen():
    p, observed = varied(3), movement(3)
    task = task_for(p, goal=p.goal)
    e = OnlineExecution(p, task, DT)
    for t in range(8):
        step = e.step(observed[t])
    dense = prepared(replace(p, variation=p.variation), task.start, p.goal)
    dense.see(observed, 7)
    means, covariances = dense.states(8)
    np.testing.assert_allclose(step.position, means[:, 2], atol=2e-2)  # blended, and the goal is a sure one
    assert np.all(np.linalg.eigvalsh(step.covariance)[:, 0] > -1e-9 * covariances.max())


def test_a_batch_is_its_members_whatever_their_rates():
    p = varied(4)
    recordings = [Demonstration(movement(4), DT), Demonstration(movement(5)[:15], 2 * DT), Demonstration(movement(6), DT)]
    tasks = [task_for(p, goal=[0.1, 0.2]), task_for(p, [NAN, NAN], duration=1.7), task_for(p, start_velocity=[0.0, NAN])]
    together = filter_recordings(p, tasks, recordings)
    scores = score_recordings(p, tasks, recordings)
    for k, (task, recording) in enumerate(zip(tasks, recordings, strict=True)):
        alone, n = track_recording(p, task, recording), recording.n_samples
        np.testing.assert_allclose(together.filtered.means[:n, k], alone.means, rtol=1e-6, atol=1e-7)
        np.testing.assert_allclose(together.log_likelihoods[:n, k], alone.contributions, rtol=1e-6, atol=1e-7)
        assert scores[k] == pytest.approx(alone.log_likelihoods.sum(), rel=1e-8)


def test_after_its_duration_the_goal_attracts_and_nothing_breaks():
    p = varied(5)
    e = OnlineExecution(p, task_for(p, goal=p.goal), DT)
    for _ in range(8 * STEPS):
        step = e.step()
    np.testing.assert_allclose(step.velocity, 0, atol=1e-2)
    np.testing.assert_allclose(step.position, p.goal, atol=0.2)
    assert np.isfinite(step.covariance).all()
    long = track_recording(p, task_for(p, goal=p.goal), Demonstration(np.full((8 * STEPS, 2), NAN), DT))
    np.testing.assert_allclose(long.means[-1, :, 2], step.position, atol=1e-3)


def test_samples_have_the_moments_of_the_rollout():
    p = varied(6)
    task = task_for(p, [NAN, 0.0], p.goal)
    rolled = roll_out(p, task, DT)
    paths = np.array(sample_trajectories(p, task, DT, 4000, np.random.default_rng(0), False))
    np.testing.assert_allclose(paths.mean(axis=0), rolled.positions, atol=4 * rolled.position_stds.max() / np.sqrt(4000))
    np.testing.assert_allclose(paths.std(axis=0), rolled.position_stds, atol=0.05 * rolled.position_stds.max())
    noisy = np.array(sample_trajectories(p, task, DT, 4000, np.random.default_rng(0), True))
    np.testing.assert_allclose((noisy - paths).std(axis=(0, 1)), 0.01, rtol=0.05)


@pytest.mark.parametrize("scheme", ["exact", "semi_implicit_euler"])
def test_pooled_weights_can_be_joint_too(scheme):
    """The same mean; the band is that of constant weights with the posterior's covariance."""
    p = make_primitive(np.random.default_rng(7), 2, 5, discretization=scheme, scaling="none", forcing_noise="posterior")
    joint = replace(p, configuration=replace(p.configuration, weight_uncertainty="joint"))
    task = task_for(p, goal=p.goal)
    one, other = roll_out(p, task, p.duration / 50), roll_out(joint, task, p.duration / 50)
    wide = roll_out(joint, task_for(joint), p.duration / 50)
    np.testing.assert_allclose(wide.means, one.means, rtol=1e-9, atol=1e-9 * np.abs(one.means).max())
    assert np.all(other.position_stds[-1] < wide.position_stds[-1])
    assert wide.position_stds.max() > 1.5 * one.position_stds.max()


def test_units_and_the_order_of_degrees_of_freedom_change_nothing():
    p, observed = varied(8), movement(8)
    unit, n = 1000.0, p.configuration.n_basis + 2
    lengths = ("weight_means", "goal_displacements", "ranges", "start", "goal", "start_velocities")
    squares = ("weight_covariances", "observation_variances", "start_covariances")
    scaled = replace(
        p,
        variation=Variation(*(a * unit**k for a, k in zip(p.variation.arrays().values(), (1, 2, 2), strict=True))),
        **{name: getattr(p, name) * unit for name in lengths},
        **{name: getattr(p, name) * unit**2 for name in squares},
        forcing_precisions=p.forcing_precisions / unit**2,
    )
    one = track_recording(p, task_for(p, goal=[0.1, 0.2]), Demonstration(observed, DT))
    other = track_recording(scaled, task_for(scaled, goal=[100.0, 200.0]), Demonstration(observed * unit, DT))
    close(other.means / unit, one.means)
    np.testing.assert_allclose(other.log_likelihoods + 2 * np.log(unit), one.log_likelihoods, atol=1e-5)
    order = np.arange(2 * n).reshape(2, n)[::-1].ravel()
    m, c, r = p.variation.arrays().values()
    turned = replace(
        p,
        variation=Variation(m[::-1], c[np.ix_(order, order)], r[::-1]),
        **{name: getattr(p, name)[::-1] for name in (*lengths, *squares, "forcing_precisions")},
    )
    swapped = track_recording(turned, task_for(turned, goal=[0.2, 0.1]), Demonstration(observed[:, ::-1], DT))
    close(swapped.means[:, ::-1], one.means)
    close(swapped.log_likelihoods, one.log_likelihoods)
    close(swapped.contributions[:, ::-1], one.contributions)


# --- what the parameters leave over -----------------------------------------------------------------------------------


def pushed(p, push=0.3):
    """The command after a robot that had followed was pushed aside and held there for a few ticks."""
    e = OnlineExecution(p, task_for(p, goal=p.goal), DT)
    wanted = e.step(p.start)
    for t in range(12):
        there = wanted.position + (push if t > 8 else 0.0)
        wanted = e.step(there)
    return wanted.position - there


def test_the_command_follows_a_robot_that_was_pushed():
    """Constant weights alone must explain the push by all of the movement so far."""
    changes = {"forcing_precisions": np.full(2, (0.5 * 25**2 / 4) ** -2)}
    narrow = 1e-4 * np.eye(2 * 6)
    p = varied(12, **changes)
    p = replace(p, variation=replace(p.variation, covariance=narrow * p.variation.covariance))
    still = replace(p, configuration=replace(p.configuration, forcing_noise="posterior"))
    undisturbed = pushed(p, 0.0)
    assert np.all(np.abs(pushed(p) - undisturbed) < 0.2)
    assert np.all(np.abs(pushed(still) - undisturbed) > 0.28)


def test_bands_of_position_and_velocity_hardly_depend_on_the_rate_and_those_of_the_acceleration_do():
    p = varied(13, duration=1.0)
    p = replace(p, variation=replace(p.variation, covariance=1e-9 * p.variation.covariance))
    slow, fast = (np.sqrt(np.diagonal(roll_out(p, task_for(p), dt).covariances, axis1=-2, axis2=-1)) for dt in (0.01, 0.001))
    np.testing.assert_allclose(slow[:, :, 1:], fast[::10, :, 1:], atol=0.03 * slow[..., 1:].max(axis=(0, 1)).min())
    np.testing.assert_allclose(fast[20:, :, 0].mean() / slow[20:, :, 0].mean(), np.sqrt(10), rtol=0.1)
    end = slow[-1, :, 2] ** 2
    np.testing.assert_allclose(end, lasting_variances(p), rtol=0.1)


# --- commanded goals --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("handling", ["blend", "condition", "attractor"])
@pytest.mark.parametrize("far", [0.1, 10.0])
def test_the_movement_ends_at_the_goal(handling, far):
    p = varied(9, goal_handling=handling)
    goal = p.start + p.variation.means[:, 1] + far
    rolled = roll_out(p, task_for(p, goal=goal), DT)
    np.testing.assert_allclose(rolled.positions[-1], goal, atol=0.01 + 1e-3 * far)
    assert np.all(rolled.position_stds[-1] < 0.01 + np.sqrt(lasting_variances(p)))


def test_near_goals_are_conditioned_on_and_far_ones_attract():
    p = {h: varied(10, goal_handling=h) for h in ("blend", "condition", "attractor")}
    expected = roll_out(p["blend"], task_for(p["blend"]), DT)
    stds = expected.position_stds[-1]

    def paths(n_stds):
        goal = expected.positions[-1] + n_stds * stds
        return {h: roll_out(q, task_for(q, goal=goal), DT).positions for h, q in p.items()}

    near, far = paths(0.1), paths(1000)
    assert np.abs(near["blend"] - near["condition"]).max() < 0.05 * np.abs(near["attractor"] - near["condition"]).max()
    assert np.abs(far["blend"] - far["attractor"]).max() < 0.05 * np.abs(far["attractor"] - far["condition"]).max()


def test_another_start_keeps_the_goal_that_was_learned():
    p = varied(11)
    for shift in (0.05, 5.0):
        rolled = roll_out(p, task_for(p, p.start + shift), DT)
        learned = roll_out(p, task_for(p), DT)
        np.testing.assert_allclose(rolled.positions[-1], learned.positions[-1], atol=1e-3 * (1 + shift))
        np.testing.assert_allclose(rolled.position_stds, learned.position_stds)


def test_scaling_is_refused():
    with pytest.raises(InputError, match=r'scaling="none" with weight_uncertainty="joint"'):
        varied(0, scaling="paper")
