"""The sigma-lognormal model: strokes of lognormal speed along circular arcs, against calculus and the printed equations."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import lognorm

from probdmp.demonstrations import Strokes
from probdmp.demonstrations.sigma_lognormal import (
    accelerations,
    directions,
    displacements,
    speeds,
    strokes_between,
    velocities,
)

LATE = 1e4
"""Seconds: long after the end of any of these strokes."""


@st.composite
def any_strokes(draw, most=4):
    """Strokes as those of a person, and stranger ones: straight, whole circles, commanded together or far apart."""
    n = draw(st.integers(1, most))

    def column(low, high):
        return np.array([draw(st.floats(low, high)) for _ in range(n)])

    start_angles = column(-math.pi, math.pi)
    return Strokes(
        onsets=column(-0.5, 1.0),
        log_time_delays=column(-2.5, 0.0),
        log_response_times=column(0.1, 0.6),
        amplitudes=column(0.1, 30.0),
        start_angles=start_angles,
        end_angles=start_angles + np.array([draw(st.sampled_from([0.0, 1e-9]) | st.floats(-6.2, 6.2)) for _ in range(n)]),
    )


times = st.floats(-1.0, 4.0)


def fine_grid(strokes, n=20_001):
    end = strokes.instants(5.0).max()
    return np.linspace(strokes.onsets.min() - 0.01, end, n)


@given(any_strokes())
def test_displacement_in_closed_form_is_velocity_integrated(strokes):
    """By Gauss-Legendre quadrature in each of a thousand intervals."""
    grid = fine_grid(strokes, 1001)
    nodes, weights = np.polynomial.legendre.leggauss(5)
    half = (grid[1] - grid[0]) / 2
    instants = (grid[:-1, None] + half * (1 + nodes)).ravel()
    pieces = half * np.einsum("n,tnd->td", weights, velocities(strokes, instants).reshape(-1, len(nodes), 2))
    integrated = np.vstack([np.zeros(2), np.cumsum(pieces, axis=0)])
    np.testing.assert_allclose(displacements(strokes, grid), integrated, atol=1e-7 * strokes.amplitudes.sum())


@given(any_strokes(most=1))
def test_the_speed_of_a_stroke_integrates_to_its_distance(strokes):
    onset, end = strokes.onsets[0], strokes.instants(8.0)[0]
    middle = strokes.instants(0.0)[0]
    distance, _ = quad(lambda t: speeds(strokes, np.array([t]))[0, 0], onset, end, points=[middle], limit=200)
    assert distance == pytest.approx(strokes.amplitudes[0], rel=1e-7)


@given(any_strokes(), times)
def test_speed_and_direction_are_as_published(strokes, t):
    """Plamondon 1995, eq. for |v(t)|; O'Reilly & Plamondon 2009, eq. for the angle, written out with erf."""
    for i in range(len(strokes.onsets)):
        since = t - strokes.onsets[i]
        mu, sigma, d = strokes.log_time_delays[i], strokes.log_response_times[i], strokes.amplitudes[i]
        speed, share = 0.0, 0.0
        if since > 1e-300:  # of the reciprocal of less there is no double
            speed = d / (sigma * math.sqrt(2 * math.pi) * since) * math.exp(-((math.log(since) - mu) ** 2) / (2 * sigma**2))
            share = (1 + math.erf((math.log(since) - mu) / (sigma * math.sqrt(2)))) / 2
        angle = strokes.start_angles[i] + (strokes.end_angles[i] - strokes.start_angles[i]) * share
        assert speeds(strokes, np.array([t]))[0, i] == pytest.approx(speed, rel=1e-9, abs=1e-12)
        assert directions(strokes, np.array([t]))[0, i] == pytest.approx(angle, rel=1e-9, abs=1e-12)


@given(any_strokes(most=1))
def test_the_speed_is_scipys_lognormal_density(strokes):
    grid = np.linspace(strokes.onsets[0] - 1, strokes.instants(4.0)[0], 50)
    density = lognorm.pdf(grid, strokes.log_response_times[0], loc=strokes.onsets[0], scale=np.exp(strokes.log_time_delays[0]))
    np.testing.assert_allclose(speeds(strokes, grid)[:, 0], strokes.amplitudes[0] * density, rtol=1e-9, atol=1e-12)


@given(any_strokes(), times)
def test_velocity_is_the_slope_of_position_and_acceleration_that_of_velocity(strokes, t):
    h = 1e-5
    around = np.array([t - h, t, t + h])
    speed = strokes.amplitudes.sum() * 30
    for values, slopes, scale in (
        (displacements(strokes, around), velocities(strokes, around), speed),
        (velocities(strokes, around), accelerations(strokes, around), 300 * speed),
    ):
        np.testing.assert_allclose((values[2] - values[0]) / (2 * h), slopes[1], rtol=1e-3, atol=1e-5 * scale)


