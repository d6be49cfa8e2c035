"""Channels that are learned with a movement, and whether signals vary together: data of which it is known how they do."""

from dataclasses import replace

import numpy as np
import pytest

from probdmp import ProbabilisticDMP
from probdmp.demonstrations import Demonstration
from probdmp.dmp import Configuration, path_distribution, task_for
from probdmp.dmp.responses import parameter_responses
from probdmp.errors import InputError, InputTypeError
from probdmp.execution import roll_out, score_recordings, smooth_recordings, task_of_recording
from probdmp.learning import LearningOptions, fit_primitive, left_out_primitives
from probdmp.learning.hierarchical import PRIOR_WEIGHT, estimate_variation

STEPS, MIDDLE = 51, 25
ROUNDING = 5e-5
"""Of mean paths, a twentieth of the sensor noise: parameters are of very different size, and rounding grows with that."""
S = np.linspace(0, 1, STEPS)
JERK = 10 * S**3 - 15 * S**4 + 6 * S**5
BUMPS = np.stack(
    [np.sin(np.pi * S) ** 2, np.sin(2 * np.pi * S) * S * (1 - S) * 4, np.sin(np.pi * S) ** 2 * (S - 0.5) * 3, JERK]
)


def pushes(n, correlation, seed=0):
    """Reaches of which the first degree of freedom bulges as much as a force does, as far as they are correlated."""
    rng, demonstrations = np.random.default_rng(seed), []
    for _ in range(n):
        bulge, goal, other, rest = rng.standard_normal(4)
        force = correlation * bulge + np.sqrt(1 - correlation**2) * rest
        x, y = (1 + 0.05 * goal) * JERK + 0.15 * bulge * BUMPS[0], -0.5 * (1 + 0.1 * other) * JERK
        positions = np.column_stack([x, y]) + 1e-3 * rng.standard_normal((STEPS, 2))
        channels = {"force": 5 + (3 + 1.5 * force) * BUMPS[0] + 0.02 * rng.standard_normal(STEPS)}
        demonstrations.append(Demonstration(positions, 0.02, names=("x", "y"), channels=channels))
    return demonstrations


def pairs(n, correlation, seed=0):
    """Two degrees of freedom that bulge in three ways and end in different places, each with that of the other correlated."""
    rng, demonstrations = np.random.default_rng(seed), []
    for _ in range(n):
        z = rng.standard_normal((4, 2))
        z[:, 1] = correlation * z[:, 0] + np.sqrt(1 - correlation**2) * z[:, 1]
        positions = np.column_stack([JERK, np.zeros(STEPS)]) + 0.1 * BUMPS.T @ z
        demonstrations.append(Demonstration(positions + 1e-3 * rng.standard_normal((STEPS, 2)), 0.02, names=("x", "y")))
    return demonstrations


def learn(demonstrations, channels=(), **choices):
    configuration = Configuration(n_basis=8, weight_uncertainty="joint", **choices)
    return fit_primitive(demonstrations, configuration, LearningOptions("hierarchical", channels=channels))[0]


def middle(primitive):
    """Standard deviations of x, y and force halfway, and their correlations."""
    covariance = path_distribution(primitive, STEPS).covariance[MIDDLE, :, MIDDLE]
    stds = np.sqrt(np.diagonal(covariance))
    return stds, covariance / np.outer(stds, stds)


@pytest.fixture(scope="module")
def taught():
    return pushes(30, 0.95)


@pytest.fixture(scope="module")
def felt(taught):
    return learn(taught, ["force"])


# --- what is learned of channels --------------------------------------------------------------------------------------


def test_what_a_channel_reads_is_learned(taught, felt):
    mean, covariance = path_distribution(felt, STEPS)
    forces = np.stack([d.channels["force"] for d in taught])
    spread = forces.std(axis=0).max()
    np.testing.assert_allclose(mean[:, 2], forces.mean(axis=0), atol=0.02 * spread)
    stds = np.sqrt(np.einsum("mdmd->md", covariance))[:, 2]
    np.testing.assert_allclose(stds[MIDDLE], forces[:, MIDDLE].std(), rtol=0.3)  # half of it is what the prior says
    assert np.sqrt(felt.channels.observation_variances[0]) == pytest.approx(0.02, rel=0.2)
    assert felt.channels.ranges[0] == pytest.approx(np.ptp(forces, axis=1).mean(), rel=1e-9)


