"""Joints seen by where the tool of their arm is, and the reverse: bands of what is not measured hold what they say.

Executions are drawn from the model, so that all that can be wrong with a band is its filter: linearised, as kinematics are not
linear. Of a Gaussian 95 % lie within 1.96 and 99.7 % within 3 standard deviations.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from strategies import seeds

from probdmp.demonstrations import Demonstration
from probdmp.dmp import Configuration, task_for
from probdmp.execution import (
    NonlinearSensor,
    OnlineExecution,
    SensorArray,
    filter_recordings,
    planar_arm_sensor,
    recording_of_readings,
    roll_out,
    sample_states,
    score_recordings,
    smooth_recordings,
)
from probdmp.learning import LearningOptions, fit_primitive

DT = 0.04
LINKS = (0.4, 0.3, 0.2)
LINEARIZATIONS = pytest.mark.parametrize("linearization", ["extended", "unscented"])


def reaches(start, goal, bump, start_std, goal_std, noise, names, units):
    """Twelve demonstrations of a second from start to goal by a detour, each on its own way."""
    rng, s = np.random.default_rng(0), np.linspace(0, 1, 51)[:, None]
    jerk, demonstrations = 10 * s**3 - 15 * s**4 + 6 * s**5, []
    for _ in range(12):
        a, b = (np.array(x) + std * rng.standard_normal(len(x)) for x, std in ((start, start_std), (goal, goal_std)))
        path = a + (b - a) * jerk + np.sin(np.pi * s) ** 2 * (1 + 0.3 * rng.standard_normal()) * np.array(bump)
        demonstrations.append(Demonstration(path + noise * rng.standard_normal(path.shape), 0.02, names=names, units=units))
    return demonstrations


def learned(demonstrations):
    configuration = Configuration(n_basis=8, weight_uncertainty="joint")
    return fit_primitive(demonstrations, configuration, LearningOptions("hierarchical"))[0]


@pytest.fixture(scope="module")
def joints():
    """A movement of three joints; its executions differ by a tenth of a radian."""
    path = [0.3, 0.9, -0.6], [1.2, 0.4, 0.5], [-0.15, 0.3, 0.09]
    return learned(reaches(*path, 0.05, 0.1, 1e-3, ("q1", "q2", "q3"), "rad"))


def executions(p, array, n, seed=1):
    """True states (T, n, D, 3), and recordings of what the sensors saw of them, from starts that nobody knows."""
    task, rng = task_for(p, np.full(p.n_dof, np.nan)), np.random.default_rng(seed)
    states = sample_states(p, task, DT, n, rng)
    readings = array.draw(states.reshape(*states.shape[:2], -1), rng)
    recordings = [recording_of_readings(array, {array.names[0]: r}, DT) for r in readings]
    return [task] * n, np.moveaxis(states, 0, 1), recordings


def shares(states, believed):
    """Of positions within 1.96 and within 3 standard deviations."""
    stds = np.sqrt(believed.covariances[..., 2, 2])
    far = np.abs(states[..., 2] - believed.means[..., 2]) / stds
    return np.mean(far < 1.96), np.mean(far < 3)


# --- joints, seen by where the tool is --------------------------------------------------------------------------------


@LINEARIZATIONS
@pytest.mark.parametrize(
    ("std", "n"), [(0.01, 30), *(pytest.param(s, 200, marks=pytest.mark.slow) for s in (0.003, 0.01, 0.03))]
)
def test_bands_of_joints_hold_what_they_say(joints, linearization, std, n):
    """A camera of millimetres to centimetres; two numbers for three joints."""
    array = SensorArray(joints, [planar_arm_sensor("camera", LINKS, std, linearization=linearization)])
    tasks, states, recordings = executions(joints, array, n)
    filtered = filter_recordings(joints, tasks, recordings, array).filtered
    near, far = shares(states, filtered)
    assert near == pytest.approx(0.95, abs=0.02)
    assert far >= 0.99
    planned = roll_out(joints, tasks[0], DT).position_stds.mean()
    assert np.sqrt(filtered.covariances[..., 2, 2]).mean() < 0.75 * planned  # it has told something


def test_bands_in_hindsight_do_so_too(joints):
    array = SensorArray(joints, [planar_arm_sensor("camera", LINKS, 0.01)])
    tasks, states, recordings = executions(joints, array, 90)
    smoothed, filtered = (run(joints, tasks, recordings, array) for run in (smooth_recordings, filter_recordings))
    near, far = shares(states, smoothed)
    assert near == pytest.approx(0.95, abs=0.02)
    assert far >= 0.99
    before = filtered.filtered.covariances[..., 2, 2].mean()
    assert smoothed.covariances[..., 2, 2].mean() < before


def test_both_ways_agree_where_bands_are_narrow(joints):
    """Within bands of a twentieth of a radian an arm is all but linear."""
    arrays = [
        SensorArray(joints, [planar_arm_sensor("camera", LINKS, 0.01, linearization=how)]) for how in ("extended", "unscented")
    ]
    tasks, _, recordings = executions(joints, arrays[0], 4)
    one, other = (filter_recordings(joints, tasks, recordings, array).filtered for array in arrays)
    stds = np.sqrt(one.covariances[..., 2, 2])
    assert np.median(np.abs(one.means[..., 2] - other.means[..., 2]) / stds) < 0.1
    np.testing.assert_allclose(np.sqrt(other.covariances[..., 2, 2]).mean(), stds.mean(), rtol=0.02)
    scores = [score_recordings(joints, tasks, recordings, array) for array in arrays]
    np.testing.assert_allclose(scores[0], scores[1], atol=0.05 * np.abs(scores[0]).max())


@LINEARIZATIONS
def test_a_tool_that_was_pushed_aside_moves_the_joints(joints, linearization):
    """Online: the command follows what the camera sees, towards where the tool is."""
    sensor = planar_arm_sensor("camera", LINKS, 0.005, linearization=linearization)
    array, task = SensorArray(joints, [sensor]), task_for(joints, np.full(3, np.nan))
    calm, pushed = (OnlineExecution(joints, task, DT, sensors=array) for _ in range(2))
    planned = roll_out(joints, task, DT).positions
    aside = np.array([0.0, 0.1])
    for q in planned[:15]:
        steps = calm.step({"camera": sensor.function(q)}), pushed.step({"camera": sensor.function(q) + aside})
    tools = [sensor.function(step.position) for step in steps]
    there = sensor.function(planned[15])
    np.testing.assert_allclose(tools, [there, there + aside], atol=0.02)


# --- the tool, seen by the angles of joints ---------------------------------------------------------------------------


UPPER, LOWER = 0.5, 0.4


def inverse_kinematics(tool):
    """Angles of shoulder and elbow, from -pi to pi; not a number out of reach."""
    x, y = tool
    elbow = np.arccos((x * x + y * y - UPPER**2 - LOWER**2) / (2 * UPPER * LOWER))
    shoulder = np.arctan2(y, x) - np.arctan2(LOWER * np.sin(elbow), UPPER + LOWER * np.cos(elbow))
    return wrapped_angles(np.array([shoulder, elbow]))


def wrapped_angles(angles):
    return np.mod(angles + np.pi, 2 * np.pi) - np.pi


@pytest.fixture(scope="module")
def tool():
    """A movement of the tool behind the base, where the angle of the shoulder jumps from pi to -pi."""
    path = [-0.5, 0.3], [-0.45, -0.4], [-0.1, 0.03]
    return learned(reaches(*path, 0.015, 0.03, 5e-4, ("x", "y"), "m"))


def encoders(std, linearization, period=2 * np.pi):
    return NonlinearSensor(
        "encoders", inverse_kinematics, [std**2] * 2, linearization=linearization, outputs=("q1", "q2"), period=period
    )


def seen_by_encoders(p, std, linearization, n):
    array = SensorArray(p, [encoders(std, linearization)])
    tasks, states, recordings = executions(p, array, n)
    turned = [{"encoders": wrapped_angles(np.column_stack(list(r.channels.values())))} for r in recordings]
    assert np.abs(np.diff([t["encoders"][:, 0] for t in turned])).max() > 6  # they do jump
    return array, tasks, states, [recording_of_readings(array, t, DT) for t in turned]


@LINEARIZATIONS
@pytest.mark.parametrize(
    ("std", "n"), [(0.02, 20), *(pytest.param(s, 200, marks=pytest.mark.slow) for s in (0.002, 0.02, 0.1))]
)
def test_bands_of_the_tool_hold_what_they_say(tool, linearization, std, n):
    array, tasks, states, recordings = seen_by_encoders(tool, std, linearization, n)
    near, far = shares(states, filter_recordings(tool, tasks, recordings, array).filtered)
    assert near == pytest.approx(0.95, abs=0.02)
    assert far >= 0.99


@settings(max_examples=5)
@given(seeds)
def test_whole_turns_of_a_reading_change_nothing(tool, seed):
    rng = np.random.default_rng(seed)
    array = SensorArray(tool, [encoders(0.02, "extended")])
    task = task_for(tool, np.full(2, np.nan))
    one, other = (OnlineExecution(tool, task, DT, sensors=array) for _ in range(2))
    for position in roll_out(tool, task, DT).positions[::5]:
        angles = inverse_kinematics(position)
        a, b = one.step(angles), other.step(angles + 2 * np.pi * rng.integers(-3, 4, 2))
        np.testing.assert_allclose(a.position, b.position, atol=1e-9)
        np.testing.assert_allclose(a.log_likelihood, b.log_likelihood, atol=1e-7)
