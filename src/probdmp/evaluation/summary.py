"""From single outcomes to the figures of the table."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from probdmp.demonstrations import BENIGN, FAILURE, SENSOR, fault_named
from probdmp.evaluation.metrics import Rate, rate_of, rate_over_classes
from probdmp.evaluation.outcomes import Outcome
from probdmp.evaluation.trials import ONSETS, group_by_label

__all__ = ["FaultSummary", "OnsetBin", "Summary", "WorstClass", "published_summary", "summarize"]

N_ONSET_BINS = 4
DECILES = np.linspace(0.1, 0.9, 9)
HELD = {"hold": True, "slow": False}
"""Whether a movement with this fault stands still."""
SENSOR_KIND = "sensor"
"""Kind of the alarms that are about a sensor; all others are about motion or timing."""

RateOf = Callable[[Sequence[bool]], Rate]


@dataclass(frozen=True, slots=True)
class OnsetBin:
    """Faults that begin in one part of the movement."""

    begin: float
    """Fraction of the duration."""
    end: float
    detected: int
    n: int


@dataclass(frozen=True, slots=True)
class WorstClass:
    """The class with most false alarms."""

    label: str
    count: int
    n: int
    rate: float
    """As a fraction from 0 to 1, without an interval: the class was chosen by it."""


@dataclass(frozen=True, slots=True)
class FaultSummary:
    """How a fault fared. Latencies are from onset to alarm, of those detected; fractions are of the duration."""

    nature: str
    """`"failure"`, `"benign"` or `"sensor"`; see `probdmp.demonstrations.FAULTS`."""
    detected: Rate | None
    """First alarm at or after the onset; an earlier alarm is a miss. None: not reported."""
    ever: Rate
    """Called failed at any time, as the paper counts."""
    false_alarms: Rate | None = None
    """Of a benign fault: alarms at any time that are about motion or timing."""
    called_sensor: Rate | None = None
    """Of a sensor fault: detected, and said to be about a sensor."""
    told_apart: Rate | None = None
    """Of `hold` and `slow`, and of those detected: a blocked movement called held, a slow one called anything else. None: of
    other faults, or where the judge gives no causes."""
    kinds: Mapping[str, int] | None = None
    """What the alarms of those detected are about, and how many are. None: not reported."""
    latency_median: float | None = None
    """Fraction; None when nothing was detected."""
    latency_p95: float | None = None
    """Fraction."""
    latency_median_seconds: float | None = None
    latency_deciles: tuple[float, ...] | None = None
    """The 10th, 20th, … 90th percentile, fractions."""
    by_onset: tuple[OnsetBin, ...] = ()
    """Detection by when the fault begins; empty for faults that begin with the movement."""

    @property
    def latency_in_percent(self) -> str:
        """Median and 95th percentile of the latency, for a table whose head says so; a dash when nothing was detected."""
        if self.latency_median is None or self.latency_p95 is None:
            return "–"
        return f"{100 * self.latency_median:.1f} / {100 * self.latency_p95:.1f}"


@dataclass(frozen=True, slots=True)
class Summary:
    """The figures of the paper's table."""

    false_alarms: Rate
    faults: Mapping[str, FaultSummary]
    worst_class: WorstClass | None = None
    """Where false alarms are most frequent; None: not reported."""

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {
            "false_alarms": asdict(self.false_alarms),
            "worst_class": asdict(self.worst_class) if self.worst_class is not None else None,
            "faults": {name: asdict(fault) for name, fault in self.faults.items()},
        }


def published_summary() -> Summary:
    """What the paper reports: 2 of 220 undisturbed executions called failed, 220 of 220 blocked ones; no latency."""
    return Summary(rate_of(2, 220), {"hold": FaultSummary(FAILURE, detected=None, ever=rate_of(220, 220))})


