"""Movements put to where there is room for them."""

import numpy as np
import pytest

from probdmp.demonstrations import Demonstration, are_within, placement_within, synthetic_letters
from probdmp.errors import InputError

BOX = (100.0, 75.0)


def test_movements_fill_the_middle_of_the_box_undistorted():
    written = synthetic_letters(5, letters="am", dt=0.02)
    placement = placement_within(written, BOX, filled=0.6)
    rows = np.concatenate([placement.placed(d).positions for d in written])
    extents, middle = np.ptp(rows, axis=0), (rows.min(axis=0) + rows.max(axis=0)) / 2
    np.testing.assert_allclose(middle, [50, 37.5])
    assert np.max(extents / BOX) == pytest.approx(0.6)
    before = np.ptp(np.concatenate([d.positions for d in written]), axis=0)
    np.testing.assert_allclose(extents / before, placement.scale)
    assert are_within([placement.placed(d) for d in written], BOX)
    assert not are_within(written, BOX, least=0.5)


def test_a_straight_line_can_be_placed_and_missing_samples_stay_missing():
    line = Demonstration(np.array([[0.0, 1], [np.nan, np.nan], [2, 1]]), 0.01)
    placed = placement_within([line], BOX).placed(line)
    np.testing.assert_allclose(placed.positions, [[20, 37.5], [np.nan, np.nan], [80, 37.5]])


def test_what_cannot_be_placed_is_refused():
    for wrong in ([], [Demonstration(np.ones((3, 2)), 0.1)], [Demonstration(np.eye(3), 0.1)]):
        with pytest.raises(InputError):
            placement_within(wrong, BOX)
