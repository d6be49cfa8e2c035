"""From single outcomes to the figures of the table."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from probdmp.evaluation import READINGS, Outcome, summarize


def outcome(false_alarm=None, onset=0.5, alarm=None, duration=1.0):
    return Outcome("a", duration, false_alarm, {"hold": onset}, {"hold": alarm})


def test_detection_is_the_first_alarm_at_or_after_the_onset():
    """An earlier alarm is a miss, however well the fault would have been seen."""
    outcomes = [outcome(alarm=0.49), outcome(alarm=0.5), outcome(alarm=0.8), outcome(alarm=None)]
    hold = summarize(outcomes).faults["hold"]
    assert (hold.detected.count, hold.detected.n) == (2, 4)
    assert (hold.ever.count, hold.ever.n) == (3, 4)


def test_latency_is_from_onset_to_alarm_as_a_fraction_of_the_duration():
    outcomes = [
        outcome(onset=1.0, alarm=1.2, duration=2.0),
        outcome(onset=0.4, alarm=0.7, duration=1.0),
        outcome(onset=2.0, alarm=2.0, duration=4.0),
        outcome(onset=2.0, alarm=1.0, duration=4.0),  # early: a miss has no latency
        outcome(onset=2.0, alarm=None, duration=4.0),
    ]
    hold = summarize(outcomes).faults["hold"]
    assert hold.latency_median == pytest.approx(0.1)
    assert hold.latency_median_seconds == pytest.approx(0.2)
    assert hold.latency_p95 == pytest.approx(np.quantile([0.1, 0.3, 0.0], 0.95))


def test_nothing_detected_has_no_latency():
    hold = summarize([outcome(), outcome(alarm=0.1)]).faults["hold"]
    assert hold.detected.count == 0
    assert (hold.latency_median, hold.latency_p95, hold.latency_median_seconds) == (None, None, None)


@given(st.lists(st.tuples(st.none() | st.floats(0, 2), st.none() | st.floats(0, 2), st.floats(0, 1)), min_size=1, max_size=30))
def test_counts_add_up(cases):
    outcomes = [outcome(false, onset, alarm) for false, alarm, onset in cases]
    summary = summarize(outcomes)
    hold = summary.faults["hold"]
    assert summary.false_alarms.n == hold.detected.n == hold.ever.n == len(cases)
    assert summary.false_alarms.count == sum(false is not None for false, _, _ in cases)
    assert hold.ever.count == sum(alarm is not None for _, alarm, _ in cases)
    assert hold.detected.count == sum(alarm is not None and alarm >= onset for _, alarm, onset in cases)
    assert (hold.latency_median is None) == (hold.detected.count == 0)
    if hold.detected.count:
        assert 0 <= hold.latency_median <= hold.latency_p95 <= 2
    json.dumps(summary.as_dict(), allow_nan=False)


def test_every_fault_is_summarised():
    two = Outcome("a", 1.0, None, {"hold": 0.5, "push": 0.4}, {"hold": 0.6, "push": None})
    faults = summarize([two, two]).faults
    assert list(faults) == ["hold", "push"]
    assert (faults["hold"].detected.count, faults["push"].detected.count) == (2, 0)


def test_the_first_reading_is_that_of_as_published():
    assert (READINGS[0].forcing_noise, READINGS[0].likelihood) == ("predictive", "per_step")
    assert len(set(READINGS)) == 4
