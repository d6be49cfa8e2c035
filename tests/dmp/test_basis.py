"""Basis functions: a partition of the phase that never breaks down."""

import math

import numpy as np
import pytest

from probdmp.dmp.basis import basis_centers, basis_features, basis_widths
from probdmp.dmp.phase import phases_at

SIZES = (1, 2, 3, 8, 30, 500)


@pytest.mark.parametrize("n_basis", SIZES)
def test_centres_lie_at_evenly_spaced_times(n_basis):
    centers = basis_centers(n_basis)
    assert centers.shape == (n_basis,)
    times = -np.log(centers) / math.log(100)
    np.testing.assert_allclose(times, np.linspace(0, 1, n_basis), atol=1e-14)


@pytest.mark.parametrize("n_basis", SIZES[1:])
def test_neighbours_cross_near_three_quarters_of_their_height(n_basis):
    centers, widths = basis_centers(n_basis), basis_widths(basis_centers(n_basis))
    middles = (centers[:-1] + centers[1:]) / 2
    np.testing.assert_allclose(np.exp(-widths[:-1] * (middles - centers[:-1]) ** 2), math.exp(-1 / 4), rtol=1e-9)
    assert widths[-1] == widths[-2]


@pytest.mark.parametrize("n_basis", SIZES)
def test_rows_sum_to_the_phase(n_basis):
    phases = phases_at(np.linspace(0, 1, 301), 1.0)
    features = basis_features(phases, n_basis)
    assert features.shape == (301, n_basis)
    assert np.all(features >= 0)
    np.testing.assert_allclose(features.sum(axis=-1), phases, rtol=1e-14)


@pytest.mark.parametrize("n_basis", SIZES)
@pytest.mark.parametrize("end", [2, 10, 150])
def test_far_beyond_the_end_the_last_basis_function_carries_the_phase(n_basis, end):
    """Every psi of the definition underflows there; their ratio must not."""
    phases = phases_at(np.linspace(1.5, end, 100), 1.0)
    features = basis_features(phases, n_basis)
    np.testing.assert_allclose(features.sum(axis=-1), phases, rtol=1e-14)
    assert np.all(features[-1, :-1] <= features[-1, -1])


def test_phase_zero_gives_zero():
    np.testing.assert_array_equal(basis_features(np.array([0.0]), 30), np.zeros((1, 30)))


def test_before_the_start_nothing_breaks():
    phases = phases_at(np.array([-0.5]), 1.0)
    np.testing.assert_allclose(basis_features(phases, 500).sum(axis=-1), phases, rtol=1e-14)


@pytest.mark.parametrize("n_basis", [2, 5, 12])
def test_as_defined_where_the_definition_can_be_computed(n_basis):
    phases = phases_at(np.linspace(0, 1, 40), 1.0)
    for x, row in zip(phases, basis_features(phases, n_basis), strict=True):
        c = [math.exp(-math.log(100) * i / (n_basis - 1)) for i in range(n_basis)]
        h = [1 / (c[i + 1] - c[i]) ** 2 for i in range(n_basis - 1)]
        psi = [math.exp(-w * (x - m) ** 2) for w, m in zip([*h, h[-1]], c, strict=True)]
        np.testing.assert_allclose(row, [x * p / sum(psi) for p in psi], rtol=1e-10, atol=1e-300)


def test_a_single_basis_function_is_the_phase_itself():
    phases = phases_at(np.linspace(0, 3, 20), 1.0)
    np.testing.assert_array_equal(basis_features(phases, 1)[:, 0], phases)


def test_any_shape_of_phases():
    phases = phases_at(np.linspace(0, 1, 24), 1.0)
    np.testing.assert_array_equal(basis_features(phases.reshape(2, 3, 4), 7), basis_features(phases, 7).reshape(2, 3, 4, 7))
