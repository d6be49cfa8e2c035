"""From single outcomes to the figures of the table."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from probdmp.evaluation import READINGS, Finding, Outcome, summarize


def outcome(false_alarm=None, onset=0.5, alarm=None, duration=1.0, label="a", fault="hold", kind=""):
    findings = {"undisturbed": Finding(false_alarm), fault: Finding(alarm, kind if alarm is not None else "")}
    return Outcome(label, duration, {fault: onset}, findings)


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
    assert hold.latency_in_percent == f"10.0 / {100 * np.quantile([0.1, 0.3, 0.0], 0.95):.1f}"
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
    findings = {"undisturbed": Finding(None), "hold": Finding(0.6), "push:0.4": Finding(None)}
    two = Outcome("a", 1.0, {"hold": 0.5, "push:0.4": 0.4}, findings)
    faults = summarize([two, two]).faults
    assert list(faults) == ["hold", "push:0.4"]
    assert (faults["hold"].detected.count, faults["push:0.4"].detected.count) == (2, 0)
    assert two.alarms == {"hold": 0.6, "push:0.4": None}


def test_kinds_are_counted_among_those_detected():
    cases = [(0.6, "motion"), (0.7, "timing"), (0.8, "motion"), (0.1, "motion"), (None, "")]
    hold = summarize([outcome(alarm=alarm, kind=kind) for alarm, kind in cases]).faults["hold"]
    assert hold.kinds == {"motion": 2, "timing": 1}
    assert (hold.false_alarms, hold.called_sensor) == (None, None)


def test_a_benign_fault_counts_alarms_about_the_movement_whenever_they_come():
    cases = [(0.6, "motion"), (0.1, "timing"), (0.7, "sensor"), (0.8, ""), (None, "")]
    dropout = summarize([outcome(alarm=alarm, kind=kind, fault="dropout") for alarm, kind in cases]).faults["dropout"]
    assert (dropout.nature, dropout.false_alarms.count, dropout.false_alarms.n) == ("benign", 3, 5)
    assert dropout.called_sensor is None


def test_a_sensor_fault_is_to_be_called_one():
    cases = [(0.6, "motion"), (0.1, "sensor"), (0.7, "sensor"), (0.8, ""), (None, "")]
    spikes = summarize([outcome(alarm=alarm, kind=kind, fault="spikes") for alarm, kind in cases]).faults["spikes"]
    assert (spikes.nature, spikes.called_sensor.count, spikes.called_sensor.n) == ("sensor", 1, 5)
    assert (spikes.detected.count, spikes.false_alarms) == (3, None)


def test_latency_deciles():
    outcomes = [outcome(onset=0.3, alarm=0.3 + k / 100) for k in range(51)]
    deciles = summarize(outcomes).faults["hold"].latency_deciles
    np.testing.assert_allclose(deciles, np.arange(1, 10) * 0.05)


def test_detection_by_when_the_fault_begins():
    onsets = [0.3, 0.39, 0.4, 0.45, 0.69, 0.7, 0.705]
    outcomes = [outcome(onset=onset, alarm=0.9 if onset > 0.42 else None) for onset in onsets]
    bins = summarize(outcomes).faults["hold"].by_onset
    assert [(b.begin, b.end) for b in bins] == [(0.3, 0.4), (0.4, 0.5), (0.5, 0.6), (0.6, 0.7)]
    assert [(b.detected, b.n) for b in bins] == [(0, 2), (1, 2), (0, 0), (3, 3)]


def test_a_fault_from_the_start_has_no_onset_to_tell_apart():
    wrong = summarize([outcome(onset=0.0, alarm=0.2, fault="wrong_class")] * 3).faults["wrong_class"]
    assert wrong.by_onset == ()
    assert wrong.detected.count == 3


def test_the_worst_class_is_named():
    outcomes = [outcome(label="a")] * 9 + [outcome(0.3, label="a")] + [outcome(0.2, label="b")] * 2 + [outcome(label="b")] * 2
    worst = summarize(outcomes).worst_class
    assert (worst.label, worst.count, worst.n, worst.rate) == ("b", 2, 4, 0.5)


def test_several_splits_have_intervals_over_classes():
    """Twenty classes, of which one always fails: exact intervals would take its forty runs for independent ones."""
    outcomes = [outcome(0.2 if k == 0 else None, alarm=0.7, label=f"{k}") for k in range(20) for _ in range(40)]
    one, several = summarize(outcomes), summarize(outcomes, n_splits=4)
    assert one.false_alarms.count == several.false_alarms.count == 40
    assert several.false_alarms.high - several.false_alarms.low > 3 * (one.false_alarms.high - one.false_alarms.low)
    assert several.faults["hold"].detected.low < 1  # all detected in every class: as in one split


def test_the_first_reading_is_that_of_as_published():
    assert (READINGS[0].forcing_noise, READINGS[0].likelihood) == ("predictive", "per_step")
    assert READINGS[0].name == "predictive, per step"
    assert len(set(READINGS)) == 6
