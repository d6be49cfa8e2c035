"""The number that is compared: free of units, blind to what was not seen."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import seeds

from probdmp.detection.monitoring import LikelihoodStatistic
from probdmp.detection.statistics import LIKELIHOODS, standardized_contributions
from probdmp.execution import Observed

VARIANCE = 0.01


def observed(contributions, seen=True):
    """One tick of degrees of freedom with range one."""
    contributions, seen = np.asarray(contributions, dtype=np.float64), np.broadcast_to(seen, len(contributions))
    variances = np.full(len(contributions), VARIANCE)
    innovations = np.where(seen, 0.0, np.nan)
    return Observed(0, 0.0, 1.0, innovations, np.where(seen, contributions, 0.0), innovations, variances)


@given(seeds, st.floats(-6, 6), st.booleans())
def test_positions_are_in_units_of_their_range(seed, exponent, all_seen):
    """ln p has units: the same error in metres and in micrometres must give the same number."""
    rng = np.random.default_rng(seed)
    e, s, ranges, unit = rng.standard_normal(3), rng.uniform(0.5, 2, 3), rng.uniform(1, 10, 3), 10**exponent
    if not all_seen:
        e[1] = np.nan

    def contributions(u):
        return np.where(np.isnan(e), 0.0, -0.5 * ((e * u) ** 2 / (s * u**2) + np.log(2 * np.pi * s * u**2)))

    one = standardized_contributions(contributions(1.0), e, s, ranges)
    other = standardized_contributions(contributions(unit), e * unit, s * unit**2, ranges * unit)
    np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)
    seen = ~np.isnan(e)
    standard = -0.5 * ((e / ranges) ** 2 / (s / ranges**2) + np.log(2 * np.pi * s / ranges**2))
    np.testing.assert_allclose(one[seen], standard[seen], rtol=1e-9, atol=1e-9)


def test_what_was_not_seen_counts_as_it_was_expected_to():
    """The mean of ln N(e; 0, S) over e ~ N(0, S), here by drawing e."""
    s, ranges, nothing = np.array([0.04, 3.0]), np.array([2.0, 0.5]), np.full(2, np.nan)
    e = np.random.default_rng(0).standard_normal((100_000, 2)) * np.sqrt(s)
    drawn = np.mean(-0.5 * (e**2 / s + np.log(2 * np.pi * s)), axis=0) + np.log(ranges)
    np.testing.assert_allclose(standardized_contributions(np.zeros(2), nothing, s, ranges), drawn, atol=0.01)


@given(st.lists(st.floats(-100, 100), min_size=1, max_size=20))
def test_per_step_forgets_and_cumulative_adds(values):
    per_step, cumulative = (LikelihoodStatistic(name, np.ones(1)) for name in ("per_step", "cumulative"))
    for t, value in enumerate(values):
        assert per_step.update(observed([value]))[0] == value
        assert cumulative.update(observed([value]))[0] == pytest.approx(sum(values[: t + 1]), abs=1e-9)


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_a_tick_without_data_says_nothing_and_is_not_added(likelihood):
    with_gap, without = (LikelihoodStatistic(likelihood, np.ones(2)) for _ in range(2))
    with_gap.update(observed([1.0, -3.0]))
    without.update(observed([1.0, -3.0]))
    statistic, contributions = with_gap.update(observed([0.0, 0.0], seen=False))
    assert statistic == np.inf
    np.testing.assert_array_equal(contributions, [0, 0])
    assert with_gap.update(observed([2.0, 2.0]))[0] == without.update(observed([2.0, 2.0]))[0]


def test_the_readings_of_the_paper_are_known_by_name():
    assert sorted(LIKELIHOODS) == ["cumulative", "per_step"]
