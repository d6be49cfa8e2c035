"""Recordings side by side and an execution tick by tick: the same values."""

import numpy as np
import pytest
from detection.paths import random_path_model, random_paths, with_gaps
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import seeds

from probdmp.detection.evidence import EVIDENCE
from probdmp.detection.trajectory_family import values_of
from probdmp.detection.trajectory_model import (
    LARGEST_LOG_RATIO,
    MEMORY,
    MOVEMENT_CHANNELS,
    MOVEMENT_FLOORS,
    MOVEMENT_HANDICAPS,
    TrajectoryModel,
    all_of_it,
    as_suspicion,
)
from probdmp.detection.window_maps import Needed


@pytest.fixture(scope="module")
def trajectories():
    """Of one, two and three degrees of freedom."""
    return [TrajectoryModel(random_path_model(np.random.default_rng(d), d)) for d in (1, 2, 3)]


def followed(trajectory, path, goal):
    follower = trajectory.follow(goal)
    return np.stack([follower.update(row) for row in path]), follower


@settings(max_examples=10)
@given(seeds, st.sampled_from([0, 1, 2]), st.sampled_from([1, 5, 93, 130, 160]), st.booleans(), st.booleans())
def test_tick_by_tick_is_side_by_side(trajectories, seed, d, length, gaps, told):
    trajectory, rng = trajectories[d], np.random.default_rng(seed)
    paths = random_paths(trajectory.model, rng, 2, length)
    if gaps:
        paths = with_gaps(paths, rng)
    goals = paths[:, -1] if told and not gaps else np.full((2, d + 1), np.nan)
    together = trajectory.values(paths, goals)
    for path, goal, values in zip(paths, goals, together, strict=True):
        alone, _ = followed(trajectory, path, goal)
        np.testing.assert_allclose(alone, values, rtol=1e-6, atol=1e-9)


@settings(max_examples=15)
@given(seeds, st.integers(1, 120), st.booleans())
def test_values_never_look_ahead(trajectories, seed, length, gaps):
    trajectory, rng = trajectories[1], np.random.default_rng(seed)
    paths = random_paths(trajectory.model, rng, 1, 120)
    if gaps:
        paths = with_gaps(paths, rng)
    goals = np.full((1, 2), np.nan)
    whole = trajectory.values(paths, goals)
    np.testing.assert_allclose(trajectory.values(paths[:, :length], goals), whole[:, :length], rtol=1e-6, atol=1e-9)


@settings(max_examples=15)
@given(seeds, st.booleans(), st.sampled_from([-np.inf, -40.0, -5.0]), st.sampled_from([-20.0, 0.0, np.inf]))
def test_what_matters_is_found_whatever_is_not_looked_at(trajectories, seed, gaps, floor, limit):
    """The largest evidence of each channel if it is above its floor, and all above the limit; with samples missing too."""
    trajectory, rng = trajectories[1], np.random.default_rng(seed)
    paths = random_paths(trajectory.model, rng, 4, 110)
    if gaps:
        paths[:, 20:45] = np.nan  # were these zeros, it would stand still there
    arguments = paths.transpose(1, 2, 0), np.full(4, 110), np.full((4, 2), np.nan)
    whole = trajectory.evidence(*arguments, all_of_it)
    found = trajectory.evidence(*arguments, lambda highest: Needed(np.full_like(highest, floor), np.full(len(highest), limit)))
    highest = np.fmax.reduce(whole, axis=1)
    at = (whole == highest[:, None]) & (whole > floor) | (whole > max(limit, floor))
    np.testing.assert_array_equal(found[at], whole[at])


def test_paths_of_different_lengths_do_not_hear_of_each_other(trajectories):
    trajectory, rng = trajectories[1], np.random.default_rng(0)
    paths = [with_gaps(random_paths(trajectory.model, rng, 1, n), rng)[0] for n in (30, 101, 130)]
    ticks = [(path, np.full(2, np.nan)) for path in paths]
    for value, tick in zip(values_of(trajectory, ticks), ticks, strict=True):
        np.testing.assert_allclose(value, values_of(trajectory, [tick])[0], rtol=1e-6, atol=1e-9)


def test_each_channel_speaks_when_it_can(trajectories):
    """Where an execution is from the start on; the others from their horizon until the movement may be ending, or has ended."""
    trajectory = trajectories[1]
    values = trajectory.values(random_paths(trajectory.model, np.random.default_rng(0), 1, 170), np.full((1, 2), np.nan))[0]
    spoken = ~np.isnan(values)
    assert spoken[:, :2].all()
    asked = [(kind, horizon) for kind in EVIDENCE for horizon in kind.horizons]
    assert len(MOVEMENT_CHANNELS) == len(MOVEMENT_FLOORS) == len(MOVEMENT_HANDICAPS) == 2 + len(asked)
    for channel, (kind, horizon) in enumerate(asked, start=2):
        assert MOVEMENT_CHANNELS[channel] == f"{kind.name}_{horizon}"
        assert horizon in kind.ahead
        np.testing.assert_array_equal(np.flatnonzero(spoken[:, channel]), np.arange(horizon, kind.last + 1))


def test_memory_is_bounded(trajectories):
    trajectory = trajectories[1]
    _, follower = followed(trajectory, random_paths(trajectory.model, np.random.default_rng(0), 1, 300)[0], np.zeros(2))
    assert len(follower.recent) == MEMORY


def test_suspicion_grows_with_evidence_and_stays_finite():
    evidence = np.array([-np.inf, -1e9, -1.0, 0.0, 1.0, 1e9, np.inf])
    suspicion = as_suspicion(evidence)
    assert np.all(np.diff(suspicion) >= 0)
    assert np.isfinite(suspicion).all()
    assert suspicion[3] == 1
    assert as_suspicion(np.array(LARGEST_LOG_RATIO)) == suspicion[-1]
    assert np.isnan(as_suspicion(np.array(np.nan)))
