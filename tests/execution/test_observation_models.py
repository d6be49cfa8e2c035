"""Executions observed by sensors of any kind: brute-force conditioning, and the laws that any observation obeys.

All of it for weights that are redrawn at every step (independent), for weights that stay (joint), and for these with a sensor
channel that was learned with the movement (felt).
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import (
    Parametric,
    System,
    dense_posterior,
    deviation_in_stds,
    marginal_stds,
    parametric_posterior,
    system_at,
)
from scipy.linalg import block_diag
from sensed import DT, KINDS, NAN, STEPS, difference, movement, nonlinear, readings, recorded, smoothed, tracked
from strategies import random_covariance, random_sensors, seeds, state_scales

from probdmp.dmp import linear_gaussian_model, stack_tasks
from probdmp.dmp.joint_model import joint_executions
from probdmp.execution import (
    ChannelSensor,
    LinearSensor,
    OnlineExecution,
    SensorArray,
    filter_recordings,
    roll_out,
    sample_states,
    score_recordings,
    state_sensor,
)

OF_EVERY_KIND = pytest.mark.parametrize("kind", KINDS)


# --- brute force ------------------------------------------------------------------------------------------------------


def dense_system(p, task, sensors):
    """The movement as a linear system without structure, seen through all sensors."""
    n_signals, columns = len(p.signals.names), []
    for sensor in sensors:
        matrix = np.zeros((sensor.n_outputs, 3 * n_signals))
        if isinstance(sensor, ChannelSensor):
            matrix[0, 3 * p.signals.names.index(sensor.name) + 2] = 1.0
        else:
            matrix[:, : 3 * p.n_dof] = sensor.matrix
        columns.append(matrix)
    C, R = np.concatenate(columns), block_diag(*(sensor.covariance for sensor in sensors))
    if p.configuration.weight_uncertainty == "independent":
        model = linear_gaussian_model(p, task, DT, STEPS)
        parts = [system_at(model, (d,)) for d in range(p.n_dof)]
        A, B, V0 = (block_diag(*(getattr(part, name) for part in parts)) for name in ("A", "B", "V0"))
        U = np.stack([block_diag(*step) for step in zip(*(part.U for part in parts), strict=True)])
        u, m0 = np.concatenate([part.u for part in parts], axis=1), np.concatenate([part.m0 for part in parts])
        return System(A, B, u, U, C, R, m0, V0)
    (means, factors, belief), rows, system = joint_executions(p, stack_tasks([task]), np.array([DT]), STEPS)
    offsets, designs = np.einsum("tkn,sn->tsk", rows[:, 0], means[0]), np.einsum("tkn,snr->tskr", rows[:, 0], factors[0])
    n, r = 3 * n_signals, designs.shape[-1]
    A, Q = np.kron(np.eye(n_signals), system.transition[0, 0]), block_diag(*system.noise[0])
    return Parametric(
        offsets.reshape(-1, n), designs.reshape(-1, n, r), belief.mean[0], belief.covariance[0], A, Q, C, R
    )  # fmt: skip


def brute_force(p, task, sensors, values):
    system = dense_system(p, task, sensors)
    return system, (dense_posterior if isinstance(system, System) else parametric_posterior)(system, values)


def by_dof(p, sequence):
    """Dense means (T, 3 S) and covariances as a trajectory has them."""
    means, covariances = sequence
    d = p.n_dof
    blocks = [covariances[:, 3 * i : 3 * i + 3, 3 * i : 3 * i + 3] for i in range(d)]
    return means[:, : 3 * d].reshape(-1, d, 3), np.stack(blocks, axis=1)


@OF_EVERY_KIND
@pytest.mark.parametrize("coupling", [False, "noise", True], ids=["by dof", "common noise", "coupled"])
@settings(max_examples=3)
@given(seeds, st.sampled_from([0.0, 0.4]), st.lists(st.integers(1, 4), min_size=3, max_size=3))
def test_it_is_brute_force_conditioning(kind, coupling, seed, missing, periods):
    """Mixtures of states with a full R, gaps in single outputs, sensors of different rates."""
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    array = SensorArray(p, random_sensors(rng, p, DT, 3, coupling))
    assert array.is_coupled == bool(coupling)
    values = readings(p, task, array, rng, missing, periods)
    system, expected = brute_force(p, task, array.sensors, values)
    track, smooth = tracked(p, task, array, values), smoothed(p, task, array, values)
    stds = marginal_stds(expected.prior[1])
    for got, wanted in ((track, expected.filtered), (smooth, expected.smoothed)):
        for i, (means, covariances) in enumerate(
            zip(*(np.moveaxis(x, 1, 0) for x in (got.means, got.covariances)), strict=True)
        ):
            of_dof = tuple(x[:, i] for x in by_dof(p, wanted))
            assert deviation_in_stds(means, covariances, of_dof, stds[:, 3 * i : 3 * i + 3]) < 1e-7
        for i, (_, felt) in enumerate(got.channels.items()):
            at = 3 * (p.n_dof + i) + 2
            np.testing.assert_allclose(felt.means, wanted[0][:, at], atol=1e-7)
            np.testing.assert_allclose(felt.stds, np.sqrt(wanted[1][:, at, at]), atol=1e-7)
    np.testing.assert_allclose(track.log_likelihoods, expected.log_likelihoods, rtol=1e-7, atol=1e-7)
    means, covariances = expected.predicted
    innovations, spread = values - means @ system.C.T, system.C @ covariances @ system.C.T + system.R
    outer = np.sqrt(np.einsum("tii->ti", spread))
    np.testing.assert_allclose(track.innovations / outer, innovations / outer, atol=1e-7)
    errors = np.abs(track.innovation_covariances - spread) / (outer[:, :, None] * outer[:, None, :])
    assert errors.max() < 1e-7
    np.testing.assert_array_equal(track.fused, ~np.isnan(values))


@OF_EVERY_KIND
def test_bands_hold_the_executions_that_sensors_have_seen(kind):
    """Drawn from the model, many executions lie within the bands of their filter as often as those say."""
    p, task = movement(kind, 3)
    rng = np.random.default_rng(0)
    array = SensorArray(p, random_sensors(rng, p, DT, 2, coupling=True))
    states = sample_states(p, task, DT, 300, rng)
    values = array.draw(states.reshape(300, STEPS, -1), rng)
    recordings = [recorded(array, v) for v in values]
    filtered = filter_recordings(p, [task] * 300, recordings, array).filtered
    errors = np.moveaxis(states, 0, 1) - filtered.means
    stds = np.sqrt(np.maximum(np.diagonal(filtered.covariances, axis1=-2, axis2=-1), 0))
    uncertain = stds > 1e-6  # a start that was told is known
    assert np.mean((np.abs(errors) < 1.96 * stds)[uncertain]) == pytest.approx(0.95, abs=0.01)


# --- sensors that say nothing -----------------------------------------------------------------------------------------


@OF_EVERY_KIND
@pytest.mark.parametrize("coupling", [False, True], ids=["by dof", "coupled"])
@settings(max_examples=2)
@given(seeds)
def test_a_sensor_with_infinite_variance_changes_nothing(kind, coupling, seed):
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    sensors = random_sensors(rng, p, DT, 2, coupling)
    own = random_sensors(rng, p, DT, 1, coupling)[0]
    silent = LinearSensor("silent", own.matrix, np.full(own.n_outputs, np.inf))
    alone, beside = SensorArray(p, sensors), SensorArray(p, [sensors[0], silent, sensors[1]])
    values, heard = readings(p, task, alone, rng, 0.2), rng.standard_normal((STEPS, own.n_outputs)) * 1e3
    together = np.empty((STEPS, len(beside.outputs)))
    for name, part in beside.slices.items():
        together[:, part] = heard if name == "silent" else values[:, alone.slices[name]]
    one, other = tracked(p, task, alone, values), tracked(p, task, beside, together)
    assert difference(one, other, p) < 1e-11
    assert difference(smoothed(p, task, alone, values), smoothed(p, task, beside, together), p) < 1e-11
    np.testing.assert_allclose(other.log_likelihoods, one.log_likelihoods, rtol=1e-11, atol=1e-11)
    assert not other.contributions[:, beside.slices["silent"]].any()
    assert (other.sensors["silent"].n_fused, other.sensors["silent"].n_missing) == (0, STEPS)
    online = OnlineExecution(p, task, DT, sensors=beside)
    for row in together:
        online.step(row)
    counts = online.sensor_counts["silent"]
    assert (counts.n_fused, counts.n_rejected, counts.n_missing) == (0, 0, STEPS)


@OF_EVERY_KIND
@settings(max_examples=2)
@given(seeds)
def test_an_output_with_infinite_variance_might_as_well_not_exist(kind, seed):
    """One of the outputs of a sensor with a full R."""
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    scales, noise = state_scales(p, DT), random_covariance(rng, (), 3, 3) + 0.1 * np.eye(3)
    matrix = rng.standard_normal((3, len(scales))) / scales
    mute = noise.copy()
    mute[1, 1] = np.inf
    rest = np.array([True, False, True])
    three = SensorArray(p, [LinearSensor("s", matrix, mute, ("a", "b", "c"))])
    two = SensorArray(p, [LinearSensor("s", matrix[rest], noise[np.ix_(rest, rest)], ("a", "c"))])
    values = rng.standard_normal((STEPS, 3))
    fewer = values[:, rest]
    if kind == "felt":
        values, fewer = (np.column_stack([x, np.full(STEPS, NAN)]) for x in (values, fewer))
    one, other = tracked(p, task, three, values), tracked(p, task, two, fewer)
    assert difference(other, one, p) < 1e-11
    np.testing.assert_allclose(one.log_likelihoods, other.log_likelihoods, rtol=1e-11, atol=1e-11)


# --- the same sensors, told otherwise ---------------------------------------------------------------------------------


@OF_EVERY_KIND
@pytest.mark.parametrize("coupling", [False, True], ids=["by dof", "coupled"])
@settings(max_examples=2)
@given(seeds)
def test_two_that_take_turns_are_one(kind, coupling, seed):
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    (sensor,) = random_sensors(rng, p, DT, 1, coupling)
    even, odd = (replace(sensor, name=name, outputs=()) for name in ("even", "odd"))
    one, two = SensorArray(p, [sensor]), SensorArray(p, [even, odd])
    values = readings(p, task, one, rng)
    n, turns = sensor.n_outputs, np.arange(STEPS)[:, None] % 2 == 0
    halves = [np.where(turns, values[:, :n], NAN), np.where(turns, NAN, values[:, :n]), values[:, n:]]
    whole, apart = tracked(p, task, one, values), tracked(p, task, two, np.concatenate(halves, axis=1))
    assert difference(whole, apart, p) < 1e-11
    np.testing.assert_allclose(apart.log_likelihoods, whole.log_likelihoods, rtol=1e-10, atol=1e-10)
    shares = np.where(turns, apart.contributions[:, :n], apart.contributions[:, n : 2 * n])
    np.testing.assert_allclose(shares, whole.contributions[:, :n], rtol=1e-10, atol=1e-10)
    assert difference(smoothed(p, task, one, values), smoothed(p, task, two, np.concatenate(halves, axis=1)), p) < 1e-11


@OF_EVERY_KIND
@pytest.mark.parametrize("coupling", [False, True], ids=["by dof", "coupled"])
@settings(max_examples=2)
@given(seeds)
def test_two_with_noise_of_their_own_are_one_with_both(kind, coupling, seed):
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    first, second = random_sensors(rng, p, DT, 2, coupling)
    matrix, noise = np.concatenate([first.matrix, second.matrix]), block_diag(first.covariance, second.covariance)
    one, two = SensorArray(p, [LinearSensor("both", matrix, noise)]), SensorArray(p, [first, second])
    values = readings(p, task, two, rng, 0.2)
    whole, apart = tracked(p, task, one, values), tracked(p, task, two, values)
    assert difference(whole, apart, p) < 1e-11
    np.testing.assert_allclose(apart.contributions, whole.contributions, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(apart.innovations, whole.innovations, rtol=1e-10, atol=1e-10)


@OF_EVERY_KIND
@pytest.mark.parametrize("coupling", [False, True], ids=["by dof", "coupled"])
@settings(max_examples=2)
@given(seeds)
def test_the_order_of_sensors_orders_results(kind, coupling, seed):
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    sensors = random_sensors(rng, p, DT, 3, coupling)
    given_one = SensorArray(p, sensors)
    permuted = SensorArray(p, [sensors[i] for i in rng.permutation(3)])
    order = np.concatenate([np.arange(len(given_one.outputs))[given_one.slices[name]] for name in permuted.names])
    values = readings(p, task, given_one, rng, 0.2)
    one, other = tracked(p, task, given_one, values), tracked(p, task, permuted, values[:, order])
    assert difference(one, other, p) < 1e-11
    np.testing.assert_allclose(other.innovations, one.innovations[:, order], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(other.contributions, one.contributions[:, order], rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(other.fused, one.fused[:, order])
    for name, track in one.sensors.items():
        np.testing.assert_allclose(other.sensors[name].test_ratios, track.test_ratios, rtol=1e-9)


# --- one path is the other --------------------------------------------------------------------------------------------


@OF_EVERY_KIND
@settings(max_examples=3)
@given(seeds, st.sampled_from([0.0, 0.4]))
def test_together_is_each_degree_of_freedom_by_itself(kind, seed, missing):
    """Sensors of single degrees of freedom, with one beside them that sees all, but says nothing."""
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    sensors = random_sensors(rng, p, DT, 3)
    silent = LinearSensor("silent", np.ones((1, 3 * p.n_dof)), [np.inf])
    apart, together = SensorArray(p, sensors), SensorArray(p, [*sensors, silent])
    assert (apart.is_coupled, together.is_coupled) == (False, True)
    values = readings(p, task, apart, rng, missing)
    n = sum(sensor.n_outputs for sensor in sensors)
    widened = np.insert(values, n, 0.0, axis=1)
    one, other = tracked(p, task, apart, values), tracked(p, task, together, widened)
    assert difference(one, other, p) < 1e-12
    assert difference(smoothed(p, task, apart, values), smoothed(p, task, together, widened), p) < 1e-12
    np.testing.assert_allclose(np.delete(other.contributions, n, axis=1), one.contributions, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(np.delete(other.innovations, n, axis=1), one.innovations, rtol=1e-11, atol=1e-11)


@OF_EVERY_KIND
@pytest.mark.parametrize("linearization", ["extended", "jacobian", "unscented"])
@settings(max_examples=1)
@given(seeds)
def test_linear_functions_have_the_exact_filter(kind, linearization, seed):
    """Filter, smoother, score and execution."""
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    sensors = random_sensors(rng, p, DT, 2, coupling=True)
    how = {"jacobian": ("extended", True)}.get(linearization, (linearization, False))
    exact, curved = SensorArray(p, sensors), SensorArray(p, [nonlinear(s, *how) for s in sensors])
    values = readings(p, task, exact, rng, 0.2)
    one, other = tracked(p, task, exact, values), tracked(p, task, curved, values)
    tolerance = 1e-11 if linearization == "jacobian" else 1e-6  # of differences, and of points along the root of a covariance
    assert difference(one, other, p) < tolerance
    assert difference(smoothed(p, task, exact, values), smoothed(p, task, curved, values), p) < tolerance
    np.testing.assert_allclose(other.contributions, one.contributions, rtol=tolerance, atol=tolerance)
    score = score_recordings(p, [task] * 2, [recorded(curved, values)] * 2, curved)
    np.testing.assert_allclose(score, one.log_likelihoods.sum(), rtol=tolerance, atol=tolerance)
    unit = state_scales(p, DT).reshape(-1, 3)
    executions = [OnlineExecution(p, task, DT, sensors=a) for a in (exact, curved)]
    for row in values:
        steps = [e.step(row) for e in executions]
        np.testing.assert_allclose(steps[1].position / unit[:, 2], steps[0].position / unit[:, 2], atol=tolerance * 10)
        np.testing.assert_allclose(steps[1].contributions, steps[0].contributions, rtol=tolerance, atol=tolerance)


# --- what more sensors tell -------------------------------------------------------------------------------------------


@OF_EVERY_KIND
@settings(max_examples=3)
@given(seeds)
def test_a_velocity_sensor_narrows_velocity_bands(kind, seed):
    """And widens none."""
    p, task = movement(kind, seed)
    rng, stds = np.random.default_rng(seed), state_scales(p, DT).reshape(-1, 3)
    camera = state_sensor(p, "camera", "position", 0.3 * stds[:, 2])
    gyro = state_sensor(p, "gyro", "velocity", 0.3 * stds[:, 1])
    few, more = SensorArray(p, [camera]), SensorArray(p, [camera, gyro])
    values = readings(p, task, more, rng)
    fewer = np.delete(values, range(p.n_dof, 2 * p.n_dof), axis=1)
    for run in (tracked, smoothed):
        without, with_it = run(p, task, few, fewer), run(p, task, more, values)
        for name in ("position_stds", "velocity_stds", "acceleration_stds"):
            narrower, wider = getattr(with_it, name), getattr(without, name)
            assert np.all(narrower <= wider * (1 + 1e-9) + 1e-9 * wider.max())
        assert np.mean(with_it.velocity_stds[1:]) < 0.9 * np.mean(without.velocity_stds[1:])


@OF_EVERY_KIND
@settings(max_examples=2)
@given(seeds, st.integers(1, 3))
def test_what_is_seen_never_makes_less_known(kind, seed, n_sensors):
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    array = SensorArray(p, random_sensors(rng, p, DT, n_sensors, coupling=True))
    values = readings(p, task, array, rng, 0.3)
    unit = state_scales(p, DT).reshape(-1, 3)
    bands = (smoothed(p, task, array, values), tracked(p, task, array, values), roll_out(p, task, DT))
    for narrow, wide in pairwise(bands):
        gained = (wide.covariances - narrow.covariances) / (unit[:, :, None] * unit[:, None, :])
        assert np.linalg.eigvalsh(gained).min() > -1e-9
