"""One step of the spring-damper system, against the matrix exponential and the paper's scalar equations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from probdmp.dmp.transformation_system import DISCRETIZATIONS
from probdmp.errors import InputError

alphas = st.floats(1.0, 60.0)
durations = st.floats(0.05, 20.0)
stiffnesses = st.floats(1e-4, 1.6)
"""alpha_z dt / duration; semi-implicit Euler is stable below 1.66."""


def step_of(scheme, alpha_z, duration, dt):
    system = DISCRETIZATIONS[scheme].step(alpha_z, np.asarray(duration), np.asarray(dt))
    return system.transition, system.input_vector


@given(alphas, durations, st.floats(1e-4, 20.0))
def test_exact_is_the_matrix_exponential(alpha_z, duration, stiffness):
    dt = stiffness * duration / alpha_z
    a, b = step_of("exact", alpha_z, duration, dt)
    # In units of the step, where all numbers are about one: velocity * dt, input * (dt / duration)^2
    k = alpha_z * dt / duration
    zoh = expm(np.array([[-k, -(k**2) / 4, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    units = np.array([[1.0, dt], [1 / dt, 1.0]])
    np.testing.assert_allclose(a[1:, 1:] * units, zoh[:2, :2], rtol=1e-10, atol=1e-13)
    gain = (dt / duration) ** 2
    np.testing.assert_allclose(np.array([b[1] * dt, b[2]]) / gain, zoh[:2, 2], rtol=1e-8, atol=1e-13)


@given(st.sampled_from(sorted(DISCRETIZATIONS)), alphas, durations, stiffnesses)
def test_acceleration_is_the_mean_over_the_step(scheme, alpha_z, duration, stiffness):
    dt = stiffness * duration / alpha_z
    a, b = step_of(scheme, alpha_z, duration, dt)
    np.testing.assert_allclose(a[0] * dt, a[1] - [0, 1, 0], rtol=1e-9, atol=1e-12 * abs(a[1]).max())
    np.testing.assert_allclose(b[0] * dt, b[1], rtol=1e-13)
    assert not a[:, 0].any()  # the acceleration of the step before is forgotten


@given(alphas, durations, stiffnesses, st.integers(0, 2**32 - 1))
def test_semi_implicit_euler_is_the_scalar_recursion_step_by_step(alpha_z, duration, stiffness, seed):
    dt, rng = stiffness * duration / alpha_z, np.random.default_rng(seed)
    a, b = step_of("semi_implicit_euler", alpha_z, duration, dt)
    start, goal, scaled_velocity, *forcing = rng.standard_normal(33)
    state = np.array([0.0, scaled_velocity / duration, start])
    p, z, tau, beta_z = start, scaled_velocity, 1 / duration, alpha_z / 4
    for f in forcing:
        state = a @ state + b * (alpha_z * beta_z * goal + alpha_z * beta_z * f)
        z_dot = tau * (alpha_z * (beta_z * (goal - p) - z) + alpha_z * beta_z * f)
        z = z + z_dot * dt
        p = p + tau * z * dt
        np.testing.assert_allclose(state * [duration**2 / alpha_z**2, duration / alpha_z, 1], [
            tau * z_dot * duration**2 / alpha_z**2, tau * z * duration / alpha_z, p
        ], atol=1e-11)  # fmt: skip


@given(st.sampled_from(sorted(DISCRETIZATIONS)), alphas, durations, stiffnesses)
def test_the_goal_is_the_fixed_point_for_any_duration(scheme, alpha_z, duration, stiffness):
    """B carries tau^2; as printed in the paper the fixed point would be goal / tau^2."""
    a, b = step_of(scheme, alpha_z, duration, stiffness * duration / alpha_z)
    goal = np.array([0.0, 0.0, 1.0])
    moved = a @ goal + b * alpha_z**2 / 4
    scale = np.array([duration**2 / alpha_z**2, duration / alpha_z, 1.0])
    np.testing.assert_allclose(moved * scale, goal * scale, atol=1e-12)
    assert np.abs(np.linalg.eigvals(a)).max() < 1


@pytest.mark.parametrize("scheme", DISCRETIZATIONS)
def test_from_rest_it_comes_to_the_goal(scheme):
    a, b = step_of(scheme, 25.0, 3.0, 0.01)
    state = np.zeros(3)
    for _ in range(900):
        state = a @ state + b * 25**2 / 4 * 7.0
    np.testing.assert_allclose(state, [0, 0, 7.0], atol=1e-6)


def test_exact_composes_two_half_steps_are_one():
    half, b_half = step_of("exact", 25.0, 1.3, 0.005)
    whole, b_whole = step_of("exact", 25.0, 1.3, 0.01)
    np.testing.assert_allclose((half @ half)[1:], whole[1:], rtol=1e-12)
    np.testing.assert_allclose((half @ b_half + b_half)[1:], b_whole[1:], rtol=1e-12)


def test_semi_implicit_euler_refuses_steps_at_which_it_is_unstable():
    limit = np.sqrt(32) - 4
    a, _ = step_of("semi_implicit_euler", 25.0, 1.0, limit * 0.9999 / 25)
    assert np.abs(np.linalg.eigvals(a)).max() <= 1
    with pytest.raises(InputError, match=r"Expected alpha_z dt / duration <= 1\.657.*got 1\.66\..*smaller dt, or.*exact"):
        step_of("semi_implicit_euler", 25.0, 1.0, limit * 1.001 / 25)
    k = limit * 1.001  # the scalar equations themselves, at that step: |eigenvalue| > 1
    unstable = np.array([[1 - k, -(k**2) / 4], [1 - k, 1 - k**2 / 4]])
    assert np.abs(np.linalg.eigvals(unstable)).max() > 1


def test_one_unstable_member_of_a_batch_is_enough():
    with pytest.raises(InputError, match=r"got 2\.5\."):
        step_of("semi_implicit_euler", 25.0, np.array([1.0, 0.1]), np.array([0.01, 0.01]))


def test_exact_is_stable_at_any_step():
    for dt in (0.1, 0.5, 1.0, 1.59):  # alpha_z dt / duration up to 40, the most that is allowed
        a, b = step_of("exact", 25.0, 1.0, dt)
        assert np.abs(np.linalg.eigvals(a)).max() < 1
        np.testing.assert_allclose((a @ [0, 0, 1] + b * 25**2 / 4)[2], 1, rtol=1e-12)


# --- what is held over a step -----------------------------------------------------------------------------------------


def test_stencils():
    assert DISCRETIZATIONS["semi_implicit_euler"].forcing_stencil == ((0.0, 1.0),)
    places, weights = zip(*DISCRETIZATIONS["exact"].forcing_stencil, strict=True)
    assert places == (0.0, 0.5, 1.0)
    np.testing.assert_allclose(weights, [-1 / 6, 8 / 6, -1 / 6], rtol=1e-15)
    assert [DISCRETIZATIONS[name].noise_offset for name in ("exact", "semi_implicit_euler")] == [0.5, 0.0]


@pytest.mark.parametrize("stencil", ["own", "middle alone"])
def test_the_exact_scheme_follows_a_wave_the_closer_the_smaller_its_step(stencil):
    """Against the steady answer to u = exp(i w t): an eighth of the error or less at half the step, else a quarter."""
    alpha_z, duration, w = 25.0, 1.3, 17.0
    wanted = duration**-2 / (-(w**2) + 1j * w * alpha_z / duration + alpha_z**2 / 4 / duration**2)
    places = DISCRETIZATIONS["exact"].forcing_stencil if stencil == "own" else ((0.5, 1.0),)
    errors = []
    for dt in (0.02, 0.01):
        a, b = step_of("exact", alpha_z, duration, dt)
        held = sum(weight * np.exp(1j * w * dt * place) for place, weight in places)
        state = np.linalg.solve(np.exp(1j * w * dt) * np.eye(3) - a, b * held)
        errors.append(abs(state[2] - wanted) / abs(wanted))
    assert errors[0] < (2e-3 if stencil == "own" else 1e-2)
    assert errors[0] / errors[1] > 7 if stencil == "own" else 3.5 < errors[0] / errors[1] < 4.5


@given(st.floats(1e-3, 40.0))
def test_noise_held_over_a_step_spreads_the_damped_velocity_as_far_as_white_noise(stiffness):
    """x' = -x + noise over steps of length y: white noise of unit density leaves 1/2, held noise its geometric series."""
    push, decay = 1 - np.exp(-stiffness), np.exp(-stiffness)
    held = push**2 / (1 - decay**2)
    wanted = 0.5 / held
    assert DISCRETIZATIONS["exact"].noise_variance(np.array(stiffness)) == pytest.approx(2 * wanted, rel=1e-9)


