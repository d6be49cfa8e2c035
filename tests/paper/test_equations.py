"""The equations of "Background" and "Deriving the Probabilistic DMP Model", one test each, in the order of the paper."""

import math
from dataclasses import replace

import numpy as np
import pytest
from paper import equations as paper
from scipy.integrate import solve_ivp
from strategies import PAPERS_WEIGHTS, make_primitive

from probdmp import Demonstration, ProbabilisticDMP
from probdmp.dmp import control_inputs, linear_gaussian_model, task_for
from probdmp.dmp.basis import basis_centers, basis_widths
from probdmp.dmp.forcing_term import forcing_term
from probdmp.dmp.phase import phases_at
from probdmp.dmp.state_space import POSITION_SENSOR
from probdmp.dmp.transformation_system import DISCRETIZATIONS
from probdmp.execution import roll_out
from probdmp.gaussian import sample_sequences

SCHEMES = ("semi_implicit_euler", "exact")


def step_matrices(scheme, alpha_z, duration, dt):
    """A and B of the library."""
    step = DISCRETIZATIONS[scheme].step(alpha_z, np.asarray(duration), np.asarray(dt))
    return step.transition, step.input_vector


# --- equation 1: the transformation system ----------------------------------------------------------------------------


@pytest.mark.parametrize("duration", [0.3, 1.0, 5.0])
def test_equation_1_transformation_system_without_forcing(duration):
    """z' / tau = alpha_z (beta_z (g - p) - z) + s f(x),  p' / tau = z;  here with f = 0, whose solution is known.

    With beta_z = alpha_z / 4 the pole k = alpha_z tau / 2 is double: p = g + (p_0 - g) (1 + k t) exp(-k t).
    """
    alpha_z, p_0, g, dt = 25.0, -2.0, 3.0, duration / 200
    A, B = step_matrices("exact", alpha_z, duration, dt)
    state, path = np.array([0.0, 0.0, p_0]), [p_0]
    for _ in range(400):
        state = A @ state + B * (alpha_z * alpha_z / 4 * g)
        path.append(state[2])
    k, t = alpha_z / (2 * duration), dt * np.arange(401)
    np.testing.assert_allclose(path, g + (p_0 - g) * (1 + k * t) * np.exp(-k * t), rtol=0, atol=1e-12)


@pytest.mark.parametrize("dt", [0.001, 0.01])
def test_equation_1_transformation_system_with_a_learned_forcing_term(default, dt):
    """z' / tau = alpha_z (beta_z (g - p) - z) + s f(x),  p' / tau = z, solved by SciPy in continuous time.

    At 100 Hz as at 1 kHz: what is held over a step is such that the path hardly depends on it.
    """
    primitive = default.primitive_
    goal, duration = primitive.goal + np.array([3.0, -2.0]), 1.5
    rolled = default.rollout(goal=goal, duration=duration, dt=dt)
    tau, alpha_z = 1 / duration, primitive.configuration.alpha_z
    for d in range(primitive.n_dof):

        def equation_1(t, y, d=d):
            p, z = y
            forcing = paper.f(paper.phase(t, duration), primitive.weight_means[d])
            return [tau * z, tau * (alpha_z * (alpha_z / 4 * (goal[d] - p) - z) + forcing)]

        start = [primitive.start[d], primitive.start_velocities[d]]  # z = p' / tau
        solution = solve_ivp(equation_1, (0, duration), start, t_eval=rolled.times, rtol=1e-9, atol=1e-9, max_step=0.01)
        np.testing.assert_allclose(rolled.positions[:, d], solution.y[0], rtol=0, atol=2e-4 * primitive.ranges[d])


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_goal_attracts_whatever_the_forcing_term(scheme):
    """Attractor dynamics: the phase takes the forcing term away, and g is what is left."""
    primitive = make_primitive(np.random.default_rng(1), discretization=scheme)
    goal = primitive.goal + np.array([5.0, -4.0])
    model = linear_gaussian_model(primitive, task_for(primitive, goal=goal), primitive.duration / 100, 401)
    state = model.initial_mean
    for drift in model.drifts():
        state = (model.transition @ state[..., None])[..., 0] + drift
    np.testing.assert_allclose(state, [[0, 0, goal[0]], [0, 0, goal[1]]], atol=1e-4)


