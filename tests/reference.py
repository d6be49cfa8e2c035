"""What the library must agree with, written from the definitions and sharing no code with it.

1. `dense_posterior`: the joint Gaussian of all states and observations of a linear system, conditioned by brute force. With
   `digits` it computes in decimal arithmetic of that many digits, and is then exact for our purposes even where R = 1e-12.
   `parametric_posterior`: the same of states that are linear in parameters drawn once, and deviate from that.
2. `kalman_filter`, `rts_smoother`: the textbook recursions (Bishop, sections 13.3.1 and 13.3.2) for one series.
3. `integrate_dmp`: a movement primitive stepped through the scalar equations of Meier & Schaal 2016.

The system, for one series without batch axes:

    s[t] = A s[t-1] + B (u[t-1] + e[t-1]),  e[t] ~ N(0, U[t]);    o[t] = C s[t] + v[t],  v[t] ~ N(0, R);    s[0] ~ N(m0, V0)
"""

import math
from decimal import Decimal, localcontext
from typing import NamedTuple

import numpy as np

PI = "3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534211706798"


class System(NamedTuple):
    """The arrays of one series: A (n, n), B (n, m), u (T-1, m), U (T-1, m, m), C (O, n), R (O, O), m0 (n), V0 (n, n)."""

    A: np.ndarray
    B: np.ndarray
    u: np.ndarray
    U: np.ndarray
    C: np.ndarray
    R: np.ndarray
    m0: np.ndarray
    V0: np.ndarray


class Posterior(NamedTuple):
    """What the observations say, T times and n states; of every pair the mean (T, n) and the covariance (T, n, n)."""

    prior: tuple[np.ndarray, np.ndarray]
    """Given nothing."""
    predicted: tuple[np.ndarray, np.ndarray]
    """Given the observations before each time."""
    filtered: tuple[np.ndarray, np.ndarray]
    """Given those up to and including each time."""
    smoothed: tuple[np.ndarray, np.ndarray]
    """Given all."""
    log_likelihoods: np.ndarray
    """(T,) ln p(o[t] | o[0] .. o[t-1]) of what was seen at t, nats."""
    log_likelihood: float
    """ln p(o), the log density of everything that was seen."""


def system_at(model, index=()):
    """One entry of a model with batch axes; `model` has the fields of `probdmp.gaussian.LinearGaussianModel`."""

    def one(array, n_axes, timed=False):
        array = np.asarray(array)
        lead, tail = array.shape[:timed], array.shape[array.ndim - n_axes :]
        middle = array.shape[len(lead) : array.ndim - n_axes]
        wide = array.reshape(*lead, *(1,) * (len(model.batch_shape) - len(middle)), *middle, *tail)
        wide = np.broadcast_to(wide, (*lead, *model.batch_shape, *tail))
        return wide[(slice(None),) * timed + tuple(index)]

    return System(
        one(model.transition, 2),
        one(model.input_matrix, 2),
        one(model.inputs, 1, timed=True),
        one(model.input_covariances, 2, timed=True),
        one(model.observation_matrix, 2),
        one(model.observation_covariance, 2),
        one(model.initial_mean, 1),
        one(model.initial_covariance, 2),
    )


# --- 1. brute force ---------------------------------------------------------------------------------------------------


class Joint(NamedTuple):
    """The Gaussian over all states and all observations, T times, n states, O sensors."""

    state_means: np.ndarray
    """(T, n)"""
    state_covariance: np.ndarray
    """(T, n, T, n)"""
    observation_means: np.ndarray
    """(T, O)"""
    observation_covariance: np.ndarray
    """(T, O, T, O), sensor noise included."""
    cross_covariance: np.ndarray
    """(T, O, T, n), of observations with states."""


def dense_joint(system, digits=None):
    """Every state is a mean plus a matrix times independent sources (s[0] - m0, e[0], .., e[T-2]); every entry written out.

    digits : of decimal arithmetic (arrays of `Decimal`); None: double precision.
    """
    with localcontext() as context:
        context.prec = digits or context.prec
        A, B, u, U, C, R, m0, V0 = (_numbers(array, digits) for array in system)
        T, n, m = len(u) + 1, *B.shape
        n_sources = n + (T - 1) * m
        means, G, sources = np.zeros((T, n), A.dtype), np.zeros((T, n, n_sources), A.dtype), np.zeros((n_sources,) * 2, A.dtype)
        means[0], G[0][:, :n], sources[:n, :n] = m0, np.eye(n, dtype=A.dtype), V0
        for t in range(1, T):
            e = slice(n + (t - 1) * m, n + t * m)  # e[t-1], which drives s[t-1] to s[t]
            means[t] = A @ means[t - 1] + B @ u[t - 1]
            G[t] = A @ G[t - 1]
            G[t][:, e] += B
            sources[e, e] = U[t - 1]
        return _seen_through(C, R, means, *_of_states(G, sources, n, m, C))