@pytest.mark.parametrize("stiffness", [25 / 3, 25 / 12, 40.0])
def test_bands_stay_bounded_at_coarse_steps(stiffness):
    """The correction tends to a constant where a step is longer than the system's memory, and no band can explode."""
    variance = DISCRETIZATIONS["exact"].noise_variance
    assert 1 <= variance(np.array(stiffness)) < 1.3


def test_noise_of_euler_is_inverse_to_the_step():
    variance = DISCRETIZATIONS["semi_implicit_euler"].noise_variance
    np.testing.assert_allclose(variance(np.array([0.1, 0.2, 1.0])) * [0.1, 0.2, 1.0], variance(np.array(1.0)), rtol=1e-14)
    exact = DISCRETIZATIONS["exact"].noise_variance  # so is that of the exact scheme at small steps
    np.testing.assert_allclose(exact(np.array([1e-4, 1e-3])) * [1e-4, 1e-3], 2.0, rtol=1e-3)


@pytest.mark.parametrize("scheme", DISCRETIZATIONS)
def test_a_batch_is_its_members(scheme):
    rng = np.random.default_rng(0)
    duration, dt = rng.uniform(0.5, 2, (2, 3)), rng.uniform(0.001, 0.02, (2, 3))
    a, b = step_of(scheme, 25.0, duration, dt)
    assert a.shape == (2, 3, 3, 3)
    for i in np.ndindex(2, 3):
        one, into = step_of(scheme, 25.0, duration[i], dt[i])
        np.testing.assert_allclose(a[i], one, rtol=1e-15)
        np.testing.assert_allclose(b[i], into, rtol=1e-15)
