"""The paper's equations and algorithms, typed in as they stand, one degree of freedom at a time; no code of the library.

Where the print disagrees with itself the reading is that of docs/paper.md; what is printed wrongly is here under its own name,
`printed_matrices`, so that a test can show that it is wrong.
Source: F. Meier, S. Schaal, A Probabilistic Representation for Dynamic Movement Primitives (2016).
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

ALPHA_X = math.log(100)
"""Open in the paper; here the phase is 0.01 at the end."""


class System(NamedTuple):
    """s_t = A s_{t-1} + B u_{t-1} + eps_{t-1},  o_t = C s_t + v, of one degree of freedom."""

    A: np.ndarray
    """(3, 3)."""
    B: np.ndarray
    """(3,)."""
    u: np.ndarray
    """(T - 1,)."""
    Q: np.ndarray
    """(T - 1, 3, 3)."""
    C: np.ndarray
    """(3,), a row."""
    R: float
    mu_0: np.ndarray
    """(3,)."""
    V_0: np.ndarray
    """(3, 3)."""


class Run(NamedTuple):
    """What Algorithm 1 or 2 went through, T entries each; NaN where an algorithm has none."""

    mu_p: np.ndarray
    V_p: np.ndarray
    S: np.ndarray
    K: np.ndarray
    mu_u: np.ndarray
    V_u: np.ndarray
    log_likelihoods: np.ndarray


# --- equation 1 and below ---------------------------------------------------------------------------------------------


def phase(t, duration):
    """x(t), the solution of x' / tau = -alpha_x x from x(0) = 1."""
    return math.exp(-ALPHA_X * t / duration)


def psi(x, n_basis):
    """psi_i = exp(-h_i (x - c_i)^2); centres at evenly spaced times, widths from their distances."""
    c = [math.exp(-ALPHA_X * i / (n_basis - 1)) for i in range(n_basis)]
    h = [1 / (c[i + 1] - c[i]) ** 2 for i in range(n_basis - 1)]
    h.append(h[-1])
    return [math.exp(-h[i] * (x - c[i]) ** 2) for i in range(n_basis)]


def phi(x, n_basis):
    """What multiplies the weights in f: psi_i x / sum_j psi_j."""
    values = psi(x, n_basis)
    return [value * x / sum(values) for value in values]


def f(x, w):
    """f(x) = sum_i psi_i w_i x / sum_i psi_i."""
    values = psi(x, len(w))
    return sum(v * w_i * x for v, w_i in zip(values, w, strict=True)) / sum(values)


# --- the discretised system -------------------------------------------------------------------------------------------


def five_euler_equations(p, z, forcing, g, tau, alpha_z, dt):
    """One step: (p, z) at t-1 to (p'', p', p, z) at t. `forcing` is s f."""
    beta_z = alpha_z / 4
    z_dot = tau * (alpha_z * (beta_z * (g - p) - z) + forcing)
    z = z_dot * dt + z
    p_dot_dot = tau * z_dot
    p_dot = tau * z
    p = p_dot * dt + p
    return p_dot_dot, p_dot, p, z


def three_reduced_equations(p, p_dot, forcing, g, tau, alpha_z, dt):
    """One step without z: (p, p') at t-1 to (p'', p', p) at t. `forcing` is s f, where the print has f."""
    beta_z = alpha_z / 4
    p_dot_dot = tau**2 * (alpha_z * (beta_z * (g - p) - p_dot / tau) + forcing)
    p_dot = p_dot_dot * dt + p_dot
    p = p_dot * dt + p
    return p_dot_dot, p_dot, p


def matrices(alpha_z, tau, dt):
    """A and B that make s_t = A s_{t-1} + B u the three reduced equations: each substituted into the next."""
    a1, a0 = -alpha_z * tau, -alpha_z * (alpha_z / 4) * tau**2
    A = np.array([[0, a1, a0], [0, 1 + a1 * dt, a0 * dt], [0, dt + a1 * dt**2, 1 + a0 * dt**2]])
    return A, tau**2 * np.array([1, dt, dt**2])


def printed_matrices(alpha_z, tau, dt):
    """A and B as the paper prints them."""
    beta_z = alpha_z / 4
    A = np.array([[0, -alpha_z * tau, -alpha_z * beta_z * tau**2], [dt, 1.0, 0], [0, dt, 1.0]])
    return A, np.array([1.0, 0, 0])


def held_matrices(alpha_z, tau, dt):
    """A and B of the default scheme: equation 1 solved for an input held over the step, the acceleration its mean."""
    a1, a0 = -alpha_z * tau, -alpha_z * (alpha_z / 4) * tau**2
    step = expm(np.array([[a1, a0, tau**2], [1, 0, 0], [0, 0, 0]]) * dt)
    A, B = np.zeros((3, 3)), np.zeros(3)
    A[1:, 1:], B[1:] = step[:2, :2], step[:2, 2]
    A[0, 1:] = (step[0, :2] - [1, 0]) / dt
    B[0] = step[0, 2] / dt
    return A, B


def held_input(mean_forcing, t, dt):
    """What the default scheme holds over the step after tick t: f - dt^2 f'' / 24 at the middle, f'' from three values.

    Over the first step dt f' / 12 less, f' from the values at both ends.
    """
    before, middle, after = (mean_forcing((t + place) * dt) for place in (0.0, 0.5, 1.0))
    curvature = (before - 2 * middle + after) / (dt / 2) ** 2
    slope = (after - before) / dt if t == 0 else 0.0
    return middle - dt**2 / 24 * curvature - dt / 12 * slope


