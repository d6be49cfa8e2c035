"""The paper's table, for people: published figures first, then each reading."""

from typing import TYPE_CHECKING

from probdmp.cli.output import print_line, print_table

if TYPE_CHECKING:
    from probdmp.evaluation import Evaluation, Rate, Summary

__all__ = ["print_evaluation"]

NOTES = (
    "Second lines: exact 95 % intervals (Clopper-Pearson).",
    "Detected: first alarm at or after the onset of the fault. Ever: at any time, the paper's count.",
    "Latency: from onset to alarm, % of the duration, median and 95th percentile.",
)


def print_evaluation(evaluation: "Evaluation") -> None:
    """What was run, then a table for each fault."""
    from probdmp.evaluation import published_summary

    experiment, document = evaluation.experiment, evaluation.as_dict()
    configuration = document["configuration"]
    print_line(
        f"{document['classes']} classes, {experiment.train} training and {experiment.test} test demonstrations each, "
        f"seed {experiment.seed}"
    )
    print_line(
        f"detector {experiment.detector}, task {experiment.task}, {configuration['discretization']}, "
        f"scaling {configuration['scaling']}"
    )
    rows = {"the paper\nas published": published_summary()}
    for reading, summary in evaluation.summaries().items():
        rows[f"{reading.forcing_noise}\n{reading.likelihood.replace('_', ' ')}"] = summary
    for fault in experiment.faults:
        print_table(
            ["forcing noise\nlikelihood", "false alarms", "detected", "ever failed", "latency"],
            [[name, *_cells(summary, fault)] for name, summary in rows.items()],
            title=f"Fault: {fault}",
            second_lines="dim",
        )
    for note in NOTES:
        print_line(note, style="dim")


def _cells(summary: "Summary", fault: str) -> list[str]:
    false_alarms, figures = _rate(summary.false_alarms), summary.faults.get(fault)
    if figures is None:
        return [false_alarms, "–", "–", "–"]
    latency = "–"
    if figures.latency_median is not None and figures.latency_p95 is not None:
        latency = f"{100 * figures.latency_median:.1f} %\np95 {100 * figures.latency_p95:.1f} %"
    return [false_alarms, _rate(figures.detected), _rate(figures.ever), latency]


def _rate(rate: "Rate | None") -> str:
    if rate is None:
        return "–"
    return f"{rate.count}/{rate.n} {100 * rate.rate:.1f} %\n{100 * rate.low:.1f}–{100 * rate.high:.1f} %"
