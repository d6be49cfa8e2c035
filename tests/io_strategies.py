"""What tests of several file formats share."""

from collections.abc import Sequence

import numpy as np

from probdmp.demonstrations import Demonstration

__all__ = ["assert_same_demonstrations"]


def assert_same_demonstrations(some: Sequence[Demonstration], others: Sequence[Demonstration]) -> None:
    """The same values, bit for bit, the same names in the same order."""
    assert len(some) == len(others)
    for one, other in zip(some, others, strict=True):
        assert (one.dt, one.label, one.names, one.units) == (other.dt, other.label, other.names, other.units)
        np.testing.assert_array_equal(one.positions, other.positions)
        assert list(one.channels) == list(other.channels)
        for name, channel in one.channels.items():
            np.testing.assert_array_equal(channel, other.channels[name])