@pytest.mark.parametrize(("correlation", "least", "most"), [(0.95, 0.45, 0.95), (-0.95, -0.95, -0.45), (0.0, -0.2, 0.2)])
def test_how_it_varies_with_the_movement_is_recovered(correlation, least, most):
    """The sign, the size but for the prior, which knows of no correlation and counts half, and nothing where nothing is."""
    demonstrations = pushes(60, correlation)
    found = middle(learn(demonstrations, ["force"]))[1]
    assert least < found[0, 2] < most
    assert abs(found[1, 2]) < 0.2  # the other degree of freedom has nothing to do with it
    positions = np.array([d.positions[MIDDLE] - d.positions[0] for d in demonstrations])
    forces = np.array([d.channels["force"][MIDDLE] for d in demonstrations])
    measured = np.corrcoef(positions[:, 0], forces)[0, 1]
    assert abs(found[0, 2] - (1 - PRIOR_WEIGHT) * measured) < 0.2


def test_what_the_movement_shows_predicts_the_channel(felt):
    """Of new executions: half of the error is gone, and the rest is as large as said."""
    fresh, plan = pushes(40, 0.95, seed=9), roll_out(felt, task_for(felt), 0.02).channels["force"]
    blind = [replace(d, channels={}) for d in fresh]
    means, covariances = smooth_recordings(felt, [task_of_recording(felt, d) for d in blind], blind)
    forces = np.array([d.channels["force"][MIDDLE] for d in fresh])
    errors = forces - means[MIDDLE, :, 2, 2]
    assert np.sqrt(np.mean(errors**2)) < 0.6 * np.sqrt(np.mean((forces - plan.means[MIDDLE]) ** 2))
    assert np.mean(np.abs(errors) < 1.96 * np.sqrt(covariances[MIDDLE, :, 2, 2, 2])) >= 0.9


def test_a_channel_may_have_gaps_and_a_rate_of_its_own(taught, felt):
    """Measured at every fourth sample it is much the same channel."""
    slow = [replace(d, channels={"force": np.where(np.arange(STEPS) % 4 == 0, d.channels["force"], np.nan)}) for d in taught]
    found, whole = path_distribution(learn(slow, ["force"]), STEPS), path_distribution(felt, STEPS)
    np.testing.assert_allclose(found.means[:, 2], whole.means[:, 2], atol=0.05)
    one, other = (d.covariance[MIDDLE, :, MIDDLE] for d in (found, whole))
    np.testing.assert_allclose(one[:, 2], other[:, 2], atol=0.1 * other[2, 2])


def test_units_of_a_channel_scale_it_alone(taught, felt):
    other = learn([replace(d, channels={"force": 1000 * d.channels["force"]}) for d in taught], ["force"])
    one, scaled = path_distribution(felt, STEPS), path_distribution(other, STEPS)
    np.testing.assert_allclose(scaled.means / [1, 1, 1000], one.means, atol=ROUNDING)
    unit = np.array([1.0, 1.0, 1000.0])
    got = scaled.covariance / (unit[:, None, None] * unit)
    np.testing.assert_allclose(got, one.covariance, atol=1e-4 * np.abs(one.covariance).max())


def test_the_order_of_channels_orders_them():
    demonstrations = [replace(d, channels=dict(d.channels) | {"heat": d.positions[:, 1] * 2 + 1}) for d in pushes(10, 0.9)]
    one, other = (path_distribution(learn(demonstrations, names), STEPS) for names in (["force", "heat"], ["heat", "force"]))
    order = [0, 1, 3, 2]
    np.testing.assert_allclose(other.means[:, order], one.means, atol=ROUNDING)
    turned = other.covariance[:, order][:, :, :, order]
    np.testing.assert_allclose(turned, one.covariance, atol=1e-4 * np.abs(one.covariance).max())


def test_channels_are_left_out_unless_asked_for(taught):
    """A movement learned without them is that of demonstrations without them."""
    one, other = learn(taught), learn([replace(d, channels={}) for d in taught])
    assert one.channels is None
    assert one.identity == other.identity


