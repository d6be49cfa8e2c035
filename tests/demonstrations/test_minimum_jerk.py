"""Movements of least jerk: what they pass through, how smooth they are, and that none has less jerk."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.interpolate import BSpline

from probdmp.demonstrations.minimum_jerk import minimum_jerk_spline

RNGS = st.integers(0, 2**32 - 1).map(np.random.default_rng)


@st.composite
def tasks(draw, least=2):
    """Times and points to pass."""
    rng = draw(RNGS)
    n = draw(st.integers(least, 7))
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, n - 1))])
    return times, rng.standard_normal((n, draw(st.integers(1, 7))))


def integral(function, times):
    """Of what is a polynomial of degree up to 23 between one time and the next, exactly: Gauss-Legendre quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    halves = np.diff(times) / 2
    return sum(half * (weights @ function(begin + half * (1 + nodes))) for begin, half in zip(times, halves, strict=False))


def jerk_cost(path, times):
    """Integral of the squared third derivative."""
    return integral(lambda t: (path(t, 3) ** 2).sum(axis=1), times)


@given(tasks())
def test_it_passes_through_the_points_at_their_times(task):
    times, points = task
    np.testing.assert_allclose(minimum_jerk_spline(times, points)(times), points, atol=1e-9)


@given(tasks())
def test_it_rests_at_both_ends(task):
    times, points = task
    path = minimum_jerk_spline(times, points)
    size = np.abs(path.c).max()
    for order in (1, 2):
        np.testing.assert_allclose(path(times[[0, -1]], order), 0, atol=1e-7 * size / np.diff(times).min() ** order)


@given(tasks(least=3))
def test_four_derivatives_are_continuous_at_via_points_and_the_fifth_is_not(task):
    times, points = task
    path = minimum_jerk_spline(times, points)
    eps = 1e-9
    for order in range(5):
        after, before = path(times[1:-1] + eps, order), path(times[1:-1] - eps, order)
        scale = np.abs(path(np.linspace(times[0], times[-1], 200), order)).max()
        np.testing.assert_allclose(after, before, atol=1e-4 * scale)
    assert not np.allclose(path(times[1:-1] + eps, 5), path(times[1:-1] - eps, 5))


@given(tasks(), RNGS)
def test_no_other_path_on_the_same_conditions_has_less_jerk(task, rng):
    """A path that is 0 at the points and at rest in the ends has a jerk orthogonal to that of the movement: adding it costs."""
    times, points = task
    path = minimum_jerk_spline(times, points)
    addition = Polynomial.fromroots([*times, *times[[0, -1]].repeat(2)]) * Polynomial(rng.standard_normal(4))
    for at, orders in ((times, [0]), (times[[0, -1]], [0, 1, 2])):
        for order in orders:
            np.testing.assert_allclose(addition.deriv(order)(at) if order else addition(at), 0, atol=1e-6)
    jerk = addition.deriv(3)
    least, more = jerk_cost(path, times), integral(lambda t: jerk(t) ** 2, times)
    for d in range(points.shape[1]):
        cross = integral(lambda t, d=d: path(t, 3)[:, d] * jerk(t), times)
        assert abs(cross) <= 1e-6 * np.sqrt(least * more)


@given(tasks(least=3), RNGS)
def test_no_spline_of_more_pieces_on_the_same_conditions_has_less_jerk(task, rng):
    """All splines of twice as many pieces that meet the conditions, by linear algebra: any other one costs what it adds."""
    times, points = task
    path = minimum_jerk_spline(times, points[:, :1])
    finer = np.sort(np.concatenate([times, (times[1:] + times[:-1]) / 2]))
    t = np.concatenate([[times[0]] * 5, finer, [times[-1]] * 5])
    basis = BSpline(t, np.eye(len(t) - 6), 5)
    conditions = np.vstack([basis(times), *(basis(times[[0, -1]], order) for order in (1, 2))])
    free = np.linalg.svd(conditions)[2][np.linalg.matrix_rank(conditions) :]
    assert len(free) > 0
    as_fine = np.linalg.lstsq(basis(np.linspace(times[0], times[-1], 300)), path(np.linspace(times[0], times[-1], 300)))[0]
    least = jerk_cost(path, times)
    other = BSpline(t, as_fine + free.T @ rng.standard_normal((len(free), 1)), 5)
    np.testing.assert_allclose(other(times), points[:, :1], atol=1e-6)
    addition = BSpline(t, other.c - as_fine, 5)
    assert jerk_cost(other, finer) > least
    np.testing.assert_allclose(jerk_cost(other, finer), least + jerk_cost(addition, finer), rtol=1e-5)


def test_between_two_points_it_is_the_polynomial_of_flash_and_hogan():
    times, points = np.array([0.0, 2.0]), np.array([[1.0, -1.0], [3.0, 0.5]])
    s = np.linspace(0, 1, 21)
    expected = points[0] + (10 * s**3 - 15 * s**4 + 6 * s**5)[:, None] * (points[1] - points[0])
    np.testing.assert_allclose(minimum_jerk_spline(times, points)(2 * s), expected, atol=1e-12)


@given(tasks(), st.floats(0.1, 10))
def test_a_slower_movement_takes_the_same_path(task, factor):
    times, points = task
    phases = np.linspace(times[0], times[-1], 50)
    slow = minimum_jerk_spline(factor * times, points)(factor * phases)
    np.testing.assert_allclose(slow, minimum_jerk_spline(times, points)(phases), atol=1e-8 * np.abs(slow).max())


@given(tasks(), RNGS)
def test_it_turns_and_moves_with_its_points(task, rng):
    times, points = task
    rotation = np.linalg.qr(rng.standard_normal((points.shape[1],) * 2))[0]
    phases = np.linspace(times[0], times[-1], 50)
    moved = minimum_jerk_spline(times, points @ rotation + 3.0)(phases)
    expected = minimum_jerk_spline(times, points)(phases) @ rotation + 3.0
    np.testing.assert_allclose(moved, expected, atol=1e-8 * np.abs(expected).max())