def held_noise_intensity(alpha_z, phase_step):
    """Stationary variance that white noise of unit intensity leaves in the damped velocity, over that of unit held noise.

    x' = -alpha_z x + noise, in units of the duration; the discrete variance is summed up, step by step.
    """
    decay = np.exp(-alpha_z * phase_step)
    push = (1 - decay) / alpha_z
    n_steps = int(40 / (alpha_z * phase_step)) + 1
    held = np.sum((push * decay ** np.arange(n_steps)) ** 2)
    return 1 / (2 * alpha_z) / held


def noise_correction(primitive, phase_step):
    """By how much the variance of f at this step exceeds that at the training step: the damped velocity spreads as far."""
    if primitive.configuration.discretization == "semi_implicit_euler":
        return primitive.phase_step / phase_step
    alpha_z = primitive.configuration.alpha_z
    return held_noise_intensity(alpha_z, phase_step) / held_noise_intensity(alpha_z, primitive.phase_step)


def system(primitive, d, start, goal, duration, dt, n_steps):
    """The linear dynamical system of degree of freedom d of a primitive, from its theta and a task.

    A start of NaN is unknown: the mean start with the variance of the demonstrations' starts. One that is given is certain.
    """
    configuration, tau = primitive.configuration, 1 / duration
    alpha_z, n_basis = configuration.alpha_z, configuration.n_basis
    beta_z = alpha_z / 4
    mu_w, Sigma_w, beta = primitive.weight_means[d], primitive.weight_covariances[d], primitive.forcing_precisions[d]
    delta_g = primitive.goal_displacements[d]
    scaled = configuration.scaling == "paper" and abs(delta_g) >= 0.2 * primitive.ranges[d]
    start_is_known = not math.isnan(start)
    start = start if start_is_known else primitive.start[d]
    s = (goal - start) / delta_g if scaled else 1.0
    exact = configuration.discretization == "exact"
    A, B = (held_matrices if exact else matrices)(alpha_z, tau, dt)

    def forcing(time):
        return f(phase(time, duration), mu_w)

    correction = noise_correction(primitive, dt / duration)

    def forcing_variance(time):
        features = np.array(phi(phase(time, duration), n_basis))
        variance = features @ Sigma_w @ features
        if configuration.forcing_noise == "predictive":
            variance += 1 / beta
        return variance * correction

    ticks = range(n_steps - 1)
    means = [held_input(forcing, t, dt) if exact else forcing(t * dt) for t in ticks]
    variances = [forcing_variance((t + 0.5) * dt if exact else t * dt) for t in ticks]
    velocity = primitive.start_velocities[d] / duration
    # s_0: velocity as learned, position as given or learned, the acceleration from the differential equation
    lift = np.array([[-alpha_z * tau, -alpha_z * beta_z * tau**2], [1, 0], [0, 1]])
    units = np.diag([1 / duration, 0.0 if start_is_known else 1.0])
    mu_0 = lift @ [velocity, start] + [tau**2 * (alpha_z * beta_z * goal + s * forcing(0.0)), 0, 0]
    V_0 = lift @ units @ primitive.start_covariances[d] @ units @ lift.T
    V_0[0, 0] += tau**4 * s**2 * forcing_variance(0.0)
    return System(
        A,
        B,
        np.array([alpha_z * beta_z * goal + s * mean for mean in means]),
        np.array([s**2 * np.outer(B, B) * variance for variance in variances]),
        np.array([0.0, 0.0, 1.0]),
        float(primitive.observation_variances[d]),
        mu_0,
        V_0,
    )


# --- algorithms -------------------------------------------------------------------------------------------------------


def algorithm_1(model):
    """Rollout: predictions only. Line 3 prints mu_u, which nothing updates here: predictions feed predictions."""
    T = len(model.u) + 1
    mu, V = [model.mu_0], [model.V_0]
    for t in range(1, T):
        mu.append(model.A @ mu[t - 1] + model.B * model.u[t - 1])
        V.append(model.A @ V[t - 1] @ model.A.T + model.Q[t - 1])
    return np.array(mu), np.array(V)


def algorithm_2(model, observations):
    """ExecuteAndMonitor, C read as a row throughout. The first observation updates s_0, with no prediction before it."""
    T, A, B, C = len(observations), model.A, model.B, model.C
    mu_p, V_p = [model.mu_0], [model.V_0]
    mu_u, V_u, gains, innovation_variances, log_likelihoods = [], [], [], [], []
    for t in range(T):
        if t > 0:
            mu_p.append(A @ mu_u[t - 1] + B * model.u[t - 1])  # line 3
            V_p.append(A @ V_u[t - 1] @ A.T + model.Q[t - 1])  # line 4
        S = C @ V_p[t] @ C + model.R  # line 5
        K = V_p[t] @ C / S  # line 6
        e = observations[t] - C @ mu_p[t]
        mu_u.append(mu_p[t] + K * e)  # line 7
        V_u.append(V_p[t] - np.outer(K, C @ V_p[t]))  # line 8
        gains.append(K)
        innovation_variances.append(S)
        log_likelihoods.append(log_normal(e, 0.0, S))  # line 10
    columns = (mu_p, V_p, innovation_variances, gains, mu_u, V_u, log_likelihoods)
    return Run(*(np.array(column) for column in columns))


def log_normal(x, mean, variance):
    """ln N(x | mean, variance)."""
    return -0.5 * ((x - mean) ** 2 / variance + math.log(2 * math.pi * variance))
