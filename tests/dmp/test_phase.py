"""The phase: an exponential clock of the movement."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from probdmp.dmp.phase import phases_at

durations = st.floats(1e-3, 1e3)


@given(durations)
def test_it_falls_from_one_to_a_hundredth(duration):
    np.testing.assert_allclose(phases_at(np.array([0.0, duration]), duration), [1.0, 0.01], rtol=1e-14)


@given(durations, st.floats(0, 2), st.floats(0, 2))
def test_equal_times_take_equal_fractions(duration, first, second):
    both = phases_at(np.array((first + second) * duration), duration)
    np.testing.assert_allclose(
        both, phases_at(np.array(first * duration), duration) * phases_at(np.array(second * duration), duration), rtol=1e-13
    )


def test_it_goes_on_falling_after_the_end():
    phases = phases_at(np.linspace(0, 50, 500), 1.0)
    assert np.all(np.diff(phases) < 0)
    assert phases[-1] == pytest.approx(1e-100, rel=1e-10)


def test_it_depends_on_the_fraction_of_the_duration_alone():
    times = np.linspace(0, 3, 20)
    np.testing.assert_allclose(phases_at(times * 7.3, 7.3), phases_at(times, 1.0), rtol=1e-14)


def test_durations_broadcast_against_times():
    phases = phases_at(np.array([[0.0], [1.0]]), np.array([1.0, 2.0]))
    np.testing.assert_allclose(phases, [[1.0, 1.0], [0.01, 0.1]], rtol=1e-14)