def test_the_movement_is_learned_much_as_without(taught, felt):
    """What a channel tells of the demonstrations beyond what positions do is little."""
    bare = learn(taught)
    one, other = path_distribution(bare, STEPS), path_distribution(felt, STEPS)
    stds = np.sqrt(np.einsum("mdmd->md", one.covariance))
    np.testing.assert_allclose(other.means[:, :2], one.means, atol=0.02 * stds.max())
    np.testing.assert_allclose(np.sqrt(np.einsum("mdmd->md", other.covariance))[:, :2], stds, atol=0.05 * stds.max())
    np.testing.assert_allclose(felt.goal, bare.goal, atol=1e-3)


def test_a_channel_that_never_changes_says_so(taught):
    flat = [replace(d, channels={"force": np.full(STEPS, 7.0)}) for d in taught[:6]]
    p = learn(flat, ["force"])
    rolled = roll_out(p, task_for(p), 0.02).channels["force"]
    np.testing.assert_allclose(rolled.means, 7.0, atol=0.02)
    assert np.isfinite(rolled.stds).all()


def test_one_demonstration_will_do(taught):
    p = learn(taught[:1], ["force"])
    rolled = roll_out(p, task_for(p), 0.02).channels["force"]
    np.testing.assert_allclose(rolled.means, taught[0].channels["force"], atol=0.1)
    assert rolled.stds[MIDDLE] > 0.1  # as far as executions are believed to stray


def test_those_left_out_have_the_channels_too(taught):
    p = learn(taught[:3], ["force"])
    left = list(left_out_primitives(p, taught[:3]))
    for k, primitive in enumerate(left):
        alone = learn([d for i, d in enumerate(taught[:3]) if i != k], ["force"])
        np.testing.assert_allclose(primitive.channels.means, alone.channels.means, rtol=0.05, atol=0.5)
        np.testing.assert_array_equal(primitive.channels.observation_variances, p.channels.observation_variances)
        assert primitive.channel_names == ("force",)
    assert len({primitive.identity for primitive in left}) == 3


# --- the estimate -----------------------------------------------------------------------------------------------------


def test_the_start_of_a_channel_is_a_parameter_that_of_a_position_is_not():
    m = 40
    responses = parameter_responses(Configuration(n_basis=5), 1 / (m - 1), m)[:, 2]
    rng = np.random.default_rng(0)
    starts = 3 + rng.standard_normal((50, 1, 1))
    paths = np.concatenate([np.zeros((50, m, 1)), starts + np.zeros((50, m, 1))], axis=2)
    paths[:, 1:] += 1e-3 * rng.standard_normal((50, m - 1, 2))
    found = estimate_variation(responses, paths, np.ones(2), n_channels=1)
    assert found.means.shape == (2, 8)
    assert found.means[0, 0] == pytest.approx(0, abs=1e-3)
    assert found.means[1, 0] == pytest.approx(starts.mean(), abs=0.01)
    covariance = found.covariance.reshape(2, 8, 2, 8)
    assert abs(covariance[0, 0, 0, 0]) < 1e-9
    assert 0.3 < covariance[1, 0, 1, 0] / starts.var() < 1.5


def test_without_channels_signals_are_seen_from_their_start():
    m = 40
    responses = parameter_responses(Configuration(n_basis=5), 1 / (m - 1), m)[:, 2]
    paths = np.random.default_rng(0).standard_normal((6, 1, 2)) * np.linspace(0, 1, m)[:, None]
    found = estimate_variation(responses, paths, np.ones(2))
    assert found.means.shape == (2, 8)
    assert not found.means[:, 0].any()
    assert not found.covariance.reshape(2, 8, 2, 8)[:, 0].any()


# --- whether signals vary together ------------------------------------------------------------------------------------


def cross_blocks(primitive):
    d, n = primitive.variation.means.shape
    return primitive.variation.covariance.reshape(d, n, d, n)[0, :, 1]


def test_none_and_full_are_what_they_say():
    demonstrations = pairs(12, 0.9)
    none, full = learn(demonstrations, coupling="none"), learn(demonstrations)
    assert not cross_blocks(none).any()
    assert cross_blocks(full).any()
    one, other = (np.sqrt(np.einsum("mdmd->md", path_distribution(p, STEPS).covariance)) for p in (none, full))
    np.testing.assert_allclose(one, other, rtol=0.1, atol=0.02 * other.max())  # each by itself they are much the same


