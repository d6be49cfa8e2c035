"""The tables of reports, as HTML."""

from collections.abc import Callable, Mapping, Sequence

from probdmp.detection import CalibrationFacts
from probdmp.evaluation import EvaluationRecord, FaultSummary, Rate, RealizedRate, Summary, published_summary
from probdmp.plotting.page import table

__all__ = ["FLAGGED", "calibration_table", "comparison_table", "fault_tables", "is_papers", "percent", "realized_table"]

FLAGGED = """<em>Flagged</em>: movements with more calibration executions among the most surprising tenth than chance explains,
or that rank higher throughout than it explains; in brackets the share of their executions in that tenth."""

NATURES: Sequence[tuple[str, tuple[str, str], Callable[[FaultSummary], Rate | None]]] = (
    ("failure", ("Failure", "Detected at or after the onset"), lambda figures: figures.detected),
    ("benign", ("No failure", "False alarms"), lambda figures: figures.false_alarms),
    ("sensor", ("Sensor fault", "Called a sensor fault"), lambda figures: figures.called_sensor),
)
"""Nature of faults, heads of the first two columns, what stands in the second."""


LATENCY = "Latency, median / p95"


def comparison_table(record: EvaluationRecord, fault: str) -> str:
    """A row for each judge, the published figures first."""
    rows = []
    summaries = {judge.name: judge.summary for judge in record.judges}
    for name, summary in {"the paper, as published": published_summary(), **summaries}.items():
        figures = summary.faults.get(fault)
        of_fault = ["–"] * 4
        if figures is not None:
            of_fault = [_rate(figures.detected), _rate(figures.ever), _latency(figures), _kinds(figures)]
        rows.append([f"the paper's rule: {name}" if is_papers(name) else name, _rate(summary.false_alarms), *of_fault])
    heads = ("Judge", "False alarms", f"{fault}: at or after the onset", f"{fault}: at any time", LATENCY, "Said to be")
    return table(heads, rows)


def fault_tables(summary: Summary) -> str:
    """A table for each nature of faults, a row for each fault."""
    tables = []
    for nature, heads, headline in NATURES:
        rows = [
            [name, _rate(headline(figures)), _rate(figures.ever), _latency(figures), _kinds(figures)]
            for name, figures in summary.faults.items()
            if figures.nature == nature
        ]
        if rows:
            tables.append(table((*heads, "At any time", LATENCY, "Said to be"), rows))
    return "\n".join(tables)


def calibration_table(calibrations: Mapping[int, Sequence[CalibrationFacts]], by_seed: bool = True) -> str:
    """Where thresholds come from: a row for each, with the seed or, of a model, with the task it is for."""
    rows = [
        [
            str(seed) if by_seed else facts.task,
            facts.label or "shared",
            str(facts.n),
            percent(facts.false_alarm_rate),
            percent(facts.attainable_rate),
            facts.method,
            facts.guarantee,
            f"{facts.threshold:.2f}",
            ", ".join(f"{label} ({percent(share)})" for label, share in facts.suspects.items()) or "none",
        ]
        for seed, several in calibrations.items()
        for facts in several
    ]
    first = "Seed" if by_seed else "Task"
    return table((first, "For", "n", "α", "Attainable", "Method", "Guarantee", "Threshold [nats]", "Flagged"), rows)


def realized_table(realized: Sequence[RealizedRate]) -> str:
    """False alarms at several nominal rates."""
    rows = [[percent(one.nominal), _rate(one.realized), f"{100 * one.low:.1f}–{percent(one.high)}"] for one in realized]
    return table(("α", "Realised", "Limits of chance, one split"), rows)


def percent(fraction: float) -> str:
    """A fraction in percent, with one decimal unless it is a round number; the space does not break."""
    return f"{100 * fraction:.1f} %".replace(".0 %", " %").replace(" ", "\N{NO-BREAK SPACE}")


def is_papers(name: str) -> bool:
    """Whether a judge is a reading of the paper's rule."""
    return name.startswith(("predictive", "posterior", "between"))


def _kinds(figures: FaultSummary) -> str:
    """What alarms were about, the most frequent first; nothing where the judge does not say."""
    kinds = sorted((figures.kinds or {}).items(), key=lambda item: -item[1])
    return ", ".join(f"{name} {count}" for name, count in kinds if name) or "–"


def _latency(figures: FaultSummary) -> str:
    if figures.latency_median is None or figures.latency_p95 is None:
        return "–"
    return f"{100 * figures.latency_median:.1f} / {100 * figures.latency_p95:.1f} %"


def _rate(rate: Rate | None) -> str:
    """Count and rate, and on a second line the interval."""
    return "–" if rate is None else f"{rate.count}/{rate.n} {percent(rate.rate)}\n{100 * rate.low:.1f}–{percent(rate.high)}"
