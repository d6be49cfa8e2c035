"""How far movements and channels reach."""

import numpy as np
import pytest

from probdmp.demonstrations import Demonstration, channel_ranges, mean_ranges
from probdmp.errors import InputError

UP, STILL = np.linspace(0, 1, 5), np.full(5, 7.0)


def felt(scale=1.0, **channels):
    return Demonstration(np.column_stack([scale * UP, STILL]), 0.1, channels=channels)


def test_ranges_are_mean_extents():
    demonstrations = [felt(1.0, force=10 * UP, heat=-UP), felt(3.0, force=20 * UP, heat=-3 * UP)]
    np.testing.assert_allclose(channel_ranges(demonstrations, ["heat", "force"]), [2, 15])
    np.testing.assert_allclose(mean_ranges(demonstrations)[0], 2)
    assert channel_ranges(demonstrations, []).shape == (0,)


def test_gaps_do_not_count():
    gappy = felt(force=np.where(np.arange(5) == 4, np.nan, UP))
    np.testing.assert_allclose(channel_ranges([gappy], ["force"]), [0.75])


def test_a_channel_that_never_changes_has_a_unit_of_its_own():
    """Its distance from zero, or one; not the range of another channel, which is in another unit."""
    ranges = channel_ranges([felt(force=1e6 * UP, flat=np.full(5, -3.0), zero=np.zeros(5))], ["force", "flat", "zero"])
    np.testing.assert_allclose(ranges, [1e6, 3.0, 1.0])
    rounding = channel_ranges([felt(flat=1e9 + 1e-6 * UP)], ["flat"])
    np.testing.assert_allclose(rounding, [1e9])


@pytest.mark.parametrize("size", [1e-60, 1e60])
def test_sizes_whose_squares_would_not_be_finite(size):
    with pytest.raises(InputError, match=r"channel 'force' over 1e-40 to 1e\+40 units, got 1e[+-]60\. Rescale it"):
        channel_ranges([felt(force=size * UP)], ["force"])