def summarize(outcomes: Sequence[Outcome], n_splits: int = 1) -> Summary:
    """The figures over all executions.

    Parameters
    ----------
    n_splits : how many splits of the same recordings the outcomes come from. Intervals are exact for one and by bootstrap over
        classes for several.
    """
    labels = [o.label for o in outcomes]
    rate: RateOf = _exact_rate if n_splits == 1 else partial(rate_over_classes, labels=labels, n_splits=n_splits)
    by_class = {label: _exact_rate(_called_failed(members)) for label, members in group_by_label(outcomes).items()}
    worst, its = max(by_class.items(), key=lambda item: item[1].rate)
    return Summary(
        rate(_called_failed(outcomes)),
        {fault: _summarize_fault(fault, outcomes, rate, n_splits) for fault in outcomes[0].onsets},
        WorstClass(worst, its.count, its.n, its.rate),
    )


def _exact_rate(happened: Sequence[bool]) -> Rate:
    return rate_of(int(sum(happened)), len(happened))


def _called_failed(outcomes: Sequence[Outcome]) -> list[bool]:
    return [o.false_alarm is not None for o in outcomes]


def _summarize_fault(fault: str, outcomes: Sequence[Outcome], rate: RateOf, n_splits: int) -> FaultSummary:
    nature = fault_named(fault).nature
    findings = [o.findings[fault] for o in outcomes]
    ever = [f.alarm is not None for f in findings]
    detected = [f.alarm is not None and f.alarm >= o.onsets[fault] for f, o in zip(findings, outcomes, strict=True)]
    about_sensor = [f.kind == SENSOR_KIND for f in findings]
    both = list(zip(ever, detected, about_sensor, strict=True))
    return FaultSummary(
        nature=nature,
        detected=rate(detected),
        ever=rate(ever),
        false_alarms=rate([e and not s for e, _, s in both]) if nature == BENIGN else None,
        called_sensor=rate([d and s for _, d, s in both]) if nature == SENSOR else None,
        told_apart=_told_apart(fault, [o for o, d in zip(outcomes, detected, strict=True) if d], n_splits),
        kinds=dict(Counter(f.cause or f.kind for f, d in zip(findings, detected, strict=True) if d)),
        **_latencies(fault, [o for o, d in zip(outcomes, detected, strict=True) if d]),
        by_onset=_by_onset(fault, outcomes, detected),
    )


def _told_apart(fault: str, detected: Sequence[Outcome], n_splits: int) -> Rate | None:
    causes = [o.findings[fault].cause for o in detected]
    if fault not in HELD or not any(causes):
        return None
    right = [(cause == "held") == HELD[fault] for cause in causes]
    return _exact_rate(right) if n_splits == 1 else rate_over_classes(right, [o.label for o in detected], n_splits)


def _latencies(fault: str, detected: Sequence[Outcome]) -> dict[str, Any]:
    if not detected:
        return {}
    seconds = np.array([(o.findings[fault].alarm or 0.0) - o.onsets[fault] for o in detected])
    fractions = seconds / [o.duration for o in detected]
    return {
        "latency_median": float(np.median(fractions)),
        "latency_p95": float(np.quantile(fractions, 0.95)),
        "latency_median_seconds": float(np.median(seconds)),
        "latency_deciles": tuple(np.quantile(fractions, DECILES).tolist()),
    }


def _by_onset(fault: str, outcomes: Sequence[Outcome], detected: Sequence[bool]) -> tuple[OnsetBin, ...]:
    edges = np.linspace(*ONSETS, N_ONSET_BINS + 1)
    onsets = np.array([o.onsets[fault] / o.duration for o in outcomes])
    if not onsets.any():
        return ()
    # Rounding to samples may carry an onset over the outermost edges.
    places = np.searchsorted(edges[1:-1], onsets, side="right")
    totals, hits = np.bincount(places, minlength=N_ONSET_BINS), np.bincount(places, detected, N_ONSET_BINS)
    bounds = [round(float(edge), 9) for edge in edges]
    return tuple(
        OnsetBin(begin, end, int(hit), int(n)) for begin, end, hit, n in zip(bounds[:-1], bounds[1:], hits, totals, strict=True)
    )
