"""Thresholds that are moved afterwards, and the rates of false alarms that come about."""

from itertools import pairwise

import numpy as np
import pytest

from probdmp.detection import CalibrationFacts
from probdmp.errors import InputError
from probdmp.evaluation import (
    UNDISTURBED,
    Assessment,
    Finding,
    Outcome,
    Trace,
    at_level,
    detected_within,
    level_realizing,
    realized_rates,
)

TIMES = np.array([0.0, 1.0, 2.0])


def outcome(undisturbed, faulty, kind="motion", label="a"):
    """An execution that lasts 2 s, whose fault begins at 1 s; three test ratios of each run."""

    def finding(ratios):
        above = np.flatnonzero(np.array(ratios) > 1)
        return Finding(float(TIMES[above[0]]) if len(above) else None, kind, trace=Trace(TIMES, np.array(ratios)))

    return Outcome(label, 2.0, {"hold": 1.0}, {UNDISTURBED: finding(undisturbed), "hold": finding(faulty)})


def facts(**changes):
    values = {
        "task": "known", "label": "", "false_alarm_rate": 0.05, "n": 99, "attainable_rate": 0.01, "source": "leave_one_out",
        "method": "conformal", "guarantee": "empirical", "threshold": 2.0, "thresholds": {0.05: 2.0, 0.5: 1.0}, "suspects": {},
        "suspects_at": {},
    }  # fmt: skip
    values |= changes
    own = {"own_thresholds": {}, "own_thresholds_at": {rate: {} for rate in values["thresholds"]}}
    return CalibrationFacts(**{**own, **values})


def test_an_alarm_about_a_sensor_has_a_threshold_of_its_own():
    silent = Finding(1.0, "data missing", trace=Trace(TIMES, np.array([0.5, 0.0, 0.0])))
    judged = Outcome("a", 2.0, {"hold": 1.0}, {UNDISTURBED: silent, "hold": silent})
    assert [at_level([judged], level)[0].false_alarm for level in (0.1, 1.0, 10.0)] == [0.0, 1.0, 1.0]


@pytest.mark.parametrize("kind", ["motion", "sensor"])
def test_the_level_in_force_changes_nothing(kind):
    outcomes = [outcome([0, 0.5, 2], [0, 3, 2], kind), outcome([0, 0, 0], [0, 0.9, 1.1], kind)]
    assert at_level(outcomes, 1.0) == outcomes


def test_a_lower_level_is_never_later():
    rng = np.random.default_rng(0)
    outcomes = [outcome(rng.exponential(size=3), rng.exponential(size=3)) for _ in range(40)]
    alarms = [[o.alarms["hold"] for o in at_level(outcomes, level)] for level in (0.3, 1.0, 3.0)]
    for sooner, later in pairwise(alarms):
        assert all(b is None or (a is not None and a <= b) for a, b in zip(sooner, later, strict=True))


def test_detected_within():
    outcomes = [outcome([0, 0, 0], ratios) for ratios in ([0, 2, 2], [0, 0, 2], [0, 0, 0], [2, 0, 0])]
    assert detected_within(outcomes, "hold", [0.0, 0.4, 0.5]) == [0.25, 0.25, 0.5]  # an alarm before the onset is a miss


def test_realized_rates_follow_the_thresholds():
    outcomes = [outcome([0, 0.4, 0], [0, 0, 0]), outcome([0, 0.6, 0], [0, 0, 0]), outcome([0, 1.2, 0], [0, 0, 0])]
    five, fifty = realized_rates([Assessment(outcomes, (facts(),))] * 2)
    assert (five.nominal, five.level, fifty.level) == (0.05, 1.0, 0.5)
    assert (five.realized.count, fifty.realized.count, five.realized.n) == (2, 4, 6)
    assert 0 <= five.low <= 0.05 <= five.high <= 1
    assert fifty.low <= 0.5 <= fifty.high


def test_limits_are_those_of_exchangeable_executions():
    """Thresholds from 99 executions, rates of 50 others: 95 % of the rates lie within the limits."""
    rng = np.random.default_rng(0)
    outcomes = [outcome([0, 0, 0], [0, 0, 0])] * 50
    (limits, _) = realized_rates([Assessment(outcomes, (facts(thresholds={0.1: 1.0, 0.2: 1.0}),))])
    scores = np.sort(rng.exponential(size=(4000, 99)), axis=1)
    thresholds = scores[:, 89]  # the 90th of 99: 0.1 (n + 1) values are at or above it, among them the threshold
    rates = np.mean(rng.exponential(size=(4000, 50)) > thresholds[:, None], axis=1)
    assert np.mean((rates >= limits.low) & (rates <= limits.high)) == pytest.approx(0.965, abs=0.02)


def test_classes_with_thresholds_of_their_own_have_no_common_rate():
    several = (facts(label="a"), facts(label="b"))
    assert realized_rates([Assessment([outcome([0, 0, 0], [0, 0, 0])], several)]) == []


def test_traces_are_asked_for():
    bare = Outcome("a", 2.0, {"hold": 1.0}, {UNDISTURBED: Finding(None), "hold": Finding(None)})
    with pytest.raises(InputError, match=r"Expected findings with traces, got some without\. Set traces=True"):
        at_level([bare], 1.0)
    assert level_realizing([outcome([0, 0.4, 0], [0, 0, 0])], 0.0) == 0.4