@given(any_strokes())
def test_a_stroke_turns_from_its_start_angle_to_its_end_angle(strokes):
    both = directions(strokes, np.array([strokes.onsets.min() - 1, LATE]))
    np.testing.assert_array_equal(both[0], strokes.start_angles)
    np.testing.assert_allclose(both[1], strokes.end_angles, atol=1e-9)
    grid = directions(strokes, fine_grid(strokes, 200))
    turned = np.diff(grid, axis=0) * np.sign(strokes.end_angles - strokes.start_angles)
    assert (turned >= -1e-12).all()


@given(any_strokes())
def test_nothing_moves_before_its_onset(strokes):
    before = np.array([-1e3, strokes.onsets.min() - 1e-9, strokes.onsets.min()])
    for of in (displacements, velocities, accelerations):
        np.testing.assert_array_equal(of(strokes, before), np.zeros((3, 2)))


@given(any_strokes(most=1))
def test_a_stroke_is_a_circular_arc(strokes):
    """Every point has the same distance from the centre, to the left of the start at the radius D / turn."""
    turn = strokes.end_angles[0] - strokes.start_angles[0]
    path = displacements(strokes, fine_grid(strokes, 100))
    if abs(turn) < 1e-3:
        along = np.array([np.cos(strokes.start_angles[0]), np.sin(strokes.start_angles[0])])
        np.testing.assert_allclose(path, np.outer(path @ along, along), atol=1e-3 * strokes.amplitudes[0])
        return
    radius = strokes.amplitudes[0] / turn
    centre = radius * np.array([-np.sin(strokes.start_angles[0]), np.cos(strokes.start_angles[0])])
    np.testing.assert_allclose(np.linalg.norm(path - centre, axis=1), abs(radius), rtol=1e-6)


@given(any_strokes())
def test_strokes_add_up_as_vectors(strokes):
    grid = fine_grid(strokes, 50)
    single = [
        Strokes(*(getattr(strokes, name)[i : i + 1] for name in Strokes.__dataclass_fields__))
        for i in range(len(strokes.onsets))
    ]
    for of in (displacements, velocities, accelerations):
        np.testing.assert_allclose(of(strokes, grid), sum(of(one, grid) for one in single), rtol=1e-9, atol=1e-9)


@given(
    st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=2, max_size=5, unique=True),
    st.lists(st.floats(-5.5, 5.5), min_size=4, max_size=4),
)
def test_strokes_between_targets_reach_each_of_them(targets, bends):
    targets, n = np.array(targets), len(targets) - 1
    far_apart = 100.0 * np.arange(n)
    strokes = strokes_between(targets, np.array(bends[:n]), far_apart, np.full(n, -1.5), np.full(n, 0.25))
    reached = targets[0] + displacements(strokes, np.append(far_apart, LATE))
    np.testing.assert_allclose(reached, targets, atol=1e-6)
    np.testing.assert_allclose(strokes.end_angles - strokes.start_angles, bends[:n], atol=1e-12)


@given(any_strokes(most=1))
def test_the_bell_is_skewed_to_the_right(strokes):
    """The peak comes exp(-sigma^2) of the way to the median, and the fall takes longer than the rise."""
    grid = fine_grid(strokes, 20_001)
    speed = speeds(strokes, grid)[:, 0]
    mode = np.exp(strokes.log_time_delays[0] - strokes.log_response_times[0] ** 2)
    assert grid[speed.argmax()] - strokes.onsets[0] == pytest.approx(mode, abs=2 * (grid[1] - grid[0]))
    above = grid[speed > speed.max() / 2]
    peak = grid[speed.argmax()]
    assert above[-1] - peak > peak - above[0] - 2 * (grid[1] - grid[0])


def test_instants_are_those_of_a_share_of_the_distance():
    strokes = Strokes(*(np.array([value]) for value in (0.3, -1.5, 0.25, 7.0, 0.0, 0.0)))
    for z, share in ((0.0, 0.5), (1.0, 0.841345), (-3.0, 0.00135)):
        assert displacements(strokes, strokes.instants(z))[0, 0] == pytest.approx(7 * share, rel=1e-3)


def test_strokes_are_a_frozen_copy():
    onsets = np.zeros(1)
    strokes = Strokes(onsets, *(np.ones(1) for _ in range(5)))
    onsets[0] = 7
    assert strokes.onsets[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        strokes.onsets[0] = 1