def _of_states(G, sources, n, m, C):
    """G sources G^T (T, n, T, n), and C times it. Of these products, terms that are zero are left out: most, and all cost time.

    Sources are independent between times, and no state depends on sources after it.
    """
    T, _, n_sources = G.shape
    rows, driven = G.reshape(T * n, n_sources), np.zeros((T * n, n_sources), G.dtype)
    for block in (slice(0, n), *(slice(k, k + m) for k in range(n, n_sources, m))):
        driven[:, block] = rows[:, block] @ sources[block, block]
    states = np.zeros((T * n, T * n), G.dtype)
    for t in range(T):
        here, later, known = slice(t * n, (t + 1) * n), slice(t * n, T * n), slice(0, n + t * m)
        states[here, later] = driven[here, known] @ rows[later, known].T
        states[later, here] = states[here, later].T
    states = states.reshape(T, n, T, n)
    return states, np.tensordot(C, states, (1, 1)).swapaxes(0, 1)


def _seen_through(C, R, means, states, cross):
    observations = np.tensordot(cross, C, (3, 1))
    for t in range(len(means)):
        observations[t, :, t, :] += R
    return Joint(means, states, means @ C.T, observations, cross)


class Parametric(NamedTuple):
    """States of which a part stands still, T times, n states, r parameters z:

    s[t] = offsets[t] + designs[t] z + d[t],  z ~ N(mean, covariance);    d[t] = A d[t-1] + e[t-1],  d[0] = 0,  e ~ N(0, Q)
    """

    offsets: np.ndarray
    """(T, n)"""
    designs: np.ndarray
    """(T, n, r)"""
    mean: np.ndarray
    """(r,)"""
    covariance: np.ndarray
    """(r, r)"""
    A: np.ndarray
    """(n, n)"""
    Q: np.ndarray
    """(n, n)"""
    C: np.ndarray
    """(O, n)"""
    R: np.ndarray
    """(O, O)"""


def parametric_joint(system):
    """Every state is a mean plus a matrix times independent sources (z - mean, e[0], .., e[T-2])."""
    T, n, r = system.designs.shape
    G, sources = np.zeros((T, n, r + (T - 1) * n)), np.zeros((r + (T - 1) * n,) * 2)
    sources[:r, :r] = system.covariance
    for t in range(T):
        if t > 0:
            e = slice(r + (t - 1) * n, r + t * n)
            G[t, :, r:] = system.A @ G[t - 1, :, r:]
            G[t, :, e] += np.eye(n)
            sources[e, e] = system.Q
        G[t, :, :r] = system.designs[t]
    rows = G.reshape(T * n, -1)
    states = (rows @ sources @ rows.T).reshape(T, n, T, n)
    cross = np.tensordot(system.C, states, (1, 1)).swapaxes(0, 1)
    return _seen_through(system.C, system.R, system.offsets + system.designs @ system.mean, states, cross)


def dense_posterior(system, observations, digits=None):
    """Condition the joint Gaussian on the observations (T, O), of which NaN entries were not seen.

    digits : of decimal arithmetic; None: double precision, for long series that are well conditioned.
    """
    with localcontext() as context:
        context.prec = digits or context.prec
        return _posterior(dense_joint(system, digits), observations, digits)


def parametric_posterior(system, observations):
    """The same of a `Parametric` system."""
    return _posterior(parametric_joint(system), observations, None)


def _posterior(joint, observations, digits):
    with localcontext() as context:
        context.prec = digits or context.prec
        ln, pi = (Decimal.ln, Decimal(PI)) if digits else (math.log, math.pi)
        T, n = joint.state_means.shape
        times, sensors = np.nonzero(~np.isnan(observations))  # what was seen, in the order of time
        S = joint.observation_covariance[times, sensors][:, times, sensors]
        residual = _numbers(observations[times, sensors], digits) - joint.observation_means[times, sensors]
        # With S = L L^T, the leading part of L is the factor for the leading observations: one factorisation serves all times.
        L = _cholesky(S)
        z = _solve_lower(L, residual)
        W = _solve_lower(L, joint.cross_covariance[times, sensors].reshape(-1, T * n)).reshape(-1, T, n)
        log_densities = [-(a * a + 2 * ln(b) + ln(2 * pi)) / 2 for a, b in zip(z, np.diagonal(L), strict=True)]

        def given(known):  # known(t): which observations count for the state at t
            means, covariances = [], []
            for t in range(T):
                k = known(t)
                means.append(joint.state_means[t] + W[k, t].T @ z[k])
                covariances.append(joint.state_covariance[t, :, t, :] - W[k, t].T @ W[k, t])
            return np.array(means, dtype=np.float64), np.array(covariances, dtype=np.float64)

        return Posterior(
            prior=given(lambda t: times < 0),
            predicted=given(lambda t: times < t),
            filtered=given(lambda t: times <= t),
            smoothed=given(lambda t: times >= 0),
            log_likelihoods=np.array(
                [float(sum(d for d, k in zip(log_densities, times, strict=True) if k == t)) for t in range(T)]
            ),
            log_likelihood=float(sum(log_densities)),
        )