def test_channels_too_may_vary_by_themselves(taught):
    p = learn(taught[:10], ["force"], coupling="none")
    assert not p.channels.cross_covariance.any()


def test_auto_takes_what_is_likelier_on_demonstrations_left_out():
    """Nearly always full where degrees of freedom are strongly coupled, mostly none where they are not."""
    strong = [bool(cross_blocks(learn(pairs(12, 0.9, seed), coupling="auto")).any()) for seed in range(4)]
    apart = [bool(cross_blocks(learn(pairs(12, 0.0, seed), coupling="auto")).any()) for seed in range(8)]
    assert all(strong)
    assert np.mean(apart) <= 0.4


def test_whoever_does_not_know_does_best_with_auto():
    """Log-likelihood of new executions: it is sometimes wrong, but less than either choice made once and for all."""
    scores = {coupling: {0.0: [], 0.9: []} for coupling in ("none", "full", "auto")}
    for correlation in (0.0, 0.9):
        for seed in range(3):
            demonstrations, fresh = pairs(8, correlation, seed), pairs(25, correlation, 1000 + seed)
            for coupling, found in scores.items():
                p = learn(demonstrations, coupling=coupling)
                found[correlation].append(score_recordings(p, [task_of_recording(p, d) for d in fresh], fresh).mean())
    none, full, auto = ({c: np.mean(values) for c, values in found.items()} for found in scores.values())
    assert none[0.0] > full[0.0] + 0.3  # nats per execution
    assert full[0.9] > none[0.9] + 0.3
    assert auto[0.9] == full[0.9]
    assert auto[0.0] > full[0.0]
    assert sum(auto.values()) > max(sum(none.values()), sum(full.values()))


def test_auto_keeps_channels_that_vary_with_the_movement(taught):
    assert learn(taught, ["force"], coupling="auto").channels.cross_covariance.any()


def test_with_too_few_demonstrations_to_leave_one_out_auto_is_full():
    assert learn(pairs(2, 0.0), coupling="auto").identity != learn(pairs(2, 0.0), coupling="none").identity
    assert cross_blocks(learn(pairs(2, 0.0), coupling="auto")).any()


# --- what cannot be ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "error", "match"),
    [
        ({"channels": ["heat"]}, InputError, r"demonstrations with the channels 'heat', got one with 'force'"),
        ({"channels": "force"}, InputTypeError, r"channels as a list of names, got 'force'\. Write channels=\['force'\]"),
        ({"channels": ["force", "force"]}, InputError, "different names in channels"),
        ({"channels": [1]}, InputTypeError, "channels as a list of names"),
        (
            {"channels": ["force"], "weight_model": "pooled"},
            InputError,
            r"weight_model=\"hierarchical\" with channels, got 'pooled'\. Pooled weights do not know how demonstrations vary",
        ),
        (
            {"channels": ["force"], "weight_uncertainty": "independent"},
            InputError,
            r"weight_uncertainty=\"joint\" with channels, got 'independent'\. A forcing term that is redrawn at every step",
        ),
        ({"coupling": "some"}, InputError, r"coupling to be one of 'auto', 'full', 'none', got 'some'"),
    ],
)
def test_arguments_that_cannot_be(taught, arguments, error, match):
    with pytest.raises(error, match=match):
        ProbabilisticDMP(8, **arguments).fit(taught[:3])


def test_a_channel_has_to_be_in_every_demonstration(taught):
    mute = replace(taught[0], channels={})
    with pytest.raises(InputError, match=r"demonstrations with the channels 'force', got one with none"):
        learn([mute, *taught[1:3]], ["force"])
    silent = replace(taught[0], channels={"force": np.full(STEPS, np.nan)})
    with pytest.raises(InputError, match=r"channel 'force' measured in every demonstration, got one without a single sample"):
        learn([silent, *taught[1:3]], ["force"])


def test_a_channel_of_absurd_size(taught):
    with pytest.raises(InputError, match=r"channel 'force' over 1e-40 to 1e\+40 units.* Rescale it"):
        learn([replace(d, channels={"force": d.channels["force"] * 1e60}) for d in taught[:3]], ["force"])
