"""Windows against the dense Gaussian over the path: every point that was seen, none that was not."""

import numpy as np
import pytest
from detection.paths import random_path_model, random_paths, window_model, with_gaps
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import seeds

from probdmp.detection.phase_clock import TICKS
from probdmp.detection.windows import PathWindows, gather


def by_hand(model, place, offsets, shift, window, means, combination=None):
    """Squared distance, ln det of the whitening and count of numbers of the first entries of a window (P, D)."""
    dof = window.shape[1]
    mix = np.kron(np.eye(len(offsets)) if combination is None else combination, np.eye(dof))
    mean, covariance = window_model(model, place, offsets, shift, means, combination)
    unseen = np.abs(mix) @ np.isnan(window.ravel()) > 0
    x = np.where(unseen, np.nan, mix @ np.nan_to_num(window.ravel()))
    rows = []
    for size in range(dof, len(x) + 1, dof):
        k = np.flatnonzero(~unseen[:size])
        S, e = covariance[np.ix_(k, k)], (x - mean)[k]
        rows.append((e @ np.linalg.solve(S, e), -0.5 * np.linalg.slogdet(S)[1], len(k)) if len(k) else (0.0, 0.0, 0))
    return np.array(rows).T


def random_case(seed, gaps):
    rng = np.random.default_rng(seed)
    model = random_path_model(rng, int(rng.integers(1, 4)))
    paths = random_paths(model, rng, 2, 140)
    means = model.means_for(rng.standard_normal((2, model.means.shape[1])))
    offsets = np.sort(rng.choice(np.arange(-30, 20), 5, replace=False))
    shifts = np.sort(rng.choice(np.arange(-8, 9), 3, replace=False))
    return rng, model, with_gaps(paths, rng) if gaps else paths, means, offsets, shifts


@settings(max_examples=15)
@given(seeds, st.booleans(), st.booleans(), st.sampled_from([TICKS + 1, 60]))
def test_windows_are_compared_with_the_dense_gaussian(seed, gaps, differences, n_places):
    """Places from before the first full window to beyond the end; a place that there is no row for is judged as the last."""
    rng, model, paths, means, offsets, shifts = random_case(seed, gaps)
    combination = rng.standard_normal((4, len(offsets))) * (rng.random((4, len(offsets))) < 0.6) if differences else None
    if differences:
        combination[np.arange(4), np.arange(4)] = 1.0
    windows = PathWindows(model, offsets, shifts, n_places, combination)
    places = np.array([0, 3, 17, 55, 98, 119])
    seen = gather(paths, places, offsets)
    white = windows.whiten(places, seen, means)
    for n in range(2):
        for t, place in enumerate(places):
            for s, shift in enumerate(shifts):
                row = min(place, n_places - 1)
                squares, log_dets, counts = by_hand(model, row, offsets, shift, seen[n, t], means[n], combination)
                np.testing.assert_allclose(white.squares[n, t, s], squares, rtol=1e-6, atol=1e-9)
                np.testing.assert_allclose(white.log_determinants[n, t, s], log_dets, rtol=1e-8, atol=1e-9)
                np.testing.assert_array_equal(white.counts[n, t, s], counts)


@settings(max_examples=15)
@given(seeds, st.booleans(), st.integers(1, 4))
def test_the_beginning_of_a_window_is_judged_as_within_the_whole(seed, gaps, points):
    _, model, paths, means, offsets, shifts = random_case(seed, gaps)
    windows, places = PathWindows(model, offsets, shifts, TICKS + 1), np.array([5, 40, 90])
    seen = gather(paths, places, offsets)
    whole, begun = windows.whiten(places, seen, means), windows.whiten(places, seen[:, :, :points], means)
    for all_of_it, some in zip(whole, begun, strict=True):
        np.testing.assert_allclose(some, all_of_it[..., :points], rtol=1e-9, atol=1e-12)


def test_nothing_seen_is_nothing_said():
    rng = np.random.default_rng(0)
    model = random_path_model(rng, 2)
    windows = PathWindows(model, np.array([-4, 0]), np.array([-2, 0, 2]), TICKS + 1)
    white = windows.whiten(np.array([50]), np.full((1, 1, 2, 2), np.nan), model.means[None])
    for part in white:
        np.testing.assert_array_equal(part, 0)


@settings(max_examples=15)
@given(seeds)
def test_contributions_add_up_to_the_squared_distance(seed):
    """Where no shares cancel, that is with one degree of freedom; and the sign is that of the last point's deviation."""
    rng = np.random.default_rng(seed)
    model = random_path_model(rng, 1)
    offsets, shifts, place = np.array([-12, -6, 0]), np.array([-2, 0, 2]), int(rng.integers(110))
    windows = PathWindows(model, offsets, shifts, TICKS + 1)
    window = random_paths(model, rng, 1, 120)[:, np.maximum(place + offsets, 0)]
    (share,) = windows.contributions(place, 1, window[0], model.means)
    (square,), (last,) = (
        windows.whiten(np.array([place]), window[:, None], model.means[None]).squares[0, 0, 1, 2:],
        window[0, -1],
    )
    assert abs(share) == pytest.approx(square, rel=1e-9)
    assert np.sign(share) == np.sign(last - model.means[min(place, TICKS)].item())


def test_before_the_start_a_movement_is_where_it_starts():
    paths = np.arange(10.0)[None, :, None]
    np.testing.assert_array_equal(gather(paths, np.array([1, 8]), np.array([-3, 0]))[0, ..., 0], [[0, 1], [5, 8]])
