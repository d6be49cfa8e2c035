"""The same traces at other thresholds: what would have been detected, and how soon, had another alarm rate been asked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from probdmp.demonstrations import FAILURE, fault_named
from probdmp.errors import InputError
from probdmp.evaluation.metrics import Rate, rate_of
from probdmp.evaluation.outcomes import Assessment, Finding, Outcome, Trace
from probdmp.evaluation.trials import UNDISTURBED

__all__ = [
    "OperatingCurves",
    "Promptness",
    "RealizedRate",
    "at_level",
    "detected_within",
    "has_traces",
    "level_realizing",
    "operating_curves",
    "realized_rates",
]

LARGEST_RATE = 0.2
"""Of false alarms, up to which operating curves go."""
N_RATES = 41
LATENCIES = tuple(round(k / 100, 2) for k in range(41))
"""Fractions of the duration."""

APART = ("sensor", "data missing")
"""Kinds of alarms that have thresholds of their own."""


@dataclass(frozen=True, slots=True)
class RealizedRate:
    """False alarms at the threshold for one nominal rate."""

    nominal: float
    """alpha, as a fraction of executions."""
    level: float
    """Test ratio, as traced, at which the threshold for alpha lies."""
    realized: Rate
    low: float
    """2.5 % quantile of the rate of the same number of executions, if those that calibrated are like them."""
    high: float
    """97.5 % quantile."""


@dataclass(frozen=True, slots=True)
class Promptness:
    """How soon failures are detected at one threshold."""

    nominal: float | None
    """The rate of false alarms that the threshold is for; None: the threshold in force."""
    detected: Mapping[str, tuple[float, ...]]
    """By failure: share detected within each of the latencies."""


@dataclass(frozen=True, slots=True)
class OperatingCurves:
    """What is detected when the threshold is moved, and how soon; rates are fractions from 0 to 1."""

    false_alarms: tuple[float, ...]
    """As they came about at each threshold, rising."""
    detected: Mapping[str, tuple[float, ...]]
    """By failure: share detected at each threshold."""
    latencies: tuple[float, ...]
    """Fractions of the duration since the onset."""
    promptness: tuple[Promptness, ...]
    """At several thresholds."""

    def __post_init__(self) -> None:
        lines = [(self.false_alarms, self.detected), *((self.latencies, one.detected) for one in self.promptness)]
        for places, shares in lines:
            if any(len(line) != len(places) for line in shares.values()):
                raise InputError(f"curves of {len(places)} points", f"{sorted({len(line) for line in shares.values()})}")


def has_traces(outcomes: Sequence[Outcome]) -> bool:
    """Whether thresholds can be moved afterwards."""
    return all(finding.trace is not None for outcome in outcomes for finding in outcome.findings.values())


def operating_curves(outcomes: Sequence[Outcome], realized: Sequence[RealizedRate] = ()) -> OperatingCurves:
    """The curves of one judge.

    Parameters
    ----------
    outcomes : with traces.
    realized : thresholds at which promptness is of interest; the one in force if there are none.
    """
    failures = [name for name in outcomes[0].onsets if fault_named(name).nature == FAILURE]
    most = int(LARGEST_RATE * len(outcomes))
    counts = sorted({round(k) for k in np.linspace(0, most, N_RATES)})
    at = [at_level(outcomes, level_realizing(outcomes, count / len(outcomes))) for count in counts]
    levels: dict[float | None, float] = {one.nominal: one.level for one in realized}
    return OperatingCurves(
        false_alarms=tuple(float(np.mean([o.false_alarm is not None for o in moved])) for moved in at),
        detected={name: tuple(detected_within(moved, name, [np.finfo(float).max])[0] for moved in at) for name in failures},
        latencies=LATENCIES,
        promptness=tuple(
            Promptness(nominal, {name: tuple(detected_within(moved, name, LATENCIES)) for name in failures})
            for nominal, level in (levels or {None: 1.0}).items()
            for moved in (at_level(outcomes, level),)
        ),
    )


def level_realizing(outcomes: Sequence[Outcome], rate: float) -> float:
    """The lowest test ratio at which no more than the fraction `rate` of the executions as recorded is called failed."""
    highest = np.sort([_trace(outcome.findings[UNDISTURBED]).test_ratios.max() for outcome in outcomes])
    allowed = int(rate * len(outcomes) + 1e-9)
    return float(highest[-1 - allowed]) if allowed < len(outcomes) else 0.0


def at_level(outcomes: Sequence[Outcome], level: float) -> list[Outcome]:
    """What the outcomes had been if a test ratio above `level` raised the alarm instead of one above 1.

    Alarms about a sensor stay where they are.
    """
    return [
        replace(outcome, findings={name: _at_level(finding, level) for name, finding in outcome.findings.items()})
        for outcome in outcomes
    ]


def detected_within(outcomes: Sequence[Outcome], fault: str, latencies: Sequence[float]) -> list[float]:
    """Share of the executions with a fault that are detected within each latency, fractions of the duration."""
    delays = [
        (alarm - o.onsets[fault]) / o.duration if alarm is not None and alarm >= o.onsets[fault] else np.inf
        for o in outcomes
        for alarm in (o.findings[fault].alarm,)
    ]
    return [float(np.mean(np.array(delays) <= latency)) for latency in latencies]


def realized_rates(assessments: Sequence[Assessment]) -> list[RealizedRate]:
    """False alarms at the thresholds for several nominal rates, all splits pooled; nothing unless classes share a threshold.

    The limits are beta-binomial: the rate that a threshold from n executions really has is beta distributed, and of those
    judged a binomial number exceeds it. They are those of one split, and hold where all executions are exchangeable.
    Source: Vovk, "Conditional validity of inductive conformal predictors", Machine Learning 92 (2013).

    Parameters
    ----------
    assessments : of each split, with traces.
    """
    from scipy.stats import betabinom

    if any(len(assessment.calibrations) != 1 for assessment in assessments):
        return []
    facts, m = [assessment.calibrations[0] for assessment in assessments], len(assessments[0].outcomes)
    found = []
    for nominal in facts[0].thresholds:
        levels = [one.thresholds[nominal] / one.threshold for one in facts]
        judged = [
            judged
            for assessment, one in zip(assessments, facts, strict=True)
            for o in assessment.outcomes
            for judged in at_level([o], one.relative_level(nominal, o.label))
        ]
        rate = rate_of(sum(o.false_alarm is not None for o in judged), len(judged))
        above = nominal * (facts[0].n + 1)
        limits = np.asarray(betabinom.ppf([0.025, 0.975], m, above, facts[0].n + 1 - above)) / m
        found.append(RealizedRate(nominal, float(np.mean(levels)), rate, float(limits[0]), float(limits[1])))
    return found


def _at_level(finding: Finding, level: float) -> Finding:
    trace = _trace(finding)
    above = np.flatnonzero(trace.test_ratios > level)
    alarms = [float(trace.times[above[0]])] if len(above) else []
    if finding.kind in APART and finding.alarm is not None and not _crosses(trace, finding.alarm):
        alarms.append(finding.alarm)
    return replace(finding, alarm=min(alarms, default=None))


def _crosses(trace: Trace, time: float) -> bool:
    """Whether the trace is above the threshold at a time."""
    return bool(trace.test_ratios[min(int(np.searchsorted(trace.times, time)), len(trace.times) - 1)] > 1)


def _trace(finding: Finding) -> Trace:
    if finding.trace is None:
        raise InputError("findings with traces", "some without", "Set traces=True in the experiment.")
    return finding.trace
