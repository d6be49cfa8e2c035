"""An alarm: when it comes, what of it stays, what may be refined, and what ends it."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from detection.verdicts import run_online, task_of
from hypothesis import given
from hypothesis import strategies as st
from strategies import seeds

from probdmp import FailureDetector
from probdmp.detection.calibrated_monitor import CalibratedMonitor
from probdmp.detection.calibration import Calibration
from probdmp.detection.diagnosis import Diagnosis
from probdmp.execution import Observed

LATCHED = ("failed", "step", "time", "phase", "test_ratio", "channel")


class Script:
    """A source that says what it is told to say: values of one channel, a list for each tick."""

    def __init__(self, values, faults=None, stale=()):
        self.values, self.faults, self.stale, self.t = values, faults or {}, stale, -1

    def update(self, observed):
        self.t += 1
        return [np.array([value]) for value in self.values[self.t]]

    def contributions(self, channel):
        return np.array([self.t, -1.0])

    def diagnose(self, *context):
        return Diagnosis("motion", f"as of {self.t}")

    def better(self):
        return "other"

    @property
    def sensors(self):
        cause = max((fault for t, fault in self.faults.items() if t <= self.t), default="")
        stale = self.t in self.stale
        return SimpleNamespace(cause=cause, ratio=1.5, shares=np.array([0.0, 1.5]), staleness=1.5, is_stale=stale)


CALIBRATION = Calibration(np.arange(1.0, 100.0)[:, None], ["a"] * 99, 0.05, "held_out")


def monitored(source, persistence=1):
    """The verdict and the test ratio after each tick."""
    monitor = CalibratedMonitor(source, CALIBRATION, "a", ("loudness",), ("x", "y"), persistence)
    nothing, verdicts, ratios = np.full(2, np.nan), [], []
    for t in range(len(source.values)):
        ratios.append(monitor.update(Observed(t, t * 0.1, 0.9**t, nothing, nothing, nothing, nothing)))
        verdicts.append(monitor.verdict)
    return verdicts, ratios


def each(values):
    return [[value] for value in values]


def first_run(above, length):
    """Where the first `length` in a row end, or None."""
    count = 0
    for t, is_above in enumerate(above):
        count = count + 1 if is_above else 0
        if count == length:
            return t
    return None


def same_latched(one, other):
    np.testing.assert_array_equal(one.contributions, other.contributions)
    assert [getattr(one, name) for name in LATCHED] == [getattr(other, name) for name in LATCHED]


@given(seeds, st.integers(1, 6), st.floats(30, 110))
def test_persistence_asks_for_that_many_moments_in_a_row(seed, persistence, scale):
    """So it delays by one moment less, and never raises an alarm that fewer would not have raised before."""
    rng = np.random.default_rng(seed)
    values = rng.uniform(0, scale, 60)
    values[30:] += 30
    verdicts, ratios = monitored(Script(each(values)), persistence)
    expected = first_run(np.array(ratios) > 1, persistence)
    assert verdicts[-1].failed == (expected is not None)
    assert [v.failed for v in verdicts] == [expected is not None and t >= expected for t in range(60)]
    if expected is not None:
        assert verdicts[-1].step == expected
        assert verdicts[-1].test_ratio == ratios[expected] > 1
        fewer = monitored(Script(each(values)), max(persistence - 1, 1))[0][-1]
        assert fewer.failed
        assert fewer.step <= expected


@pytest.mark.parametrize("persistence", [1, 2, 5])
def test_a_lasting_failure_is_called_that_much_later(persistence):
    verdicts, _ = monitored(Script(each([1.0] * 20 + [1e4] * 20)), persistence)
    assert verdicts[-1].step == 20 + persistence - 1


@given(seeds, st.integers(1, 3))
def test_the_first_alarm_is_latched_and_only_its_reason_refined(seed, persistence):
    values = np.random.default_rng(seed).uniform(0, 150, 60)
    verdicts, _ = monitored(Script(each(values)), persistence)
    failed = [v for v in verdicts if v.failed]
    for verdict in failed:
        same_latched(verdict, failed[0])
        assert (verdict.kind, verdict.better, verdict.channel) == ("motion", "other", "loudness")
        assert verdict.cause.startswith("as of ")
    for verdict in verdicts:
        if not verdict.failed:
            assert (verdict.kind, verdict.cause, verdict.better) == ("", "", "")


def test_without_an_alarm_the_worst_moment_is_told():
    verdicts, ratios = monitored(Script(each([1.0, 40.0, 90.0, 20.0, 60.0])))
    assert not verdicts[-1].failed
    assert (verdicts[-1].step, verdicts[-1].test_ratio) == (2, ratios[2])
    assert ratios[2] <= 1


def test_no_evidence_interrupts_what_persists():
    verdicts, ratios = monitored(Script(each([1e4, np.nan, 1e4, np.nan, 1e4])), persistence=2)
    assert not verdicts[-1].failed
    assert ratios[1] == ratios[3] == 0


def test_moments_count_and_not_ticks_of_the_controller():
    """A slow controller completes several at once, or none."""
    verdicts, _ = monitored(Script([[1.0], [1e4], [], [], [1e4, 1e4], [1.0]]), persistence=3)
    assert [v.failed for v in verdicts] == [False, False, False, False, True, True]
    assert verdicts[-1].step == 4


def test_a_sensor_fault_is_an_alarm_of_its_own():
    verdicts, _ = monitored(Script(each([1.0] * 10), {4: "stuck"}))
    verdict = verdicts[-1]
    assert [v.failed for v in verdicts] == [False] * 4 + [True] * 6
    assert (verdict.step, verdict.kind, verdict.cause, verdict.channel) == (4, "sensor", "stuck", "sensor")
    assert verdict.has_sensor_fault
    assert verdict.test_ratio >= 1


def test_a_sensor_fault_explains_an_alarm_but_does_not_move_it():
    verdicts, _ = monitored(Script(each([1.0, 1.0, 1e4, *[1e4] * 7]), {5: "spikes"}))
    assert [v.kind for v in verdicts[2:]] == ["motion"] * 3 + ["sensor"] * 5
    assert verdicts[-1].cause == "spikes"
    assert verdicts[-1].better == ""
    for verdict in verdicts[2:]:
        same_latched(verdict, verdicts[2])


def test_silence_is_an_alarm_and_staleness_passes():
    """Whether data is missing now, and that it once was, are two things."""
    verdicts, _ = monitored(Script(each([1.0] * 10), stale=(3, 4)))
    assert [v.is_stale for v in verdicts] == [t in (3, 4) for t in range(10)]
    assert [v.failed for v in verdicts] == [t >= 3 for t in range(10)]
    assert {(v.step, v.kind, v.cause) for v in verdicts[3:]} == {(3, "data missing", "nothing measured")}


def test_a_stale_sensor_changes_nothing_of_an_earlier_alarm():
    verdicts, _ = monitored(Script(each([1.0, 1e4, *[1.0] * 8]), stale=(5,)))
    for verdict in verdicts[1:]:
        same_latched(verdict, verdicts[1])
        assert verdict.kind == "motion"
    assert verdicts[5].is_stale


def test_reset_begins_anew(calibrated, varied, executions):
    held, primitive = executions["hold"][0], varied["a"].primitive_
    execution, steps = run_online(primitive, task_of(primitive, held, True), held, calibrated)
    assert execution.failed
    first = execution.verdict
    execution.reset()
    assert not execution.failed
    assert execution.verdict.test_ratio == 0
    again = [execution.step(row).test_ratio for row in held.positions]
    np.testing.assert_array_equal(again, [s.test_ratio for s in steps])
    same_latched(execution.verdict, first)


def test_persistence_on_a_real_execution(varied, training, executions):
    """Later and rarer, whatever the failure; and one execution's alarm is not another's."""
    chosen = [d for kind in ("fine", "hold", "push") for d in executions[kind] if d.label == "l"]
    results = []
    for persistence in (1, 4):
        detector = FailureDetector(0.05, persistence=persistence).fit(varied["l"], training["l"])
        results.append(detector.verdicts(chosen))
    for sooner, later in pairwise(results):
        for one, other in zip(sooner, later, strict=True):
            assert one.failed or not other.failed
            if other.failed:
                assert one.step <= other.step
    assert any(v.failed for v in results[-1])
