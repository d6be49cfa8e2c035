"""The paper's rule in a form that survives a change of sign."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from probdmp.detection.thresholds import PaperThreshold

numbers = st.floats(-1e6, 1e6)


@given(st.floats(-1e6, -1e-6), numbers)
def test_below_zero_it_is_twice_the_minimum(minimum, statistic):
    threshold = PaperThreshold(minimum)
    assert threshold.level == 2 * minimum
    assert (threshold.test_ratio(statistic) > 1) == (minimum - statistic > -minimum)


@given(numbers, numbers)
def test_an_alarm_is_a_statistic_below_the_level(minimum, statistic):
    threshold, scale = PaperThreshold(minimum), max(abs(minimum), abs(statistic), 1.0)
    if abs(statistic - threshold.level) > 1e-9 * scale:
        assert (threshold.test_ratio(statistic) > 1) == (statistic < threshold.level)


@given(numbers, st.floats(0, 1e6))
def test_what_was_seen_in_training_is_never_an_alarm(minimum, above):
    """Twice a positive minimum would lie above it, and everything would be called failed."""
    assert PaperThreshold(minimum).test_ratio(minimum + above) <= (0.5 if minimum < 0 else 0)
    assert PaperThreshold(minimum).level <= minimum


@given(st.floats(1e-6, 1e6), numbers)
def test_the_test_ratio_is_statistic_over_threshold(size, log_likelihood):
    """What the log-likelihood has fallen over what it may fall: from 0, or from the minimum where that is positive."""
    below, above = PaperThreshold(-size), PaperThreshold(size)
    assert below.test_ratio(log_likelihood) == pytest.approx(max(log_likelihood / (2 * -size), 0.0), rel=1e-12)
    assert above.test_ratio(log_likelihood) == pytest.approx(max(size - log_likelihood, 0.0) / size, rel=1e-12)


@given(st.floats(1e-90, 1e6), st.sampled_from([-1, 1]))
def test_at_the_level_the_test_ratio_is_one(size, sign):
    threshold = PaperThreshold(sign * size)
    assert threshold.test_ratio(threshold.level) == 1
    assert threshold.test_ratio(np.nextafter(threshold.level, -np.inf)) >= 1


@given(numbers, numbers, numbers)
def test_less_likely_is_never_less_suspicious(minimum, one, other):
    threshold = PaperThreshold(minimum)
    assert threshold.test_ratio(min(one, other)) >= threshold.test_ratio(max(one, other)) >= 0


@pytest.mark.parametrize("minimum", [-7.0, 0.0, 7.0])
def test_examples(minimum):
    threshold = PaperThreshold(minimum)
    halfway = {-7.0: 0.75, 0.0: 0.0, 7.0: 0.5}
    assert threshold.test_ratio(minimum - 0.5 * abs(minimum)) == pytest.approx(halfway[minimum])
    assert threshold.test_ratio(minimum - 3 * abs(minimum) - 1e-6) > 1


@pytest.mark.parametrize("minimum", [-7.0, 0.0, 7.0])
def test_nothing_seen_is_no_alarm(minimum):
    """Nothing seen is infinitely likely."""
    assert PaperThreshold(minimum).test_ratio(np.inf) == 0
