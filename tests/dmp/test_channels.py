"""Sensor channels beside a movement: what one shows is told of the other, as brute force says, and nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest
from strategies import make_joint_primitive, make_primitive

from probdmp.demonstrations import Demonstration
from probdmp.dmp import ChannelVariation, Configuration, condition_primitive, path_distribution, task_for
from probdmp.dmp.deviations import deviation_system
from probdmp.errors import InputError, InputTypeError
from probdmp.execution import roll_out, sample_states, smooth_recording, track_recording

STEPS = 21
DT = 1 / (STEPS - 1)
NAN = np.nan


def felt(seed=0, **changes):
    """Two degrees of freedom and two channels, in one joint Gaussian; a second in twenty steps."""
    rng = np.random.default_rng(seed)
    changes = {"duration": 1.0, "dt": DT, "phase_step": DT, "start_covariances": np.zeros((2, 2, 2))} | changes
    return make_joint_primitive(rng, 2, 4, ("force", "torque"), rank=6, **changes)


def still(primitive):
    """The primitive without deviations: executions are their parameters alone."""
    return replace(primitive, configuration=replace(primitive.configuration, forcing_noise="posterior"))


def unrelated(primitive):
    """The primitive whose channels vary by themselves."""
    cross = np.zeros_like(primitive.channels.cross_covariance)
    return replace(primitive, channels=replace(primitive.channels, cross_covariance=cross))


def recording(positions, **channels):
    return Demonstration(positions, DT, names=("q0", "q1"), channels=channels)


def dense(primitive):
    """Mean (T S) and covariance (T S, T S) of all signals at all times, deviations included, from a known start."""
    means, covariance = path_distribution(primitive, STEPS)
    system = deviation_system(primitive, np.asarray(1.0), np.asarray(DT))
    A, n_signals = system.transition[0], len(primitive.signals.names)
    for signal, Q in enumerate(system.noise):
        causes = np.zeros((STEPS, 3, STEPS, 3))
        for s in range(1, STEPS):
            causes[s, :, s] = np.eye(3)
            for t in range(s + 1, STEPS):
                causes[t, :, s] = A @ causes[t - 1, :, s]
        of_states = np.einsum("tisj,jk,uvsk->tiuv", causes, Q, causes)
        covariance[:, signal, :, signal] += of_states[:, 2, :, 2]
    means[:, : primitive.n_dof] += primitive.start
    size = STEPS * n_signals
    return means.ravel(), covariance.reshape(size, size)


def conditioned(mean, covariance, which, values, variances):
    """Given values of some entries, measured with the given variances."""
    S = covariance[np.ix_(which, which)] + np.diag(variances)
    gain = covariance[:, which] @ np.linalg.inv(S)
    return mean + gain @ (values - mean[which]), covariance - gain @ covariance[which]


# --- what is expected of channels -------------------------------------------------------------------------------------


def test_the_plan_has_the_channels_of_the_path_distribution():
    p = felt()
    mean, covariance = dense(p)
    rolled = roll_out(p, task_for(p), DT)
    stds = np.sqrt(np.diagonal(covariance)).reshape(STEPS, 4)
    assert list(rolled.channels) == ["force", "torque"]
    for i, channel in enumerate(rolled.channels.values(), start=2):
        np.testing.assert_allclose(channel.means, mean.reshape(STEPS, 4)[:, i], atol=1e-9)
        np.testing.assert_allclose(channel.stds, stds[:, i], rtol=1e-6)
    np.testing.assert_allclose(rolled.positions, mean.reshape(STEPS, 4)[:, :2], atol=1e-9)
    np.testing.assert_allclose(rolled.position_stds, stds[:, :2], rtol=1e-6, atol=1e-9)


def test_draws_vary_together_as_the_path_distribution_says():
    p = felt()
    states = sample_states(p, task_for(p), DT, 4000, np.random.default_rng(0))[..., 2]
    mean, covariance = dense(p)
    for t in (5, 12, 20):
        at = slice(4 * t, 4 * t + 4)
        stds = np.sqrt(np.diagonal(covariance)[at])
        assert np.abs(states[:, t].mean(axis=0) - mean[at]).max() < 5 * stds.max() / np.sqrt(4000)
        np.testing.assert_allclose(
            np.cov(states[:, t].T) / np.outer(stds, stds), covariance[at, at] / np.outer(stds, stds), atol=0.09
        )


def test_where_a_channel_begins_is_uncertain_and_no_task_tells_it():
    p = felt()
    rolled = roll_out(p, task_for(p, [3.0, -2.0], [5.0, 5.0]), DT)
    assert np.all([c.stds[0] > 0.1 for c in rolled.channels.values()])
    np.testing.assert_array_equal(rolled.position_stds[0], 0)


# --- one tells of the other -------------------------------------------------------------------------------------------


def test_seeing_positions_moves_the_channels_as_brute_force_says():
    p = felt(1)
    mean, covariance = dense(p)
    positions = np.full((STEPS, 2), NAN)
    positions[3:9] = mean.reshape(STEPS, 4)[3:9, :2] + 0.2
    which = [4 * t + d for t in range(3, 9) for d in range(2)]
    wanted, left = conditioned(mean, covariance, which, positions[3:9].ravel(), np.tile(p.observation_variances, 6))
    got = smooth_recording(p, task_for(p), recording(positions))
    for i, channel in enumerate(got.channels.values(), start=2):
        np.testing.assert_allclose(channel.means, wanted.reshape(STEPS, 4)[:, i], atol=1e-6)
        np.testing.assert_allclose(channel.stds, np.sqrt(np.diagonal(left)).reshape(STEPS, 4)[:, i], rtol=1e-5)
    plan = roll_out(p, task_for(p), DT)
    assert np.abs(got.channels["force"].means - plan.channels["force"].means).max() > 0.1


def test_seeing_a_channel_alone_narrows_the_band_of_positions_as_brute_force_says():
    p = felt(2)
    mean, covariance = dense(p)
    force = mean.reshape(STEPS, 4)[:, 2] + 0.3 * np.sin(np.arange(STEPS))
    which = [4 * t + 2 for t in range(STEPS)]
    wanted, left = conditioned(mean, covariance, which, force, np.full(STEPS, p.channels.observation_variances[0]))
    seen = recording(np.full((STEPS, 2), NAN), force=force)
    smoothed, plan = smooth_recording(p, task_for(p), seen), roll_out(p, task_for(p), DT)
    np.testing.assert_allclose(smoothed.positions, wanted.reshape(STEPS, 4)[:, :2], atol=1e-6)
    stds = np.sqrt(np.maximum(np.diagonal(left), 0)).reshape(STEPS, 4)[:, :2]
    np.testing.assert_allclose(smoothed.position_stds, stds, rtol=1e-4, atol=1e-7)
    assert np.all(smoothed.position_stds[1:] < plan.position_stds[1:])
    assert smoothed.position_stds.mean() < 0.9 * plan.position_stds.mean()
    tracked = track_recording(p, task_for(p), seen)
    assert tracked.outputs == ("q0", "q1", "force", "torque")
    assert np.all(tracked.contributions[:, [0, 1, 3]] == 0)
    until = [4 * t + 2 for t in range(10)]
    by_then, _ = conditioned(mean, covariance, until, force[:10], np.full(10, p.channels.observation_variances[0]))
    np.testing.assert_allclose(tracked.positions[9], by_then.reshape(STEPS, 4)[9, :2], atol=1e-6)


def test_channels_that_vary_by_themselves_tell_nothing():
    p = unrelated(felt(3))
    rng = np.random.default_rng(0)
    plan, blind = roll_out(p, task_for(p), DT), recording(np.full((STEPS, 2), NAN), force=rng.standard_normal(STEPS))
    heard = smooth_recording(p, task_for(p), blind)
    np.testing.assert_allclose(heard.positions, plan.positions, atol=1e-9)
    np.testing.assert_allclose(heard.position_stds, plan.position_stds, rtol=1e-7, atol=1e-9)
    seen = smooth_recording(p, task_for(p), recording(rng.standard_normal((STEPS, 2))))
    np.testing.assert_allclose(seen.channels["force"].means, plan.channels["force"].means, atol=1e-8)


def test_a_via_point_moves_the_expected_channel_as_brute_force_says():
    p = still(felt(4))
    mean, covariance = dense(p)
    t, std = 8, 0.05
    target = np.array([mean[4 * t] + 1.0, NAN])
    wanted, left = conditioned(mean, covariance, [4 * t], target[:1], [std**2])
    through = condition_primitive(p, [(t * DT, target, std)])
    got, spread = dense(through)
    np.testing.assert_allclose(got, wanted, atol=1e-6)
    np.testing.assert_allclose(spread, left, atol=1e-6)
    before, after = (roll_out(q, task_for(q), DT).channels["force"] for q in (p, through))
    assert np.abs(after.means - before.means).max() > 0.05
    assert np.all(after.stds <= before.stds + 1e-9)
    for name in ("observation_variances", "forcing_precisions", "residual_variances", "ranges"):
        np.testing.assert_array_equal(getattr(through.channels, name), getattr(p.channels, name))
    assert through.channel_names == p.channel_names


# --- and nothing else -------------------------------------------------------------------------------------------------


def test_a_channel_that_is_never_measured_might_as_well_not_exist():
    """The movement is as it would be without: filter, smoother, plan, via-points."""
    p = felt(5)
    bare, rng = replace(p, channels=None), np.random.default_rng(0)
    seen = recording(np.where(rng.random((STEPS, 2)) < 0.3, NAN, p.start + 0.3 * rng.standard_normal((STEPS, 2))))
    task = task_for(p, [NAN, 0.0], p.goal)
    for run in (
        lambda q: track_recording(q, task, seen),
        lambda q: smooth_recording(q, task, seen),
        lambda q: roll_out(q, task, DT),
    ):
        one, other = run(bare), run(p)
        np.testing.assert_allclose(other.means, one.means, rtol=1e-7, atol=1e-7 * np.abs(one.means).max())
        np.testing.assert_allclose(other.covariances, one.covariances, rtol=1e-6, atol=1e-7 * one.covariances.max())
        assert not one.channels
    likelihoods = [track_recording(q, task, seen).log_likelihoods for q in (bare, p)]
    np.testing.assert_allclose(*likelihoods, rtol=1e-7, atol=1e-7)
    points = [(8 * DT, p.start + 0.5, 0.1)]
    one, other = (condition_primitive(q, points) for q in (bare, p))
    np.testing.assert_allclose(other.variation.means, one.variation.means, rtol=1e-6, atol=1e-6)


def test_units_of_a_channel_scale_it_alone():
    p = felt(6)
    c, k, n = p.channels, 1000.0, p.configuration.n_basis + 3
    unit = np.concatenate([np.full(n, k), np.ones(n)])
    scaled = replace(
        p,
        channels=ChannelVariation(
            names=c.names,
            means=c.means * [[k], [1.0]],
            covariance=c.covariance * unit * unit[:, None],
            cross_covariance=c.cross_covariance * unit[:, None],
            residual_variances=c.residual_variances * [k**2, 1.0],
            observation_variances=c.observation_variances * [k**2, 1.0],
            forcing_precisions=c.forcing_precisions / [k**2, 1.0],
            ranges=c.ranges * [k, 1.0],
        ),
    )
    rng = np.random.default_rng(0)
    positions, force, torque = rng.standard_normal((STEPS, 2)), *rng.standard_normal((2, STEPS))
    one = track_recording(p, task_for(p), recording(positions, force=force, torque=torque))
    other = track_recording(scaled, task_for(scaled), recording(positions, force=force * k, torque=torque))
    np.testing.assert_allclose(other.positions, one.positions, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(other.channels["force"].means, k * one.channels["force"].means, rtol=1e-6, atol=1e-4)
    np.testing.assert_allclose(other.channels["torque"].stds, one.channels["torque"].stds, rtol=1e-6)
    np.testing.assert_allclose(other.log_likelihoods, one.log_likelihoods - np.log(k), rtol=1e-6, atol=1e-6)


def test_signals_are_degrees_of_freedom_then_channels():
    p = felt()
    assert p.signals.names == ("q0", "q1", "force", "torque")
    for name in ("ranges", "observation_variances", "forcing_precisions"):
        both = np.concatenate([getattr(p, name), getattr(p.channels, name)])
        np.testing.assert_array_equal(getattr(p.signals, name), both)
    residuals = np.concatenate([p.variation.residual_variances, p.channels.residual_variances])
    np.testing.assert_array_equal(p.signals.residual_variances, residuals)
    bare = replace(p, channels=None)
    assert (bare.signals.names, bare.channel_names) == (("q0", "q1"), ())
    assert make_primitive(np.random.default_rng(0)).signals.residual_variances is None
    changed = p.with_signal_noise(np.array([1.0, 2.0, 3.0, 4.0]), np.array([5.0, 6.0, 7.0, 8.0]))
    np.testing.assert_array_equal(changed.channels.observation_variances, [3, 4])
    np.testing.assert_array_equal(changed.forcing_precisions, [5, 6])
    np.testing.assert_array_equal(changed.channels.covariance, p.channels.covariance)


def test_channels_are_part_of_who_a_primitive_is():
    p = felt()
    others = [
        replace(p, channels=None),
        replace(p, channels=replace(p.channels, names=("force", "moment"))),
        replace(p, channels=replace(p.channels, means=p.channels.means + 1e-9)),
        unrelated(p),
    ]
    assert len({q.identity for q in (p, *others)}) == 5
    assert replace(p).identity == p.identity


# --- what cannot be ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "error", "match"),
    [
        ({"names": ()}, InputError, r"at least one channel, all named differently, got \(\)"),
        ({"names": ("force", "force")}, InputError, "all named differently"),
        ({"names": "force"}, InputTypeError, "names of channels as text, got 'force'"),
        ({"names": ("force", 2)}, InputTypeError, "names of channels as text"),
        ({"means": np.zeros((1, 7))}, InputError, r"channel means of shape \(2, N \+ 3\), got \(1, 7\)"),
        ({"covariance": np.eye(3)}, InputError, r"channel covariance of shape \(14, 14\), got \(3, 3\)"),
        ({"ranges": np.ones(3)}, InputError, r"channel ranges of shape \(2,\), got \(3,\)"),
        ({"ranges": np.array([1.0, 0.0])}, InputError, r"channel ranges > 0, got 0"),
        ({"observation_variances": np.array([-1.0, 1.0])}, InputError, r"channel observation_variances > 0, got -1"),
        ({"residual_variances": np.array([NAN, 1.0])}, InputError, "channel residual_variances finite"),
    ],
)
def test_channel_variations_that_cannot_be(changes, error, match):
    with pytest.raises(error, match=match):
        replace(felt().channels, **changes)


def test_arrays_of_channels_are_read_only():
    for array in felt().channels.arrays().values():
        assert not array.flags.writeable


def test_channels_need_joint_weights_that_vary():
    p = felt()
    for changes in (
        {"variation": None},
        {"configuration": Configuration(n_basis=4, weight_uncertainty="independent")},
    ):
        with pytest.raises(InputError, match=r'weight_model="hierarchical" and weight_uncertainty="joint" with channels'):
            replace(p, **changes)


def test_channels_that_do_not_fit_the_movement():
    p = felt()
    named = replace(p.channels, names=("force", "q0"))
    with pytest.raises(InputError, match=r"channels named otherwise than the degrees of freedom, got \('force', 'q0'\)"):
        replace(p, channels=named)
    with pytest.raises(InputError, match=r"channels with a cross covariance of shape \(14, 12\), got \(14, 11\)"):
        replace(p, channels=replace(p.channels, cross_covariance=p.channels.cross_covariance[:, 1:]))
    with pytest.raises(InputError, match="channels symmetric and positive semi-definite"):
        replace(p, channels=replace(p.channels, cross_covariance=3 * p.channels.cross_covariance))
