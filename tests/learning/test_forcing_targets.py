"""Inverting a scheme: what it has made gives back its own forcing term and its own path."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_primitive, seeds

from probdmp.demonstrations import Demonstration, SmoothPath, smooth_path, synthetic_letters
from probdmp.dmp import Configuration, linear_gaussian_model, task_for
from probdmp.gaussian import filter_sequence
from probdmp.learning.forcing_targets import forcing_targets, scheme_velocities

SCHEMES = ("exact", "semi_implicit_euler")
shapes = (st.integers(40, 200), st.sampled_from([0.25, 1.0, 4.0]))


def generated(seed, scheme, n_steps, slower):
    """A movement made by the scheme: its model, its states (T, D, 3), and what was asked of it."""
    rng = np.random.default_rng(seed)
    primitive = make_primitive(rng, discretization=scheme)
    task = task_for(primitive, *rng.uniform(-2, 2, (2, 2)), primitive.duration * slower)
    dt = float(task.duration) / (n_steps - 1)
    model = linear_gaussian_model(primitive, task, dt, n_steps)
    return primitive, task, dt, model, filter_sequence(model).filtered.means


@settings(max_examples=30)
@given(seeds, st.sampled_from(SCHEMES), *shapes)
def test_a_movement_gives_back_its_own_forcing_term(seed, scheme, n_steps, slower):
    primitive, task, dt, model, states = generated(seed, scheme, n_steps, slower)
    targets = forcing_targets(states[..., 2], states[..., 1], task.goal, dt, primitive.configuration)
    wanted = model.inputs[..., 0] - primitive.configuration.alpha_z**2 / 4 * task.goal
    assert targets.shape == (n_steps - 1, 2)
    np.testing.assert_allclose(targets, wanted, atol=1e-10 * np.abs(wanted).max() * n_steps)


@settings(max_examples=30)
@given(seeds, st.sampled_from(SCHEMES), *shapes)
def test_a_movement_gives_back_its_own_path(seed, scheme, n_steps, slower):
    """Inverted and run again, from the same first state."""
    primitive, task, dt, model, states = generated(seed, scheme, n_steps, slower)
    targets = forcing_targets(states[..., 2], states[..., 1], task.goal, dt, primitive.configuration)
    inputs = targets + primitive.configuration.alpha_z**2 / 4 * task.goal
    again = filter_sequence(replace(model, inputs=inputs[..., None])).filtered.means
    assert again.shape == (n_steps, 2, 3)
    np.testing.assert_allclose(again[..., 2], states[..., 2], atol=1e-10 * np.abs(states[..., 2]).max())


@settings(max_examples=30)
@given(seeds, st.integers(40, 200))
def test_semi_implicit_euler_gives_back_any_path_from_its_positions_alone(seed, n_steps):
    """Random walks included: its velocity is (p[t] - p[t-1]) / dt and nothing else."""
    rng = np.random.default_rng(seed)
    positions, dt = rng.standard_normal((n_steps, 2)).cumsum(axis=0), 0.01
    primitive = make_primitive(rng, discretization="semi_implicit_euler")
    velocities = scheme_velocities(SmoothPath(positions, np.zeros_like(positions)), dt, "semi_implicit_euler")
    np.testing.assert_allclose(velocities[1:] * dt, np.diff(positions, axis=0), atol=1e-12)
    targets = forcing_targets(positions, velocities, positions[-1], dt, primitive.configuration)
    task = task_for(primitive, positions[0], positions[-1], (n_steps - 1) * dt, velocities[0])
    model = linear_gaussian_model(primitive, task, dt, n_steps)
    inputs = targets + primitive.configuration.alpha_z**2 / 4 * positions[-1]
    path = filter_sequence(replace(model, inputs=inputs[..., None])).filtered.means[..., 2]
    np.testing.assert_allclose(path, positions, atol=1e-10 * np.abs(positions).max())


def test_exact_takes_the_velocities_of_the_smoothed_path():
    path = smooth_path(synthetic_letters(1, letters="a")[0], 0.05)
    np.testing.assert_array_equal(scheme_velocities(path, 0.01, "exact"), path.velocities)


def test_semi_implicit_euler_extrapolates_its_first_velocity():
    positions = (np.arange(6.0)[:, None] * 0.1) ** 2
    velocities = scheme_velocities(SmoothPath(positions, np.zeros_like(positions)), 0.1, "semi_implicit_euler")
    np.testing.assert_allclose(velocities[:, 0], np.arange(6) * 0.2 - 0.1, atol=1e-12)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_rest_at_the_goal_needs_no_forcing(scheme):
    still = np.full((50, 2), 3.0)
    targets = forcing_targets(still, np.zeros_like(still), still[-1], 0.01, Configuration(discretization=scheme))
    np.testing.assert_allclose(targets, 0, atol=1e-9)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_recorded_movement_is_inverted_to_a_small_residual(scheme):
    """Forcing held over each step leads back to the smoothed letter; with the exact scheme to within its step error."""
    demo = synthetic_letters(1, letters="e", dt=0.01)[0]
    path = smooth_path(demo, 0.05)
    velocities = scheme_velocities(path, demo.dt, scheme)
    configuration = Configuration(discretization=scheme)
    targets = forcing_targets(path.positions, velocities, path.positions[-1], demo.dt, configuration)
    primitive = make_primitive(np.random.default_rng(0), discretization=scheme)
    task = task_for(primitive, path.positions[0], path.positions[-1], demo.duration, velocities[0])
    model = linear_gaussian_model(primitive, task, demo.dt, demo.n_samples)
    inputs = targets + configuration.alpha_z**2 / 4 * path.positions[-1]
    again = filter_sequence(replace(model, inputs=inputs[..., None])).filtered.means[..., 2]
    error = np.abs(again - path.positions).max() / np.ptp(path.positions)
    assert error < (1e-10 if scheme == "semi_implicit_euler" else 5e-3)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_targets_scale_with_the_units(scheme, unit):
    rng = np.random.default_rng(0)
    positions, velocities = rng.standard_normal((2, 50, 2))
    configuration = Configuration(discretization=scheme)
    one = forcing_targets(positions, velocities, positions[-1], 0.01, configuration)
    other = forcing_targets(positions * unit, velocities * unit, positions[-1] * unit, 0.01, configuration)
    np.testing.assert_allclose(other, one * unit, atol=1e-12 * np.abs(one * unit).max())


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_slower_movement_has_the_same_forcing(scheme):
    """The forcing term is a function of the phase: the same path in twice the time needs the same."""
    demo = synthetic_letters(1, letters="s", dt=0.01)[0]
    slow = Demonstration(demo.positions, 0.02)
    targets = []
    for d in (demo, slow):
        path = smooth_path(d, 0.05)
        velocities = scheme_velocities(path, d.dt, scheme)
        targets.append(
            forcing_targets(path.positions, velocities, path.positions[-1], d.dt, Configuration(discretization=scheme))
        )
    np.testing.assert_allclose(targets[0], targets[1], atol=1e-9 * np.abs(targets[0]).max())
