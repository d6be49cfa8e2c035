"""Samples put onto a constant rate while they come in: the same as all at once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from probdmp.demonstrations import LiveResampling, demonstration_from_times
from probdmp.errors import InputError


@given(st.lists(st.floats(0.001, 0.05), min_size=4, max_size=40), st.data())
def test_however_samples_come_rows_are_those_of_the_whole(steps, data):
    times = np.concatenate([[0.0], np.cumsum(steps)])
    rows = np.random.default_rng(len(steps)).standard_normal((len(times), 3))
    live, found = LiveResampling(0.01), []
    cuts = sorted(data.draw(st.lists(st.integers(0, len(times)), max_size=4)))
    for first, last in zip([0, *cuts], [*cuts, len(times)], strict=True):
        found.append(live.add(times[first:last], rows[first:last]))
    found = np.concatenate(found)
    if len(found) >= 3:
        whole = demonstration_from_times(times, rows, 0.01).positions
        count = min(len(whole), len(found))
        assert abs(len(whole) - len(found)) <= 1  # the tolerance of the last sample differs
        np.testing.assert_allclose(found[:count], whole[:count], atol=1e-9)


def test_clocks_may_begin_anywhere():
    live = LiveResampling(0.5)
    np.testing.assert_allclose(live.add([100.0, 101.0], [[0.0], [1.0]]), [[0], [0.5], [1]])
    np.testing.assert_allclose(live.add([102.0], [[3.0]]), [[2], [3]])


def test_nothing_comes_of_nothing():
    assert LiveResampling(0.1).add(np.empty(0), np.empty((0, 2))).shape == (0, 2)


def test_times_that_do_not_increase_are_refused():
    live = LiveResampling(0.1)
    live.add([0.0, 1.0], [[0.0], [1.0]])
    with pytest.raises(InputError, match="times that increase strictly"):
        live.add([1.0], [[2.0]])
    with pytest.raises(InputError, match="at most 100000 rows"):
        live.add([1e7], [[2.0]])
    np.testing.assert_allclose(live.add([1.1], [[2.0]]), [[2.0]])  # as if they had not been given
