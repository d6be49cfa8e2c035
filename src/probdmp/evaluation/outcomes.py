"""What came of each execution, and the figures made from it."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from probdmp.evaluation.metrics import Rate, rate_of

__all__ = ["READINGS", "FaultSummary", "Outcome", "Reading", "Summary", "published_summary", "summarize"]


@dataclass(frozen=True, slots=True)
class Reading:
    """A way to understand what the paper leaves open."""

    forcing_noise: str
    """`"predictive"` or `"posterior"`; see `probdmp.dmp.forcing_term`."""
    likelihood: str
    """`"per_step"` or `"cumulative"`; see `probdmp.detection.statistics`."""


READINGS = tuple(
    Reading(noise, likelihood) for noise in ("predictive", "posterior") for likelihood in ("per_step", "cumulative")
)
"""All readings; the first is the one that `as_published` takes."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One test execution, as recorded and with each fault; times in seconds."""

    label: str
    duration: float
    false_alarm: float | None
    """When the execution as recorded was called failed, if it was."""
    onsets: Mapping[str, float]
    """By fault: when it began."""
    alarms: Mapping[str, float | None]
    """By fault: when the faulty execution was called failed, if it was."""


@dataclass(frozen=True, slots=True)
class FaultSummary:
    """How a fault fared."""

    detected: Rate | None
    """First alarm at or after the onset; an earlier alarm is a miss. None: not reported."""
    ever: Rate
    """Called failed at any time, as the paper counts."""
    latency_median: float | None
    """From onset to alarm, as a fraction of the duration; None when nothing was detected."""
    latency_p95: float | None
    latency_median_seconds: float | None


@dataclass(frozen=True, slots=True)
class Summary:
    """The figures of the paper's table."""

    false_alarms: Rate
    faults: Mapping[str, FaultSummary]

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {"false_alarms": asdict(self.false_alarms), "faults": {k: asdict(v) for k, v in self.faults.items()}}


def published_summary() -> Summary:
    """What the paper reports: 2 of 220 undisturbed executions called failed, 220 of 220 blocked ones; no latency."""
    caught = rate_of(220, 220)
    return Summary(rate_of(2, 220), {"hold": FaultSummary(None, caught, None, None, None)})


def summarize(outcomes: Sequence[Outcome]) -> Summary:
    """The figures over all executions."""
    n = len(outcomes)
    false_alarms = rate_of(sum(o.false_alarm is not None for o in outcomes), n)
    return Summary(false_alarms, {fault: _summarize_fault(fault, outcomes) for fault in outcomes[0].onsets})


def _summarize_fault(fault: str, outcomes: Sequence[Outcome]) -> FaultSummary:
    alarmed = [(o, alarm) for o in outcomes if (alarm := o.alarms[fault]) is not None]
    latencies = np.array([(alarm - o.onsets[fault], o.duration) for o, alarm in alarmed if alarm >= o.onsets[fault]])
    ever, detected = rate_of(len(alarmed), len(outcomes)), rate_of(len(latencies), len(outcomes))
    if not len(latencies):
        return FaultSummary(detected, ever, None, None, None)
    seconds, fractions = latencies[:, 0], latencies[:, 0] / latencies[:, 1]
    return FaultSummary(
        detected, ever, float(np.median(fractions)), float(np.quantile(fractions, 0.95)), float(np.median(seconds))
    )
