"""Linear systems on top of a Gaussian that stands still: the same as conditioning the dense joint density."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import random_covariance, seeds

from probdmp.gaussian import (
    Deviation,
    linear_moments,
    no_deviation,
    observe,
    observe_deviation,
    predict_deviation,
    smooth_deviations,
    unit_belief,
)


def dense(A, Q, designs, sensors):
    """Covariance of (z, d_g[t]) and the rows that observe them.

    Parameters
    ----------
    A, Q : (G, n, n) arrays.
    designs : (T, G, S, r) array.
    sensors : C, (T, G, S, n) array.
    """
    T, G, S, r = designs.shape
    n = A.shape[-1]
    size = r + T * G * n
    # d_g[t] = sum of A^(t-s) e_g[s]: one square block for each of the groups
    V = np.zeros((size, size))
    V[:r, :r] = np.eye(r)
    rows = np.zeros((T, G, S, size))
    rows[..., :r] = designs
    for g in range(G):
        causes = np.zeros((T, n, T, n))
        for s in range(1, T):
            causes[s, :, s] = np.eye(n)
            for t in range(s + 1, T):
                causes[t, :, s] = A[g] @ causes[t - 1, :, s]
        causes = causes.reshape(T * n, T * n)
        first = r + g * T * n
        own = slice(first, first + T * n)
        V[own, own] = causes @ np.kron(np.eye(T), Q[g]) @ causes.T
        for t in range(T):
            rows[t, g, :, first + t * n : first + (t + 1) * n] = sensors[t, g]
    return V, rows


def dense_noise(noise):
    """R of all sensors at all times, (T G S, T G S), from (T, G, S, S)."""
    T, G, S, _ = noise.shape
    full = np.zeros((T * G, S, T * G, S))
    for i, block in enumerate(noise.reshape(T * G, S, S)):
        full[i, :, i, :] = block
    return full.reshape(T * G * S, T * G * S)


def conditioned(V, rows, noise, observed, counted):
    """Mean, covariance and log density given what counts, all at once."""
    k = counted.ravel()
    G, o = rows.reshape(k.size, -1)[k], observed.ravel()[k]
    if not k.any():
        return np.zeros(len(V)), V, 0.0
    S = G @ V @ G.T + dense_noise(noise)[np.ix_(k, k)]
    gain = V @ G.T @ np.linalg.inv(S)
    return gain @ o, V - gain @ G @ V, -0.5 * (o @ np.linalg.solve(S, o) + np.linalg.slogdet(2 * np.pi * S)[1])


class Scene:
    """Random groups of states, sensors that change with time, readings of which some are missing and some not believed."""

    def __init__(self, seed, r, n_groups, n_sensors, n_states, n_steps, missing, doubted):
        rng = np.random.default_rng(seed)
        self.shape = (n_steps, n_groups, n_sensors, n_states, r)
        self.A = rng.standard_normal((n_groups, n_states, n_states)) / np.sqrt(n_states)
        self.Q = random_covariance(rng, (n_groups,), n_states, 1)
        self.designs = rng.standard_normal((n_steps, n_groups, n_sensors, r))
        self.sensors = rng.standard_normal((n_steps, n_groups, n_sensors, n_states))
        sizes = 10 ** rng.uniform(-1, 0.5, (n_steps, n_groups, n_sensors, 1))
        unit = random_covariance(rng, (n_steps, n_groups), n_sensors, n_sensors) + 0.1 * np.eye(n_sensors)
        self.noise = sizes * unit * sizes.mT
        self.observed = rng.standard_normal((n_steps, n_groups, n_sensors))
        self.observed[rng.random(self.observed.shape) < missing] = np.nan
        self.believed = rng.random(self.observed.shape) >= doubted
        self.counted = ~np.isnan(self.observed) & self.believed
        self.V, self.rows = dense(self.A, self.Q, self.designs, self.sensors)

    def filtered(self):
        """Updates and the log-likelihood of everything."""
        _, n_groups, _, n_states, r = self.shape
        belief, deviation, total = unit_belief((), r), no_deviation((n_groups,), n_states, r), 0.0
        for t, values in enumerate(zip(self.observed, self.designs, self.sensors, self.noise, self.believed, strict=True)):
            deviation = predict_deviation(deviation, self.A, self.Q) if t else deviation
            update = observe_deviation(belief, deviation, *values)
            belief, deviation, total = update.seen.belief, update.deviation, total + update.seen.log_likelihoods.sum()
            yield update, total

    def given(self, until=None):
        """What brute force says, given what counts up to and including a time."""
        times = np.arange(len(self.observed))[:, None, None]
        counted = self.counted if until is None else self.counted & (times <= until)
        return conditioned(self.V, self.rows, self.noise, self.observed, counted)

    def block(self, t, g):
        """Where d_g[t] is in the dense vector."""
        n_steps, _, _, n_states, r = self.shape
        first = r + (g * n_steps + t) * n_states
        return slice(first, first + n_states)


scenes = st.builds(
    Scene, seeds, st.integers(1, 4), st.integers(1, 3), st.integers(1, 3), st.integers(1, 3), st.integers(1, 6),
    st.sampled_from([0.0, 0.3, 0.9]), st.sampled_from([0.0, 0.3]),
)  # fmt: skip


@given(scenes)
def test_filter_and_smoother_are_dense(scene):
    updates = []
    for update, reached in scene.filtered():
        updates.append(update)
        total = reached
    mean, left, density = scene.given()
    belief, r = updates[-1].seen.belief, scene.shape[-1]
    assert total == pytest.approx(density, rel=1e-6, abs=1e-6)
    np.testing.assert_allclose(belief.mean, mean[:r], atol=1e-6)
    np.testing.assert_allclose(belief.covariance, left[:r, :r], atol=1e-6)
    for t, smoothed in enumerate(smooth_deviations(updates, scene.A)):
        for g in range(scene.shape[1]):
            block = scene.block(t, g)
            got, covariance = linear_moments(belief, smoothed.loading[g])
            np.testing.assert_allclose(got + smoothed.offset[g], mean[block], atol=1e-5)
            np.testing.assert_allclose(covariance + smoothed.covariance[g], left[block, block], atol=1e-5)


@settings(max_examples=20)
@given(scenes)
def test_every_update_is_dense(scene):
    """States, innovations and their covariance across all groups, after each time."""
    for t, (update, _) in enumerate(scene.filtered()):
        before, spread, _ = scene.given(until=t - 1)
        rows = scene.rows[t].reshape(-1, len(before))
        wanted = scene.observed[t].ravel() - rows @ before
        wanted_covariance = rows @ spread @ rows.T + dense_noise(scene.noise[[t]])
        np.testing.assert_allclose(update.seen.innovation, wanted, atol=1e-6)  # NaN where not seen, a number if not believed
        np.testing.assert_allclose(update.seen.innovation_covariance, wanted_covariance, rtol=1e-6, atol=1e-6)
        np.testing.assert_array_equal(update.seen.fused, scene.counted[t].ravel())
        assert not update.seen.log_likelihoods[~scene.counted[t].ravel()].any()
        mean, left, _ = scene.given(until=t)
        for g in range(scene.shape[1]):
            block = scene.block(t, g)
            got, covariance = linear_moments(update.seen.belief, update.deviation.loading[g])
            np.testing.assert_allclose(got + update.deviation.offset[g], mean[block], atol=1e-6)
            np.testing.assert_allclose(covariance + update.deviation.covariance[g], left[block, block], atol=1e-6)


@settings(max_examples=20)
@given(scenes)
def test_what_is_not_believed_might_as_well_be_missing(scene):
    doubted = list(scene.filtered())
    scene.observed, scene.believed = np.where(scene.counted, scene.observed, np.nan), np.ones_like(scene.believed)
    for (one, total), (other, same) in zip(doubted, scene.filtered(), strict=True):
        assert total == same
        for a, b in zip(
            (*one.deviation, *one.seen.belief, *one[2:]), (*other.deviation, *other.seen.belief, *other[2:]), strict=True
        ):
            np.testing.assert_array_equal(a, b)


@settings(max_examples=20)
@given(seeds, st.integers(1, 3), st.integers(1, 3), st.sampled_from([0.0, 0.4]))
def test_two_groups_are_one_whose_matrices_are_block_diagonal(seed, n_sensors, n_states, missing):
    """The path that sensors take which see several degrees of freedom gives what the other one gives."""
    scene = Scene(seed, 3, 2, n_sensors, n_states, 5, missing, 0.0)
    apart = [update for update, _ in scene.filtered()]
    blocks = [
        np.zeros((*x.shape[:-3], 1, 2 * x.shape[-2], 2 * x.shape[-1])) for x in (scene.A, scene.Q, scene.sensors, scene.noise)
    ]
    for whole, part in zip(blocks, (scene.A, scene.Q, scene.sensors, scene.noise), strict=True):
        rows, columns = part.shape[-2:]
        whole[..., 0, :rows, :columns], whole[..., 0, rows:, columns:] = part[..., 0, :, :], part[..., 1, :, :]
    A, Q, sensors, noise = blocks
    belief, deviation = unit_belief((), 3), no_deviation((1,), 2 * n_states, 3)
    together = []
    for t in range(5):
        deviation = predict_deviation(deviation, A, Q) if t else deviation
        values = scene.observed[t].reshape(1, -1), scene.designs[t].reshape(1, 2 * n_sensors, 3), sensors[t], noise[t]
        update = observe_deviation(belief, deviation, *values)
        belief, deviation = update.seen.belief, update.deviation
        together.append(update)
    for one, other in zip(apart, together, strict=True):
        for a, b in zip((*one.seen.belief, *one.seen[1:]), (*other.seen.belief, *other.seen[1:]), strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-11)
    for one, other in zip(smooth_deviations(apart, scene.A), smooth_deviations(together, A), strict=True):
        np.testing.assert_allclose(one.offset.ravel(), other.offset.ravel(), rtol=1e-9, atol=1e-11)
        for g in range(2):
            own = slice(g * n_states, (g + 1) * n_states)
            np.testing.assert_allclose(one.covariance[g], other.covariance[0, own, own], rtol=1e-9, atol=1e-11)


def test_a_batch_is_its_members():
    rng = np.random.default_rng(0)
    deviation = Deviation(
        *(rng.standard_normal((2, 3, 2, *tail)) for tail in ((3,), (3, 4))), random_covariance(rng, (2, 3, 2), 3, 3)
    )
    designs, observed = rng.standard_normal((2, 3, 2, 2, 4)), rng.standard_normal((2, 3, 2, 2))
    observed[0, 1, 1, 0] = np.nan
    sensors, noise = rng.standard_normal((2, 2, 3)), random_covariance(rng, (2,), 2, 2) + np.eye(2)  # shared by the batch
    believed = np.ones(observed.shape, dtype=bool)
    believed[1, 2, 0, 1] = False
    together = observe_deviation(unit_belief((2, 3), 4), deviation, observed, designs, sensors, noise, believed)
    for index in np.ndindex(2, 3):
        own = Deviation(*(part[index] for part in deviation))
        alone = observe_deviation(unit_belief((), 4), own, observed[index], designs[index], sensors, noise, believed[index])
        for a, b in zip((*together.seen.belief, *together.seen[1:]), (*alone.seen.belief, *alone.seen[1:]), strict=True):
            np.testing.assert_allclose(a[index], b, atol=1e-12)
        for a, b in zip((*together.deviation, *together[2:]), (*alone.deviation, *alone[2:]), strict=True):
            np.testing.assert_allclose(a[index], b, atol=1e-12)


def test_without_deviations_it_is_the_static_filter():
    rng = np.random.default_rng(0)
    designs, observed = rng.standard_normal((3, 2, 1, 4)), rng.standard_normal((3, 2, 1))
    noise, position = np.array([[[0.1]], [[0.2]]]), np.array([[[0.0, 0.0, 1.0]]])
    update = observe_deviation(unit_belief((3,), 4), no_deviation((3, 2), 3, 4), observed, designs, position, noise)
    static = observe(unit_belief((3,), 4), observed[..., 0], designs[..., 0, :], np.diag([0.1, 0.2]))
    np.testing.assert_array_equal(update.seen.belief.covariance, static.belief.covariance)
    np.testing.assert_array_equal(update.seen.log_likelihoods, static.log_likelihoods)
    assert not any(part.any() for part in update.deviation)
