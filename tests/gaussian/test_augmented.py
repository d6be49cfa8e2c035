"""Linear systems on top of a Gaussian that stands still: the same as conditioning the dense joint density."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import random_covariance, seeds

from probdmp.gaussian import (
    linear_moments,
    no_deviation,
    observe,
    observe_deviation,
    predict_deviation,
    smooth_deviations,
    unit_belief,
)


def dense(A, Q, designs, sensor, variances):
    """Covariance of (z, d_i[t]) and the rows that observe them."""
    T, D, r = designs.shape
    n = A.shape[-1]
    size = r + T * D * n
    # d_i[t] = sum of A^(t-s) e_i[s]: one square block for each of the sensors
    V = np.zeros((size, size))
    V[:r, :r] = np.eye(r)
    for i in range(D):
        causes = np.zeros((T, n, T, n))
        for s in range(1, T):
            causes[s, :, s] = np.eye(n)
            for t in range(s + 1, T):
                causes[t, :, s] = A @ causes[t - 1, :, s]
        causes = causes.reshape(T * n, T * n)
        own = slice(r + i * T * n, r + (i + 1) * T * n)
        V[own, own] = causes @ np.kron(np.eye(T), Q[i]) @ causes.T
    rows = np.zeros((T, D, size))
    for t in range(T):
        for i in range(D):
            rows[t, i, :r] = designs[t, i]
            rows[t, i, r + i * T * n + t * n + sensor] = 1
    return V, rows


@given(seeds, st.integers(1, 4), st.integers(1, 3), st.integers(1, 3), st.integers(1, 7), st.floats(0, 0.9))
def test_filter_and_smoother_are_dense(seed, size, n_sensors, n_states, n_steps, missing):
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((n_states, n_states)) / np.sqrt(n_states)
    Q = random_covariance(rng, (n_sensors,), n_states, 1)
    designs = rng.standard_normal((n_steps, n_sensors, size))
    observed = rng.standard_normal((n_steps, n_sensors))
    observed[rng.random(observed.shape) < missing] = np.nan
    variances, sensor = 10 ** rng.uniform(-3, 1, n_sensors), int(rng.integers(n_states))
    V, rows = dense(A, Q, designs, sensor, variances)
    belief, deviation, updates, total = unit_belief((), size), no_deviation((n_sensors,), n_states, size), [], 0.0
    for t in range(n_steps):
        deviation = predict_deviation(deviation, A, Q) if t else deviation
        update = observe_deviation(belief, deviation, observed[t], designs[t], sensor, variances)
        belief, deviation, total = update.seen.belief, update.deviation, total + update.seen.log_likelihoods.sum()
        updates.append(update)
    k = ~np.isnan(observed)
    G, o = rows[k], observed[k]
    S = G @ V @ G.T + np.diag(np.broadcast_to(variances, k.shape)[k])
    gain = V @ G.T @ np.linalg.inv(S)
    mean, left = gain @ o, V - gain @ G @ V
    density = -0.5 * (o @ np.linalg.solve(S, o) + np.linalg.slogdet(2 * np.pi * S)[1]) if k.any() else 0.0
    assert total == pytest.approx(density, rel=1e-6, abs=1e-6)
    np.testing.assert_allclose(belief.mean, mean[:size], atol=1e-6)
    np.testing.assert_allclose(belief.covariance, left[:size, :size], atol=1e-6)
    for t, smoothed in enumerate(smooth_deviations(updates, A)):
        for i in range(n_sensors):
            block = slice(size + (i * n_steps + t) * n_states, size + (i * n_steps + t + 1) * n_states)
            got, covariance = linear_moments(belief, smoothed.loading[i])
            np.testing.assert_allclose(got + smoothed.offset[i], mean[block], atol=1e-5)
            np.testing.assert_allclose(covariance + smoothed.covariance[i], left[block, block], atol=1e-5)


def test_without_deviations_it_is_the_static_filter():
    rng = np.random.default_rng(0)
    designs, observed, variances = rng.standard_normal((3, 2, 4)), rng.standard_normal((3, 2)), np.array([0.1, 0.2])
    deviation = no_deviation((3, 2), 3, 4)
    update = observe_deviation(unit_belief((3,), 4), deviation, observed, designs, 2, variances)
    static = observe(unit_belief((3,), 4), observed, designs, variances)
    np.testing.assert_array_equal(update.seen.belief.covariance, static.belief.covariance)
    np.testing.assert_array_equal(update.seen.log_likelihoods, static.log_likelihoods)
    assert not any(part.any() for part in update.deviation)
