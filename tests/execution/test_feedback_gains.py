"""The gain A K of the feedback: the textbook's, and what executions do."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import kalman_filter, system_at
from strategies import make_joint_primitive, make_primitive, primitives, random_sensors, seeds

from probdmp import ProbabilisticDMP, synthetic_letters
from probdmp.dmp import linear_gaussian_model, step_count, task_for
from probdmp.errors import InputError
from probdmp.execution import (
    LinearSensor,
    NonlinearSensor,
    OnlineExecution,
    SensorArray,
    feedback_gains,
    sample_states,
    state_sensor,
)

DT, STEPS = 0.05, 15
KINDS = pytest.mark.parametrize("kind", ["independent", "joint", "felt"])
NAN = np.nan


def movement(kind, seed, n_dof=2):
    """A random primitive with its task; the start is partly unknown."""
    rng = np.random.default_rng(seed)
    changes = {"duration": DT * (STEPS - 1), "phase_step": 1 / (STEPS - 1)}
    if kind == "independent":
        p = make_primitive(rng, n_dof, 5, **changes)
    else:
        p = make_joint_primitive(rng, n_dof, 3, ("force",) if kind == "felt" else (), **changes)
    return p, task_for(p, np.where(np.arange(n_dof) % 2, NAN, p.start))


def commands(p, task, array, values):
    """(n, D, 3) states commanded after readings (n, O), and the innovations (n, O)."""
    run = OnlineExecution(p, task, DT, sensors=array)
    steps = [run.step({name: o[part] for name, part in array.slices.items()}) for o in values]
    states = np.stack([np.stack([s.acceleration, s.velocity, s.position], axis=-1) for s in steps])
    return states, np.stack([s.innovations for s in steps]), steps


def scale_of(gains):
    """(1, 1, 3, O): the largest of each quantity and output."""
    return np.abs(gains).max(axis=(0, 1), keepdims=True) + 1e-300


# --- against the definition -------------------------------------------------------------------------------------------


def textbook_gains(system):
    """A K of one series at every tick but the last, (T - 1, n, O)."""
    A, B, _, U, C, R, _, V = system
    filtered, gains = kalman_filter(system, np.zeros((len(U) + 1, len(C))))[1], []
    for t in range(len(U)):
        V = A @ filtered[t - 1] @ A.T + B @ U[t - 1] @ B.T if t > 0 else V
        gains.append(A @ V @ C.T @ np.linalg.inv(C @ V @ C.T + R))
    return np.array(gains)


@settings(max_examples=20)
@given(primitives(), st.booleans())
def test_with_independent_weights_it_is_the_textbooks_A_K(primitive, knows_start):
    task, dt = task_for(primitive, None if knows_start else np.full(primitive.n_dof, NAN)), 0.02
    gains, n_steps = feedback_gains(primitive, task, dt), step_count(float(task.duration), dt)
    model = linear_gaussian_model(primitive, task, dt, n_steps)
    wanted = np.zeros((n_steps - 1, primitive.n_dof, 3, primitive.n_dof))
    for d in range(primitive.n_dof):
        wanted[:, d, :, d] = textbook_gains(system_at(model, (d,)))[..., 0]
    assert gains.shape == wanted.shape
    assert (np.abs(gains - wanted) / scale_of(wanted)).max() < 1e-9


def test_of_position_and_velocity_it_is_the_textbooks_too():
    p, task = movement("independent", 4)
    sensors = [state_sensor(p, "place", "position", 0.02), state_sensor(p, "speed", "velocity", 0.1)]
    gains = feedback_gains(p, task, DT, SensorArray(p, sensors))
    model = linear_gaussian_model(p, task, DT, STEPS)
    for d in range(p.n_dof):
        system = system_at(model, (d,))._replace(C=np.eye(3)[[2, 1]], R=np.diag([0.02, 0.1]) ** 2)
        wanted = textbook_gains(system)
        np.testing.assert_allclose(gains[:, d][..., [d, 2 + d]], wanted, rtol=1e-8, atol=1e-10 * np.abs(wanted).max())
        assert not gains[:, d][..., [1 - d, 3 - d]].any()


@KINDS
@settings(max_examples=15)
@given(seed=seeds, coupling=st.booleans(), tick=st.integers(0, STEPS - 2))
def test_a_displaced_execution_is_commanded_by_gain_times_innovation_more(kind, seed, coupling, tick):
    """Whatever was measured before."""
    p, task = movement(kind, seed)
    rng = np.random.default_rng(seed)
    array = SensorArray(p, random_sensors(rng, p, DT, 2, coupling))
    values = array.draw(sample_states(p, task, DT, 1, rng).reshape(1, STEPS, -1), rng)[0, : tick + 1]
    undisturbed, innovations, _ = commands(p, task, array, values)
    values[tick] += rng.standard_normal(values.shape[1]) * np.sqrt(np.diagonal(array.covariance))
    displaced, others, _ = commands(p, task, array, values)
    gains = feedback_gains(p, task, DT, array)
    terms = gains[tick] * (others - innovations)[tick]
    size = np.abs(gains).max(axis=(0, 1)) @ np.abs((others - innovations)[tick])
    assert (np.abs((displaced - undisturbed)[tick] - terms.sum(axis=-1)) / (size + 1e-300)).max() < 1e-7


@KINDS
@settings(max_examples=15)
@given(seed=seeds, coupling=st.booleans())
def test_what_an_innovation_adds_to_the_command_it_takes_from_its_covariance(kind, seed, coupling):
    """V[t+1] without the readings of tick t, less V[t+1] with them, is (A K) S (A K)^T: the same gain from the covariances."""
    p, task = movement(kind, seed)
    array = SensorArray(p, random_sensors(np.random.default_rng(seed), p, DT, 2, coupling))
    gains, values = feedback_gains(p, task, DT, array), np.zeros((STEPS - 1, len(array.outputs)))
    for tick in (0, 1, 6, STEPS - 2):
        seen = commands(p, task, array, values[: tick + 1])[2][-1]
        blind = values[: tick + 1].copy()
        blind[tick] = NAN
        unseen = commands(p, task, array, blind)[2][-1]
        S = seen.innovation_covariance
        taken = gains[tick] @ S @ gains[tick].mT
        variances = np.diagonal(unseen.covariance, axis1=-2, axis2=-1)
        unit = np.sqrt(variances[..., :, None] * variances[..., None, :]) + 1e-300
        assert (np.abs(unseen.covariance - seen.covariance - taken) / unit).max() < 1e-6


# --- what sets it -----------------------------------------------------------------------------------------------------


@KINDS
def test_a_sensor_that_says_nothing_has_no_gain(kind):
    p, task = movement(kind, 0)
    for std in (1e9, np.inf):
        sensors = [LinearSensor("deaf", np.eye(3 * p.n_dof)[2::3], np.full(p.n_dof, std**2))]
        gains = feedback_gains(p, task, DT, SensorArray(p, sensors))
        assert np.abs(gains[..., : p.n_dof]).max() < 1e-12


@pytest.mark.parametrize("kind", ["independent", "joint"])
def test_a_better_sensor_has_a_larger_gain(kind):
    """Of the position from the position of a movement of one degree of freedom, as soon as anything is unknown."""
    p, task = movement(kind, 3, n_dof=1)
    gains = [
        feedback_gains(p, task, DT, SensorArray(p, [state_sensor(p, "position", "position", std)]))[1:, 0, 2, 0]
        for std in (1.0, 0.3, 0.1, 0.03)
    ]
    assert np.all(np.diff(gains, axis=0) > 0)


def test_a_forcing_term_that_strays_more_has_a_larger_gain():
    p, task = movement("independent", 3, n_dof=1)
    gains = [
        feedback_gains(replace(p, forcing_precisions=p.forcing_precisions * factor), task, DT)[1:, 0, 2, 0]
        for factor in (100.0, 1.0, 0.01)
    ]
    assert np.all(np.diff(gains, axis=0) > 0)


def test_where_degrees_of_freedom_vary_together_one_moves_the_other():
    p, task = movement("joint", 1)
    block = p.variation.covariance.reshape(2, -1, 2, p.variation.means.shape[1])
    apart = block * np.eye(2)[:, None, :, None]
    alone = replace(p, variation=replace(p.variation, covariance=apart.reshape(p.variation.covariance.shape)))
    coupled, uncoupled = (feedback_gains(one, task, DT) for one in (p, alone))
    assert np.abs(coupled[:, 0, 2, 1]).max() > 0.01
    assert np.abs(uncoupled[:, 0, :, 1]).max() < 1e-12
    assert np.abs(uncoupled[:, 1, :, 0]).max() < 1e-12


def test_a_start_that_was_told_leaves_nothing_to_learn_about_it():
    p, _ = movement("joint", 2)
    gains = feedback_gains(p, task_for(p, p.start), DT)
    assert not gains[0].any()
    assert gains[1:].any()


def test_a_learned_channel_moves_the_movement():
    p, task = movement("felt", 5)
    array = SensorArray(p)
    assert array.outputs == ("q0", "q1", "force")
    assert np.abs(feedback_gains(p, task, DT, array)[:, :, 2, 2]).max() > 1e-3


# --- what it does not know --------------------------------------------------------------------------------------------


@KINDS
def test_gains_that_depend_on_what_is_measured_are_refused(kind):
    p, task = movement(kind, 0)
    nonlinear = NonlinearSensor("camera", lambda q: q**2, np.ones(2))
    gated = state_sensor(p, "position", "position", 0.1, gate=3.0)
    for sensor in (nonlinear, gated):
        with pytest.raises(InputError, match=f"Expected linear sensors without gates, .* got '{sensor.name}'"):
            feedback_gains(p, task, DT, SensorArray(p, [sensor]))


def test_the_estimator_tells_those_of_its_executions():
    """Also where it is executed without a start: then the first reading tells it."""
    dmp = ProbabilisticDMP(8).fit(synthetic_letters(4, letters="a"))
    sensors = [state_sensor(dmp.primitive_, "position", "position", 0.1)]
    told = {"goal": [10.0, 2.0], "duration": 0.5, "sensors": sensors}
    gains = dmp.feedback_gains(**told)
    assert gains.shape == (50, 2, 3, 2)
    assert gains[0, 0, 2, 0] > 0.9
    one, other = (dmp.execute(**told) for _ in range(2))
    one.step(dmp.primitive_.start)
    other.step(dmp.primitive_.start)
    a, b = one.step(dmp.primitive_.start + np.array([0.2, 0.0])), other.step(dmp.primitive_.start)
    np.testing.assert_allclose(a.position - b.position, gains[1, :, 2, 0] * 0.2, rtol=1e-7)
    assert not dmp.feedback_gains(start=dmp.primitive_.start)[0].any()