def test_duration_and_goal_are_given_and_the_weights_are_the_shape(published):
    """Given tau and g the DMP is parametrised through weights: another duration is the same path at another speed."""
    own = published.rollout(duration=1.0, dt=0.01)
    slow = published.rollout(duration=4.0, dt=0.04)
    np.testing.assert_allclose(slow.positions, own.positions, rtol=1e-9)
    np.testing.assert_allclose(4 * slow.velocities, own.velocities, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(16 * slow.accelerations, own.accelerations, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("configuration", ["published", "default"])
def test_weights_represent_the_shape_of_any_smooth_movement(configuration):
    """Weights w are learned to represent the shape of any smooth movement: here sums of four waves, to 1 % of the range."""
    rng, t = np.random.default_rng(0), np.linspace(0, 1, 201)
    for _ in range(5):
        waves = rng.standard_normal(4) @ np.sin(2 * np.pi * np.outer(rng.uniform(0.2, 1.5, 4), t) + rng.uniform(0, 6, (4, 1)))
        model = ProbabilisticDMP.as_published() if configuration == "published" else ProbabilisticDMP(**PAPERS_WEIGHTS)
        model.fit([waves[:, None]], dt=0.01)
        assert model.fit_report_.reproduction_errors.max() < 0.01


# --- f, psi, x, s -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n_basis", [2, 10, 30])
def test_basis_functions_psi(n_basis):
    """psi_i = exp(-h_i (x - c_i)^2)."""
    centers = basis_centers(n_basis)
    widths = basis_widths(centers)
    for x in (1.0, 0.6, 0.25, 0.02):
        np.testing.assert_allclose(np.exp(-widths * (x - centers) ** 2), paper.psi(x, n_basis), rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("n_basis", [2, 10, 30])
def test_forcing_term_f(n_basis):
    """f(x) = sum_i psi_i w_i x / sum_i psi_i."""
    primitive = make_primitive(np.random.default_rng(2), n_basis=n_basis)
    for x in (1.0, 0.6, 0.25, 0.02):
        means = forcing_term(primitive, np.array([x])).means[0]
        np.testing.assert_allclose(means, [paper.f(x, w) for w in primitive.weight_means], rtol=1e-12)


@pytest.mark.parametrize("duration", [0.2, 1.0, 7.0])
def test_phase_decay(duration):
    """x' / tau = -alpha_x x, with x(0) = 1 and, our choice of alpha_x, x = 0.01 at the end."""
    times, rate = np.linspace(0, duration, 20), paper.ALPHA_X / duration
    solution = solve_ivp(lambda t, x: -rate * x, (0, duration), [1.0], t_eval=times, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(phases_at(times, duration), solution.y[0], rtol=1e-7)
    assert phases_at(np.array(duration), duration) == pytest.approx(0.01, rel=1e-14)


def test_amplitude_s():
    """s = (g - p_0) / (g_fit - p_0,fit) = (g - p_0) / Delta g."""
    primitive = make_primitive(np.random.default_rng(3), scaling="paper")
    start, goal = np.array([0.5, 2.0]), np.array([-1.0, 2.5])
    s = primitive.amplitudes(task_for(primitive, start, goal))
    np.testing.assert_allclose(s, (goal - start) / primitive.goal_displacements, rtol=1e-15)


def test_s_is_one_while_fitting_and_delta_g_is_stored():
    """During this fitting process, s is set to one, and the value of Delta g is stored as a constant.

    With one demonstration s = (g - p_0) / Delta g is one by itself, so the weights are those without scaling.
    """
    t = np.linspace(0, 1, 101)
    path = np.column_stack([4 * t**2 * (3 - 2 * t) + np.sin(6 * t), -2 * t])
    scaled = ProbabilisticDMP.as_published().fit([path], dt=0.01).primitive_
    plain = ProbabilisticDMP(discretization="semi_implicit_euler", **PAPERS_WEIGHTS).fit([path], dt=0.01).primitive_
    np.testing.assert_array_equal(scaled.goal_displacements, path[-1] - path[0])
    assert scaled.scaled == (True, True)
    np.testing.assert_allclose(scaled.amplitudes(task_for(scaled)), 1.0, rtol=1e-15)
    np.testing.assert_allclose(scaled.weight_means, plain.weight_means, rtol=1e-12)


@pytest.mark.parametrize("factor", [-1.0, 0.5, 3.0])
def test_a_goal_further_away_scales_the_whole_path(factor):
    """s scales the forcing term with the distance from start to goal, and the system is linear: so does the path."""
    primitive = make_primitive(np.random.default_rng(4), discretization="semi_implicit_euler", scaling="paper")
    velocity = np.array([0.3, -0.2])
    own = roll_out(primitive, task_for(primitive, start_velocity=velocity), 0.01)
    goal = primitive.start + factor * primitive.goal_displacements
    far = roll_out(primitive, task_for(primitive, goal=goal, start_velocity=factor * velocity), 0.01)
    np.testing.assert_allclose(far.positions - primitive.start, factor * (own.positions - primitive.start), atol=1e-9)


def test_without_scaling_the_path_keeps_its_size():
    """The default, not the paper's: the forcing term keeps its learned size, and a new goal adds the path of the spring."""
    primitive = make_primitive(np.random.default_rng(4), scaling="none")
    own = roll_out(primitive, task_for(primitive), 0.01)
    far = roll_out(primitive, task_for(primitive, goal=primitive.goal + 1), 0.01)
    unforced = replace(primitive, weight_means=np.zeros_like(primitive.weight_means), start_velocities=np.zeros(2))
    step_response = roll_out(unforced, task_for(unforced, np.zeros(2), np.ones(2)), 0.01)
    np.testing.assert_allclose(far.positions - own.positions, step_response.positions, atol=1e-10)


# --- the five Euler equations and their matrices ----------------------------------------------------------------------


@pytest.mark.parametrize(("alpha_z", "duration", "steps"), [(25.0, 1.0, 100), (10.0, 0.4, 30), (48.0, 6.0, 60)])
def test_five_euler_equations_are_the_state_space_form(alpha_z, duration, steps):
    """z'_t = tau (alpha_z (beta_z (g - p_{t-1}) - z_{t-1}) + f),  z_t = z'_t dt + z_{t-1},  p''_t = tau z'_t,
    p'_t = tau z_t,  p_t = p'_t dt + p_{t-1}   are   s_t = A s_{t-1} + B u_{t-1}, s_t = (p''_t, p'_t, p_t)^T."""
    rng, dt, tau = np.random.default_rng(5), duration / steps, 1 / duration
    A, B = step_matrices("semi_implicit_euler", alpha_z, duration, dt)
    spring = alpha_z * alpha_z / 4
    p, z, g = 0.7, -0.4, 2.0
    state = np.array([0.0, tau * z, p])
    for forcing in spring * rng.standard_normal(steps):
        p_dot_dot, p_dot, p, z = paper.five_euler_equations(p, z, forcing, g, tau, alpha_z, dt)
        state = A @ state + B * (spring * g + forcing)
        np.testing.assert_allclose(state, [p_dot_dot, p_dot, p], rtol=1e-11, atol=1e-11)


def test_three_reduced_equations_are_the_five():
    """p''_t = tau^2 (alpha_z (beta_z (g - p_{t-1}) - p'_{t-1} / tau) + s f),  p'_t = p''_t dt + p'_{t-1},
    p_t = p'_t dt + p_{t-1}.   The print leaves out s here; it multiplies f wherever f stands."""
    rng, tau, dt, g = np.random.default_rng(6), 0.4, 0.02, 2.0
    p, z = 0.7, -0.4
    reduced = (0.0, tau * z, p)
    for forcing in 100 * rng.standard_normal(50):
        *five, z = paper.five_euler_equations(p, z, forcing, g, tau, 25.0, dt)
        p = five[2]
        reduced = paper.three_reduced_equations(reduced[2], reduced[1], forcing, g, tau, 25.0, dt)
        np.testing.assert_allclose(reduced, five, rtol=1e-11, atol=1e-11)


def test_acceleration_is_tau_times_z_dot():
    """p''_t = tau z'_t, the third Euler equation; "p'' = z'" below equation 1 holds for tau = 1 only."""
    tau, dt, p, z = 0.25, 0.01, 0.7, -0.4
    p_dot_dot, p_dot, p_next, z_next = paper.five_euler_equations(p, z, 30.0, 2.0, tau, 25.0, dt)
    z_dot = (z_next - z) / dt
    assert p_dot_dot == pytest.approx(tau * z_dot, rel=1e-12)
    assert p_dot_dot == pytest.approx((p_dot - tau * z) / dt, rel=1e-12)  # it is the derivative of the velocity
    assert p_dot == pytest.approx((p_next - p) / dt, rel=1e-12)
    assert abs(p_dot_dot - z_dot) > 1


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(("alpha_z", "duration", "dt"), [(25.0, 1.0, 0.01), (12.0, 3.0, 0.05), (40.0, 0.5, 0.001)])
def test_transition_and_control_matrices_as_implemented(scheme, alpha_z, duration, dt):
    """A = (0, a1, a0; 0, 1 + a1 dt, a0 dt; 0, dt + a1 dt^2, 1 + a0 dt^2),  B = tau^2 (1, dt, dt^2)^T; exact: from expm."""
    typed = paper.matrices if scheme == "semi_implicit_euler" else paper.held_matrices
    for ours, theirs in zip(step_matrices(scheme, alpha_z, duration, dt), typed(alpha_z, 1 / duration, dt), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("duration", [0.5, 1.0, 2.0])
def test_printed_control_matrix_has_the_wrong_fixed_point(duration):
    """As printed, B = (1, 0, 0)^T and u = alpha_z beta_z g + s f: the movement ends at g / tau^2, not at g.

    A fixed point s = A s + B u with f = 0 solves (I - A) s = B alpha_z beta_z g.
    """
    alpha_z, tau, g = 25.0, 1 / duration, 3.0
    u = alpha_z * alpha_z / 4 * g
    A, B = paper.printed_matrices(alpha_z, tau, dt=0.01)
    np.testing.assert_allclose(np.linalg.solve(np.eye(3) - A, B * u), [0, 0, g / tau**2], atol=1e-9)
    for scheme in SCHEMES:
        A, B = step_matrices(scheme, alpha_z, duration, 0.01)
        np.testing.assert_allclose(np.linalg.solve(np.eye(3) - A, B * u), [0, 0, g], atol=1e-9)


def test_printed_transition_matrix_is_not_the_printed_equations():
    """As printed, A lets the PREVIOUS acceleration drive the velocity; the equations above it say the new one.

    Shown at tau = 1, where the printed B is as good as it can be. The delay also costs stability.
    """
    alpha_z, tau, dt, g = 25.0, 1.0, 0.01, 3.0
    u = alpha_z * alpha_z / 4 * g
    A, B = step_matrices("semi_implicit_euler", alpha_z, 1.0, dt)
    A_printed, B_printed = paper.printed_matrices(alpha_z, tau, dt)
    right, printed, equations = np.zeros(3), np.zeros(3), (0.0, 0.0, 0.0)
    gaps = []
    for _ in range(100):
        right, printed = A @ right + B * u, A_printed @ printed + B_printed * u
        equations = paper.three_reduced_equations(equations[2], equations[1], 0.0, g, tau, alpha_z, dt)
        gaps.append((abs(right[2] - equations[2]), abs(printed[2] - equations[2])))
    gap_right, gap_printed = np.max(gaps, axis=0)
    assert gap_right < 1e-12
    assert gap_printed > 0.05 * g

    def radius(matrix):
        return np.abs(np.linalg.eigvals(matrix)).max()

    assert radius(paper.printed_matrices(alpha_z, 1.0, dt=1 / alpha_z)[0]) > 1
    assert radius(step_matrices("semi_implicit_euler", alpha_z, 1.0, 1 / alpha_z)[0]) < 1


@pytest.mark.parametrize("scheme", SCHEMES)
def test_control_input_u(scheme):
    """u_t = alpha_z beta_z g + s f_t;  f at the step's start (the paper); exact: f - dt^2 f'' / 24 at its middle."""
    primitive = make_primitive(np.random.default_rng(7), scaling="paper", discretization=scheme)
    goal, duration, dt = primitive.goal + np.array([1.0, -2.0]), 1.3, 0.01
    model = linear_gaussian_model(primitive, task_for(primitive, goal=goal, duration=duration), dt, 100)
    alpha_z = primitive.configuration.alpha_z
    for d in range(2):
        s = (goal[d] - primitive.start[d]) / primitive.goal_displacements[d]

        def forcing(time, w=primitive.weight_means[d]):
            return paper.f(paper.phase(time, duration), w)

        for t in (0, 17, 98):
            f_t = paper.held_input(forcing, t, dt) if scheme == "exact" else forcing(t * dt)
            assert model.inputs[t, d, 0] == pytest.approx(alpha_z * (alpha_z / 4) * goal[d] + s * f_t, rel=1e-12)


def test_T_states_have_T_minus_one_inputs():
    """s_t = A s_{t-1} + B u_{t-1} + eps: u_{t-1}, with the phase of t - 1, makes s_t. (The first print of it says u_t.)"""
    primitive = make_primitive(np.random.default_rng(7), discretization="semi_implicit_euler")
    dt = 0.01
    model = linear_gaussian_model(primitive, task_for(primitive), dt, 80)
    assert model.n_steps == 80
    assert len(model.inputs) == len(model.input_covariances) == 79
    alpha_z, d = primitive.configuration.alpha_z, 1
    f_0 = paper.f(1.0, primitive.weight_means[d])
    assert model.inputs[0, d, 0] == pytest.approx(alpha_z**2 / 4 * primitive.goal[d] + f_0, rel=1e-12)


# --- uncertainty ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("reading", ["posterior", "predictive"])
def test_predictive_distribution_of_the_forcing_term(reading):
    """f_t ~ N(f_t | mu_f_t, sigma^2_f_t);  sigma_f^2 = phi^T Sigma_w phi, and + 1 / beta in the other reading."""
    primitive = make_primitive(np.random.default_rng(8), forcing_noise=reading)
    n_basis = primitive.configuration.n_basis
    for x in (1.0, 0.5, 0.05):
        features = np.array(paper.phi(x, n_basis))
        term = forcing_term(primitive, np.array([x]))
        for d in range(2):
            variance = features @ primitive.weight_covariances[d] @ features
            if reading == "predictive":
                variance += 1 / primitive.forcing_precisions[d]
            assert term.means[0, d] == pytest.approx(features @ primitive.weight_means[d], rel=1e-12)
            assert term.variances[0, d] == pytest.approx(variance, rel=1e-12)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_transition_noise_Q(scheme):
    """Q_t = s^2 B sigma^2_f_t B^T: of rank one, and it grows with the square of the amplitude."""
    primitive = make_primitive(np.random.default_rng(9), scaling="paper", discretization=scheme)
    dt = primitive.phase_step * primitive.duration  # the step that sigma_f^2 belongs to
    goal = primitive.start + 3 * primitive.goal_displacements
    model = linear_gaussian_model(primitive, task_for(primitive, goal=goal), dt, 60)
    _, B = step_matrices(scheme, primitive.configuration.alpha_z, primitive.duration, dt)
    offset = 0.5 if scheme == "exact" else 0.0
    for t in (0, 20, 58):
        phase = np.array([paper.phase((t + offset) * dt, primitive.duration)])
        for d in range(2):
            Q = model.process_covariances()[t, d]
            np.testing.assert_allclose(Q, 9 * forcing_term(primitive, phase).variances[0, d] * np.outer(B, B), rtol=1e-10)
            assert np.linalg.matrix_rank(Q) == 1


def test_transition_noise_depends_on_time(published):
    """If the variance of the distribution over f_t is time-dependent, so is the state transition noise."""
    primitive = published.primitive_
    posterior = replace(primitive, configuration=replace(primitive.configuration, forcing_noise="posterior"))
    model = linear_gaussian_model(posterior, task_for(posterior), posterior.dt, 100)
    variances = model.input_covariances[..., 0, 0]
    assert np.all(variances.max(axis=0) > 3 * variances.min(axis=0))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_transition_noise_at_another_step(scheme):
    """Ours: sigma_f^2 belongs to the training step; half the step redraws f twice as often, and needs twice the variance.

    Exactly so for semi-implicit Euler. In the exact scheme f is held while the velocity decays: what must agree is how far
    the damped velocity spreads in the end, and twice is the limit of small steps.
    """
    primitive = make_primitive(np.random.default_rng(10), discretization=scheme)
    step = primitive.phase_step * primitive.duration
    times = np.arange(5.0)
    own = control_inputs(primitive, task_for(primitive), step, times)
    halved = control_inputs(primitive, task_for(primitive), step / 2, 2 * times)
    np.testing.assert_allclose(halved.means, own.means, rtol=1e-12)
    ratio = paper.noise_correction(primitive, primitive.phase_step / 2)
    np.testing.assert_allclose(halved.variances, ratio * own.variances, rtol=1e-10)
    if scheme == "semi_implicit_euler":
        assert ratio == 2
    else:
        tiny, half = (paper.held_noise_intensity(25.0, phase_step) for phase_step in (1e-5, 5e-6))
        assert half / tiny == pytest.approx(2, rel=1e-4)
    slower = control_inputs(primitive, task_for(primitive, duration=3 * primitive.duration), 3 * step, times)
    np.testing.assert_allclose(slower.variances, own.variances, rtol=1e-12)  # the same steps in phase


def test_the_bands_do_not_depend_on_the_control_rate(default):
    """What the rescaling is for: position and velocity bands at 100 Hz and 1 kHz agree to 0.5 % of the largest."""
    slow, fast = (default.rollout(duration=1.2, dt=dt) for dt in (0.01, 0.001))
    for name in ("position_stds", "velocity_stds"):
        bands = getattr(slow, name)
        assert np.abs(bands - getattr(fast, name)[::10]).max() < 0.005 * bands.max()


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_hidden_state_is_gaussian_around_its_transition(scheme):
    """s_t ~ N(s_t | A s_{t-1} + B (alpha_z beta_z g + s mu_f_t), Q_t): by drawing f_t and stepping."""
    primitive = make_primitive(np.random.default_rng(11), n_dof=1, discretization=scheme)
    dt, n = 0.02, 4000
    model = linear_gaussian_model(primitive, task_for(primitive), dt, 30)
    typed = paper.system(primitive, 0, primitive.start[0], primitive.goal[0], primitive.duration, dt, 30)
    states, _ = sample_sequences(model, n, np.random.default_rng(0))
    states = states[:, :, 0]
    for t in (1, 29):
        steps = states[:, t] - states[:, t - 1] @ typed.A.T
        std = np.sqrt(np.diag(typed.Q[t - 1]))
        np.testing.assert_allclose(steps.mean(axis=0), typed.B * typed.u[t - 1], atol=5 * std.max() / math.sqrt(n))
        np.testing.assert_allclose(np.cov(steps.T) / np.outer(std, std), np.ones((3, 3)), atol=5 * math.sqrt(2 / n))


def test_observation_equation():
    """o_t = h(s_t) + v, v ~ N(0, R);  h(s_t) = C s_t, C = (0 0 1): the position. Printed with a ^T, used as a row."""
    np.testing.assert_array_equal(POSITION_SENSOR, [[0, 0, 1]])
    primitive = make_primitive(np.random.default_rng(12))
    model = linear_gaussian_model(primitive, task_for(primitive), 0.02, 20)
    states, observations = sample_sequences(model, 4000, np.random.default_rng(0))
    noise = observations[..., 0] - states[..., 2]
    R = primitive.observation_variances
    np.testing.assert_allclose(noise.var(axis=(0, 1)), R, rtol=5 * math.sqrt(2 / 80000))
    assert np.all(np.abs(noise.mean(axis=(0, 1))) < 5 * np.sqrt(R / 80000))


@pytest.mark.parametrize("slower", [0.5, 1.0, 2.0])
def test_the_controlled_linear_dynamical_system(learned, slower):
    """Putting it all together: s_t = A s_{t-1} + B (alpha_z beta_z g + s mu_f) + eps_t,  o_t = C s_t + v."""
    primitive = learned.primitive_
    start, goal = primitive.start + np.array([1.0, 2.0]), primitive.goal + np.array([-2.0, 3.0])
    duration, dt, T = slower * primitive.duration, 0.01, 50
    model = linear_gaussian_model(primitive, task_for(primitive, start, goal, duration), dt, T)
    for d in range(primitive.n_dof):
        typed = paper.system(primitive, d, start[d], goal[d], duration, dt, T)
        np.testing.assert_allclose(model.transition[0], typed.A, rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(model.input_matrix[0, :, 0], typed.B, rtol=1e-9)
        np.testing.assert_allclose(model.inputs[:, d, 0], typed.u, rtol=1e-10)
        np.testing.assert_allclose(model.process_covariances()[:, d], typed.Q, rtol=1e-9)
        np.testing.assert_allclose(model.observation_matrix[0], typed.C)
        np.testing.assert_allclose(model.observation_covariance[d, 0, 0], typed.R)
        np.testing.assert_allclose(model.initial_mean[d], typed.mu_0, rtol=1e-10)
        np.testing.assert_allclose(model.initial_covariance[d], typed.V_0, rtol=1e-9, atol=1e-12 * typed.V_0.max())


def test_several_demonstrations_give_the_variance_of_the_forcing_term(letters):
    """From several demonstrations we can estimate the mean forcing term, but also the variance.

    Demonstrations that differ twice as much from their mean leave four times the variance.
    """
    grid = np.linspace(0, 1, 101)
    paths = np.array([np.interp(grid, d.times / d.duration, d.positions[:, 0]) for d in letters["s"]])
    mean = paths.mean(axis=0)
    variances = []
    for factor in (1.0, 2.0):
        demonstrations = [Demonstration((mean + factor * (path - mean))[:, None], 0.01) for path in paths]
        primitive = ProbabilisticDMP(**PAPERS_WEIGHTS).fit(demonstrations).primitive_
        variances.append(1 / primitive.forcing_precisions[0])
    assert variances[1] == pytest.approx(4 * variances[0], rel=0.2)
