"""The tables of a report, as HTML."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape

from probdmp.detection import CalibrationFacts
from probdmp.evaluation import Evaluation, FaultSummary, Rate, Summary, published_summary
from probdmp.evaluation.operating import RealizedRate

__all__ = ["calibration_table", "comparison_table", "fault_tables", "percent", "realized_table"]

NATURES: Sequence[tuple[str, tuple[str, str], Callable[[FaultSummary], Rate | None]]] = (
    ("failure", ("Failure", "Detected at or after the onset"), lambda figures: figures.detected),
    ("benign", ("No failure", "False alarms"), lambda figures: figures.false_alarms),
    ("sensor", ("Sensor fault", "Called a sensor fault"), lambda figures: figures.called_sensor),
)
"""Nature of faults, heads of the first two columns, what stands in the second."""


LATENCY = "Latency, median / p95"


def comparison_table(evaluation: Evaluation, fault: str) -> str:
    """A row for each judge, the published figures first."""
    rows = []
    for name, summary in {"the paper, as published": published_summary(), **evaluation.summaries()}.items():
        figures = summary.faults.get(fault)
        of_fault = ["–"] * 4
        if figures is not None:
            of_fault = [_rate(figures.detected), _rate(figures.ever), _latency(figures), _kinds(figures)]
        rows.append([_named(name), _rate(summary.false_alarms), *of_fault])
    heads = ("Judge", "False alarms", f"{fault}: at or after the onset", f"{fault}: at any time", LATENCY, "Said to be")
    return _table(heads, rows)


def fault_tables(summary: Summary) -> str:
    """A table for each nature of faults, a row for each fault."""
    tables = []
    for nature, heads, headline in NATURES:
        rows = [
            [name, _rate(headline(figures)), percent(figures.ever.rate), _latency(figures), _kinds(figures)]
            for name, figures in summary.faults.items()
            if figures.nature == nature
        ]
        if rows:
            tables.append(_table((*heads, "At any time", LATENCY, "Said to be"), rows))
    return "\n".join(tables)


def calibration_table(calibrations: Mapping[int, Sequence[CalibrationFacts]]) -> str:
    """Where thresholds come from, by seed."""
    rows = [
        [
            str(seed),
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
    return _table(("Seed", "Threshold", "n", "α", "Attainable", "Method", "Guarantee", "Nats", "Flagged"), rows)


def realized_table(realized: Sequence[RealizedRate]) -> str:
    """False alarms at several nominal rates."""
    rows = [[percent(one.nominal), _rate(one.realized), f"{100 * one.low:.1f}–{percent(one.high)}"] for one in realized]
    return _table(("α", "Realised", "Limits of chance, one split"), rows)


def percent(fraction: float) -> str:
    """A fraction in percent, with one decimal unless it is a round number."""
    return f"{100 * fraction:.1f} %".replace(".0 %", " %")


def _named(name: str) -> str:
    """Readings of the paper's rule are called so."""
    return f"the paper's rule: {name}" if name.startswith(("predictive", "posterior")) else name


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


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(text)}" for text in heads)
    body = "\n".join("<tr>" + "".join(f"<td>{_cell(cell)}" for cell in row) for row in rows)
    return f'<div class="wide"><table>\n<tr>{head}\n{body}\n</table></div>'


def _cell(text: str) -> str:
    """The first line, and smaller what stands below it."""
    first, _, second = text.partition("\n")
    return f"{escape(first)}<small>{escape(second)}</small>" if second else escape(first)