def _numbers(array, digits):
    return np.vectorize(Decimal, otypes=[object])(array) if digits else np.asarray(array)


def _cholesky(S):
    L = np.zeros_like(S)
    for j in range(len(S)):
        column = S[j:, j] - L[j:, :j] @ L[j, :j]
        L[j:, j] = column / np.sqrt(column[:1])
    return L


def _solve_lower(L, right):
    X = np.zeros_like(right)
    for i in range(len(L)):
        X[i] = (right[i] - L[i, :i] @ X[:i]) / L[i, i]
    return X


def deviation_in_stds(means, covariances, expected, stds, least=1e-5):
    """Largest error of means (T, n) and of covariances (T, n, n), in units of `stds` (T, n) and of their products.

    least : of the mean's size, in place of a std that is smaller. A known state has no spread; 1e-9 of 1e-5 is some rounding.
    """
    expected_means, expected_covariances = expected
    unit = np.maximum(stds, least * (1 + np.abs(expected_means)))
    return max(
        np.max(np.abs(means - expected_means) / unit),
        np.max(np.abs(covariances - expected_covariances) / (unit[:, :, None] * unit[:, None, :])),
    )


def marginal_stds(covariances):
    """(*shape, n) from (*shape, n, n)."""
    return np.sqrt(np.maximum(np.diagonal(covariances, axis1=-2, axis2=-1), 0))


# --- 2. textbook recursions -------------------------------------------------------------------------------------------


def kalman_filter(system, observations):
    """Filtered means (T, n), covariances (T, n, n) and the log-likelihood of each step (T,)."""
    A, B, u, U, C, R, m, V = system
    means, covariances, log_likelihoods = [], [], []
    for t, o in enumerate(observations):
        if t > 0:
            m, V = A @ m + B @ u[t - 1], A @ V @ A.T + B @ U[t - 1] @ B.T
        k = ~np.isnan(o)
        e, S = o[k] - C[k] @ m, C[k] @ V @ C[k].T + R[np.ix_(k, k)]
        K = V @ C[k].T @ np.linalg.inv(S)
        log_likelihoods.append(-0.5 * (e @ np.linalg.inv(S) @ e + np.log(np.linalg.det(2 * np.pi * S))))
        m, V = m + K @ e, V - K @ S @ K.T
        means.append(m)
        covariances.append(V)
    return np.array(means), np.array(covariances), np.array(log_likelihoods)


def rts_smoother(system, observations):
    """Smoothed means (T, n) and covariances (T, n, n); needs predictions with invertible covariances."""
    A, B, u, U, *_ = system
    means, covariances, _ = kalman_filter(system, observations)
    for t in range(len(means) - 2, -1, -1):
        predicted, P = A @ means[t] + B @ u[t], A @ covariances[t] @ A.T + B @ U[t] @ B.T
        J = covariances[t] @ A.T @ np.linalg.inv(P)
        means[t] += J @ (means[t + 1] - predicted)
        covariances[t] += J @ (covariances[t + 1] - P) @ J.T
    return means, covariances


# --- 3. the classical movement primitive ------------------------------------------------------------------------------


def integrate_dmp(weights, start, goal, duration, dt, n_steps, alpha_z, start_velocity, amplitude=1.0):
    """One degree of freedom, n_steps states from the start on: positions, velocities, accelerations, each (n_steps,).

    weights : (N,); start, goal : data units; duration, dt : seconds; start_velocity : data units per second; amplitude : s.
    """
    tau, beta_z, alpha_x = 1 / duration, alpha_z / 4, math.log(100)
    n_basis = len(weights)
    centers = [math.exp(-alpha_x * i / (n_basis - 1)) if n_basis > 1 else 1.0 for i in range(n_basis)]
    widths = [1 / (centers[i + 1] - centers[i]) ** 2 for i in range(n_basis - 1)]
    widths.append(widths[-1] if widths else 1.0)

    def forcing(time):
        x = math.exp(-alpha_x * time / duration)
        psi = [math.exp(-h * (x - c) ** 2) for h, c in zip(widths, centers, strict=True)]
        return sum(b * w * x for b, w in zip(psi, weights, strict=True)) / sum(psi)

    p, z = start, start_velocity / tau  # p' = tau z
    z_dot = tau * (alpha_z * (beta_z * (goal - p) - z) + amplitude * forcing(0.0))
    path = [(p, tau * z, tau * z_dot)]
    for t in range(1, n_steps):
        z_dot = tau * (alpha_z * (beta_z * (goal - p) - z) + amplitude * forcing((t - 1) * dt))
        z = z_dot * dt + z
        p_dot = tau * z
        p = p_dot * dt + p
        path.append((p, p_dot, tau * z_dot))
    positions, velocities, accelerations = np.array(path, dtype=np.float64).T
    return positions, velocities, accelerations
