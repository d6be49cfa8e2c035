"""The same traces at other thresholds: detection at a false alarm rate that was realized rather than asked for."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from probdmp.evaluation import UNDISTURBED, Finding, Outcome, Trace

__all__ = ["at_level", "level_realizing"]


def level_realizing(outcomes: Sequence[Outcome], rate: float) -> float:
    """The lowest test ratio at which no more than the fraction `rate` of the executions as recorded is called failed."""
    highest = np.sort([_trace(outcome.findings[UNDISTURBED]).test_ratios.max() for outcome in outcomes])
    allowed = int(rate * len(outcomes) + 1e-9)
    return float(highest[-1 - allowed]) if allowed < len(outcomes) else 0.0


def at_level(outcomes: Sequence[Outcome], level: float) -> list[Outcome]:
    """What the outcomes had been if a test ratio above `level` raised the alarm instead of one above 1."""
    return [
        replace(outcome, findings={name: _at_level(finding, level) for name, finding in outcome.findings.items()})
        for outcome in outcomes
    ]


def _at_level(finding: Finding, level: float) -> Finding:
    trace = _trace(finding)
    above = trace.test_ratios > level
    return replace(finding, alarm=float(trace.times[np.argmax(above)]) if above.any() else None)


def _trace(finding: Finding) -> Trace:
    if finding.trace is None:
        raise ValueError("Expected a judge that keeps its statistic over time, got findings without traces.")
    return finding.trace
