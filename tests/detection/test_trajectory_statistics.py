"""Each channel against its definition, computed densely."""

import numpy as np
import pytest
from detection.paths import random_path_model, random_paths, window_model
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import seeds

from probdmp.detection.phase_clock import TICKS
from probdmp.detection.trajectory_statistics import (
    DISPLACEMENT_SHIFTS,
    LAGS,
    ORDINARY_SQUARE,
    ORDINARY_TICKS,
    SHIFT_STD,
    SLOPPINESS_DELAY,
    Displacement,
    Position,
    make_relative,
)
from probdmp.detection.windows import gather


@settings(max_examples=10)
@given(seeds)
def test_position_is_the_squared_distance_from_the_mean(seed):
    rng = np.random.default_rng(seed)
    model = random_path_model(rng, 2)
    path, ticks = random_paths(model, rng, 1, 130), np.arange(130)
    found = Position(model).judge(ticks, gather(path, ticks, Position.offsets), model.means[None])[0]
    for t in (0, 20, 100, 129):
        mean, covariance = window_model(model, t, [0], 0, model.means)
        e = path[0, t] - mean
        assert found[t] == pytest.approx(e @ np.linalg.solve(covariance, e), rel=1e-7)


@settings(max_examples=10)
@given(seeds)
def test_displacement_is_the_least_squared_distance_over_shifts(seed):
    """Each shift has its price; beyond the end places are judged further on."""
    rng = np.random.default_rng(seed)
    model = random_path_model(rng, 2)
    path, ticks = random_paths(model, rng, 1, 130), np.arange(130)
    found = Displacement(model).judge(ticks, gather(path, ticks, Displacement.offsets), model.means[None])[0]
    differences = np.hstack([-np.eye(len(LAGS)), np.ones((len(LAGS), 1))])
    for t in (0, 10, 60, 100, 110):
        squares = []
        for shift in DISPLACEMENT_SHIFTS:
            mean, covariance = window_model(model, t, Displacement.offsets, shift, model.means, differences)
            e = (differences @ path[0, np.maximum(t + Displacement.offsets, 0)]).ravel() - mean
            squares.append(e @ np.linalg.solve(covariance, e) + (shift / SHIFT_STD) ** 2)
        assert found[t] == pytest.approx(min(squares) / 2, rel=1e-6)


def test_nothing_seen_is_no_evidence():
    model = random_path_model(np.random.default_rng(0), 2)
    ticks, nothing = np.arange(5), np.full((1, 5, 2), np.nan)
    for kind in (Position, Displacement):
        assert np.isnan(kind(model).judge(ticks, gather(nothing, ticks, kind.offsets), model.means[None])).all()


@given(seeds, st.floats(0, 0.5))
def test_squares_are_relative_to_those_before_the_window(seed, missing):
    rng = np.random.default_rng(seed)
    squares = rng.chisquare(2, (2, 60))
    squares[rng.random(squares.shape) < missing] = np.nan
    found = squares.copy()
    make_relative(found.T)
    for n, t in np.ndindex(squares.shape):
        before = squares[n, : max(t - SLOPPINESS_DELAY + 1, 0)]
        before = before[~np.isnan(before)]
        ordinary = (ORDINARY_TICKS * ORDINARY_SQUARE + before.sum()) / (ORDINARY_TICKS + len(before)) / ORDINARY_SQUARE
        np.testing.assert_allclose(found[n, t], squares[n, t] / ordinary, rtol=1e-9)


def test_the_lags_fit_into_the_movement():
    assert LAGS.max() < TICKS
