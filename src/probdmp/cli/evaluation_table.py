"""What came of an experiment, for people: the paper's table for one fault, a row for each of several."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from probdmp.cli.detector_summaries import calibration_text
from probdmp.cli.output import print_line, print_table

if TYPE_CHECKING:
    from probdmp.evaluation import Evaluation, FaultSummary, Rate, Summary
    from probdmp.evaluation.summary import WorstClass

__all__ = ["print_evaluation"]

NOTES = (
    "Detected: first alarm at or after the onset of the fault. Ever: at any time, the paper's count.",
    "Latency: from onset to alarm, % of the duration, median and 95th percentile.",
)
TOLD_APART = {"hold": "hold called held", "slow": "slow not called held"}
INTERVALS = {
    "clopper_pearson": "Intervals: 95 %, exact (Clopper-Pearson).",
    "bootstrap_over_classes": "Intervals: 95 %, bootstrap over classes.",
}


def print_evaluation(evaluation: "Evaluation") -> None:
    """What was run, then either a row for each judge or, with several faults, a table for each judge."""
    experiment, document = evaluation.experiment, evaluation.as_dict()
    configuration, last = document["configuration"], experiment.seed + experiment.seeds - 1
    print_line(
        f"{document['classes']} classes, {experiment.train} training and {experiment.test} test demonstrations each, "
        + (f"seed {experiment.seed}" if experiment.seeds == 1 else f"seeds {experiment.seed} to {last}")
    )
    print_line(
        f"detector {experiment.detector}, task {experiment.task}, {configuration['discretization']}, "
        f"scaling {configuration['scaling']}"
    )
    _print_calibrations(evaluation)
    summaries = evaluation.summaries()
    if len(experiment.faults) == 1:
        _print_judges(summaries, experiment.faults[0])
    else:
        for name, summary in summaries.items():
            _print_faults(name, summary)
    for note in (INTERVALS[document["interval"]], *NOTES):
        print_line(note, style="dim")


def _print_calibrations(evaluation: "Evaluation") -> None:
    """Where thresholds come from: a line for each judge and seed that has one."""
    for seed, split in evaluation.by_seed.items():
        for assessment in split.values():
            for facts in assessment.calibrations:
                print_line((f"seed {seed}: " if len(evaluation.by_seed) > 1 else "") + calibration_text(facts))


def _print_judges(summaries: dict[str, "Summary"], fault: str) -> None:
    """The paper's table: published figures first, then a row for each judge."""
    from probdmp.evaluation import published_summary

    rows = []
    for name, summary in {"the paper, as published": published_summary(), **summaries}.items():
        figures = summary.faults.get(fault)
        of_fault = [_rate(figures.detected), _rate(figures.ever), _latency(figures)] if figures else ["–", "–", "–"]
        rows.append([name.replace(", ", "\n", 1), _rate(summary.false_alarms), *of_fault])
    columns = ["judge", "false alarms", "detected", "ever failed", "latency"]
    print_table(columns, rows, title=f"Fault: {fault}", second_lines="dim")
    for name, summary in summaries.items():
        _print_told_apart(summary, name)


def _print_faults(name: str, summary: "Summary") -> None:
    """One judge: a table for each nature of faults, a row for each fault."""
    print_line()
    print_line(name, style="bold")
    worst, alarms = summary.worst_class, summary.false_alarms
    most = f"; most in “{worst.label}”, {_count(worst)}" if worst is not None and worst.count else ""
    print_line(f"False alarms {_count(alarms)} ({_interval(alarms)}){most}")
    for nature, title, headline in TABLES:
        rows = [
            [fault, *_counts(headline(figures)), _percent(figures.ever), *_percents(figures)]
            for fault, figures in summary.faults.items()
            if figures.nature == nature
        ]
        if rows:
            print_table([*title, "95 %", "ever", "latency", "p95"], rows)
    _print_told_apart(summary)


def _print_told_apart(summary: "Summary", judge: str = "") -> None:
    rates = {fault: figures.told_apart for fault, figures in summary.faults.items()}
    texts = [f"{TOLD_APART[fault]} {_count(rate)}" for fault, rate in rates.items() if rate is not None]
    if texts:
        print_line(f"Of those detected{f' by {judge}' if judge else ''}: {'; '.join(texts)}.")


TABLES: Sequence[tuple[str, tuple[str, str], Callable[["FaultSummary"], "Rate | None"]]] = (
    ("failure", ("failure", "detected"), lambda figures: figures.detected),
    ("benign", ("benign", "false alarms"), lambda figures: figures.false_alarms),
    ("sensor", ("sensor fault", "called sensor"), lambda figures: figures.called_sensor),
)
"""Nature, heads of the first two columns, what stands in the second."""


def _rate(rate: "Rate | None") -> str:
    return "–" if rate is None else f"{_count(rate)}\n{_interval(rate)}"


def _counts(rate: "Rate | None") -> list[str]:
    return ["–", "–"] if rate is None else [_count(rate), _interval(rate)]


def _count(rate: "Rate | WorstClass") -> str:
    return f"{rate.count}/{rate.n} {_percent(rate)}"


def _percent(rate: "Rate | WorstClass") -> str:
    return f"{100 * rate.rate:.1f} %"


def _interval(rate: "Rate") -> str:
    return f"{100 * rate.low:.1f}–{100 * rate.high:.1f} %"


def _percents(figures: "FaultSummary") -> list[str]:
    return ["–" if value is None else f"{100 * value:.1f} %" for value in (figures.latency_median, figures.latency_p95)]


def _latency(figures: "FaultSummary") -> str:
    median, p95 = _percents(figures)
    return median if median == "–" else f"{median}\np95 {p95}"
