"""What a channel adds to the surprise at a movement, against its definition, computed densely."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from detection.paths import random_felt_model, random_paths, with_gaps
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import seeds

from probdmp.detection.channel_statistics import CHANNEL_LAGS, MOVEMENT_LAGS, SHIFTS, ChannelStatistic
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.trajectory_model import MOVEMENT_CHANNELS, TrajectoryModel
from probdmp.detection.trajectory_statistics import SHIFT_STD
from probdmp.detection.windows import gather

LENGTH = 130
LOOKED_AT = (0, 2, 9, 14, 50, 94, 100, 106, 129)


def judged(statistic, paths, means):
    """Values (n, T) of paths (n, T, S)."""
    ticks = np.arange(paths.shape[1])
    return statistic.judge(ticks, gather(paths, ticks, statistic.offsets), means)


def places(tick, lags, shift):
    """Ticks of the model with which the samples so long ago are compared; before the start there is no tempo."""
    tick = min(tick, TICKS + SHIFTS.max())  # further on nothing is expected to change
    return [0 if tick - lag <= 0 else int(np.clip(tick - lag + shift, 0, TICKS)) for lag in lags]


def squares(model, path, tick, shift, signal, means):
    """Of the movement, and of the channel given the movement, at one shift; only of what was seen. And how many were."""
    d = model.goal_gains.shape[-1]
    chosen = [(at, lag, s) for s in range(d) for at, lag in zip(places(tick, MOVEMENT_LAGS, shift), MOVEMENT_LAGS, strict=True)]
    chosen += [(at, lag, signal) for at, lag in zip(places(tick, CHANNEL_LAGS, shift), CHANNEL_LAGS, strict=True)]
    errors = np.array([path[max(tick - lag, 0), s] - means[at, s] for at, lag, s in chosen])
    covariance = np.array([[model.covariance[a, s, b, r] for b, _, r in chosen] for a, _, s in chosen])
    covariance = covariance + np.diag([model.noise_variances[s] for _, _, s in chosen])
    seen = ~np.isnan(errors)
    is_channel = np.array([s == signal for _, _, s in chosen])
    m, c = np.flatnonzero(seen & ~is_channel), np.flatnonzero(seen & is_channel)
    gain = covariance[np.ix_(c, m)] @ np.linalg.inv(covariance[np.ix_(m, m)])
    left = errors[c] - gain @ errors[m]
    conditional = covariance[np.ix_(c, c)] - gain @ covariance[np.ix_(m, c)]
    of_movement = errors[m] @ np.linalg.solve(covariance[np.ix_(m, m)], errors[m])
    return of_movement, left @ np.linalg.solve(conditional, left), len(c)


def by_definition(model, path, tick, signal, means):
    found = [squares(model, path, tick, shift, signal, means) for shift in SHIFTS]
    penalties = (SHIFTS / SHIFT_STD) ** 2
    both = min(m + c + p for (m, c, _), p in zip(found, penalties, strict=True))
    movement = min(m + p for (m, _, _), p in zip(found, penalties, strict=True))
    return (both - movement) / found[0][2] if found[0][2] else np.nan


@cache
def model_of(seed, n_dof, n_channels=1):
    return random_felt_model(np.random.default_rng(seed), n_dof, n_channels)


@cache
def statistic_of(seed, n_dof, signal):
    return ChannelStatistic(model_of(seed, n_dof), signal)


# --- the definition ---------------------------------------------------------------------------------------------------


@settings(max_examples=6)
@given(seeds, st.sampled_from([1, 2, 3]), st.booleans(), st.booleans())
def test_a_channel_is_judged_given_the_movement(seed, n_dof, gaps, told):
    """Of two channels each by itself; one shift for the movement and the channel."""
    rng, model = np.random.default_rng(seed), model_of(seed, n_dof, 2)
    path = random_paths(model, rng, 1, LENGTH)
    if gaps:
        path = with_gaps(path, rng)
    goals = path[:, -1, :n_dof] if told and not gaps else np.full((1, n_dof), np.nan)
    means = model.means_for(goals)
    for signal in (n_dof, n_dof + 1):
        found = judged(ChannelStatistic(model, signal), path, means)[0]
        for tick in LOOKED_AT:
            expected = by_definition(model, path[0], tick, signal, means[0])
            assert found[tick] == pytest.approx(expected, rel=1e-6, abs=1e-6, nan_ok=True)


@settings(max_examples=10)
@given(seeds)
def test_a_channel_adds_nothing_that_is_negative(seed):
    rng, model = np.random.default_rng(seed), model_of(0, 2)
    paths = with_gaps(random_paths(model, rng, 2, LENGTH), rng, 0.3)
    found = judged(statistic_of(0, 2, 2), paths, np.stack([model.means] * 2))
    assert np.nanmin(found) >= -1e-9


def test_of_what_is_as_expected_it_is_about_one():
    """Per number that was seen; less, since the least over shifts is taken."""
    rng, model = np.random.default_rng(0), model_of(1, 2)
    paths = random_paths(model, rng, 200, TICKS + 1)
    found = judged(ChannelStatistic(model, 2), paths, np.broadcast_to(model.means, (200, *model.means.shape)))
    assert 0.7 < found[:, 20:].mean() < 1.1


# --- missing samples --------------------------------------------------------------------------------------------------


@settings(max_examples=10)
@given(seeds)
def test_without_the_channel_there_is_no_evidence(seed):
    rng, model = np.random.default_rng(seed), model_of(0, 2)
    path = random_paths(model, rng, 1, LENGTH)
    path[0, 40:80, 2] = np.nan
    found = judged(statistic_of(0, 2, 2), path, model.means[None])[0]
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(found)), np.arange(40 + CHANNEL_LAGS.max(), 80))


def test_without_the_movement_the_channel_is_judged_by_itself():
    """As in a model in which nothing else is; which shift is least is then for the channel alone to say."""
    rng, model = np.random.default_rng(3), model_of(3, 2)
    path = random_paths(model, rng, 1, LENGTH)
    path[..., :2] = np.nan
    covariance = np.array(model.covariance)
    covariance[:, 2, :, :2] = covariance[:, :2, :, 2] = 0.0
    still = replace(model, covariance=covariance)
    one, other = (judged(ChannelStatistic(m, 2), path, model.means[None]) for m in (model, still))
    np.testing.assert_allclose(one, other, rtol=1e-9)
    assert np.isfinite(one).all()


@settings(max_examples=10)
@given(seeds, st.integers(2, 6))
def test_a_slow_channel_counts_per_number(seed, every):
    """What was measured less often says as much, as far as it was measured."""
    rng, model = np.random.default_rng(seed), model_of(0, 1)
    path = random_paths(model, rng, 1, LENGTH)
    path[0, np.arange(LENGTH) % every > 0, 1] = np.nan
    found = judged(statistic_of(0, 1, 1), path, model.means[None])[0]
    for tick in LOOKED_AT:
        expected = by_definition(model, path[0], tick, 1, model.means)
        assert found[tick] == pytest.approx(expected, rel=1e-6, abs=1e-6, nan_ok=True)


# --- invariances ------------------------------------------------------------------------------------------------------


@settings(max_examples=10)
@given(seeds, st.floats(-6, 6), st.floats(-100, 100))
def test_units_of_the_channel_do_not_matter(seed, exponent, offset):
    """Nor where its zero is."""
    rng, model, unit = np.random.default_rng(seed), model_of(0, 2), 10**exponent
    path, factors, offsets = random_paths(model, rng, 1, 60), np.array([1, 1, unit]), np.array([0, 0, offset * unit])
    other = PathModel(
        model.means * factors + offsets,
        model.covariance * np.multiply.outer(factors, factors)[:, None],
        model.goal_gains * factors[:, None],
        model.noise_variances * factors**2,
    )
    found = judged(statistic_of(0, 2, 2), path, model.means[None])
    scaled = judged(ChannelStatistic(other, 2), path * factors + offsets, other.means[None])
    np.testing.assert_allclose(scaled, found, rtol=1e-5, atol=1e-6)


def test_other_channels_and_the_order_of_degrees_of_freedom_do_not_matter():
    rng, model = np.random.default_rng(5), model_of(5, 2, 2)
    path, order = random_paths(model, rng, 1, LENGTH), [1, 0, 3]
    other = PathModel(
        model.means[:, order],
        model.covariance[:, order][:, :, :, order],
        model.goal_gains[:, order][:, :, [1, 0]],
        model.noise_variances[order],
    )
    one = judged(ChannelStatistic(model, 3), path, model.means[None])
    np.testing.assert_allclose(judged(ChannelStatistic(other, 2), path[..., order], other.means[None]), one, rtol=1e-7)


def test_a_channel_that_has_nothing_to_do_with_the_movement():
    """And always reads the same, but for its level: whatever the movement does, it is the distance of the level."""
    rng, model = np.random.default_rng(0), model_of(0, 2)
    covariance, means = np.array(model.covariance), np.array(model.means)
    covariance[:, 2], covariance[:, :, :, 2] = 0.0, 0.0
    covariance[:, 2, :, 2], means[:, 2] = 0.3**2, 1.5
    apart = replace(model, means=means, covariance=covariance)
    paths = random_paths(apart, rng, 3, LENGTH)
    paths[1, :, :2] += 5 * rng.standard_normal((LENGTH, 2))  # a movement as it should not be
    paths[2, :, :2] = np.nan
    paths[1:, :, 2] = paths[0, :, 2]
    found = judged(ChannelStatistic(apart, 2), paths, np.stack([means] * 3))
    n = len(CHANNEL_LAGS)
    level = 0.3**2 * np.ones((n, n)) + model.noise_variances[2] * np.eye(n)
    for tick in (20, 60, 120):
        e = paths[0, tick - CHANNEL_LAGS, 2] - 1.5
        np.testing.assert_allclose(found[:, tick], e @ np.linalg.solve(level, e) / n, rtol=1e-6)


def test_a_force_that_goes_with_a_large_movement_is_no_surprise():
    """When the movement is large, and is one when it is not: here it is twice the only position, but for a little."""
    model = model_of(2, 1)
    covariance, means, own = np.array(model.covariance), np.array(model.means), model.covariance[:, 0, :, 0]
    covariance[:, 1, :, 0] = covariance[:, 0, :, 1] = 2 * own
    covariance[:, 1, :, 1], means[:, 1] = 4 * own + 0.02**2, 2 * means[:, 0]
    model = replace(model, means=means, covariance=covariance)
    eigenvalues, vectors = np.linalg.eigh(own)
    larger = np.sqrt(eigenvalues[-1]) * vectors[:, -1]  # the commonest way to be so, by one standard deviation
    large, firm = np.column_stack([means[:, 0] + 3 * larger] * 2), np.column_stack([means[:, 0], means[:, 0] + 3 * larger])
    large[:, 1] *= 2
    firm[:, 1] *= 2
    both, alone = judged(ChannelStatistic(model, 1), np.stack([large, firm]), np.stack([means] * 2))[:, 30:]
    assert both.max() < 1
    assert alone.min() > 2
    assert np.median(alone) > 50 * np.median(both)


# --- at work ----------------------------------------------------------------------------------------------------------


@settings(max_examples=10)
@given(seeds, st.sampled_from([1, 5, 93, 150]), st.booleans(), st.booleans())
def test_tick_by_tick_is_side_by_side(felt, seed, length, gaps, told):
    rng, model = np.random.default_rng(seed), felt[1]
    paths = random_paths(model, rng, 2, length)
    if gaps:
        paths = with_gaps(paths, rng)
    goals = paths[:, -1, :2] if told and not gaps else np.full((2, 2), np.nan)
    together = felt[0].values(paths, goals)
    for path, goal, values in zip(paths, goals, together, strict=True):
        follower = felt[0].follow(goal)
        alone = np.stack([follower.update(row) for row in path])
        np.testing.assert_allclose(
            alone[:, len(MOVEMENT_CHANNELS) :], values[:, len(MOVEMENT_CHANNELS) :], rtol=1e-9, atol=1e-9
        )
        np.testing.assert_allclose(alone, values, rtol=1e-6, atol=1e-9)


@pytest.fixture(scope="module")
def felt():
    """All channels of a movement with two learned ones, and its model."""
    model = model_of(7, 2, 2)
    return TrajectoryModel(model), model


def test_each_learned_channel_has_a_value_of_its_own(felt):
    """After those of the movement, which do not hear of it."""
    (trajectory, model), rng = felt, np.random.default_rng(0)
    path = random_paths(model, rng, 1, LENGTH)
    values = trajectory.values(path, np.full((1, 2), np.nan))
    assert values.shape == (1, LENGTH, len(MOVEMENT_CHANNELS) + 2)
    wrong = np.array(path)
    wrong[:, 50:, 3] += 4
    changed = trajectory.values(wrong, np.full((1, 2), np.nan))
    np.testing.assert_array_equal(changed[..., :-1], values[..., :-1])
    assert np.all(changed[0, 50:, -1] > 10 * values[0, 50:, -1])
    np.testing.assert_array_equal(changed[0, :50, -1], values[0, :50, -1])
    bare = TrajectoryModel(model.of_movement()).values(path[..., :2], np.full((1, 2), np.nan))
    np.testing.assert_allclose(bare, values[..., : len(MOVEMENT_CHANNELS)], rtol=1e-9)


@settings(max_examples=10)
@given(seeds, st.integers(1, LENGTH))
def test_values_never_look_ahead(seed, length):
    rng, model = np.random.default_rng(seed), model_of(0, 1)
    path = with_gaps(random_paths(model, rng, 1, LENGTH), rng)
    statistic = statistic_of(0, 1, 1)
    whole, begun = (judged(statistic, path[:, :n], model.means[None])[0] for n in (LENGTH, length))
    np.testing.assert_allclose(begun, whole[:length], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("tick", [4, 60, 129])
def test_a_channel_is_blamed_with_the_sign_of_its_deviation(tick, sign):
    rng, model = np.random.default_rng(0), model_of(0, 2)
    statistic, path = ChannelStatistic(model, 2), random_paths(model, rng, 1, LENGTH)[0]
    path[:, 2] += 3 * sign
    window = path[np.maximum(tick + statistic.offsets, 0)]
    shares = statistic.contributions(tick, window, model.means)
    np.testing.assert_array_equal(shares[:2], 0)
    assert shares[2] == pytest.approx(sign * judged(statistic, path[None], model.means[None])[0, tick], rel=1e-9)
    unseen = np.array(window)
    unseen[-1, 2] = np.nan  # now; what was seen last is still too high or too low
    assert np.sign(statistic.contributions(tick, unseen, model.means)[2]) == sign
    unseen[:, 2] = np.nan
    np.testing.assert_array_equal(statistic.contributions(tick, unseen, model.means), 0)
