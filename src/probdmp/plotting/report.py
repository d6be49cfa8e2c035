"""The report of an evaluation: one page that needs nothing else, with its tables and its pictures."""

import io
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from probdmp.evaluation import Evaluation, Example, Finding, RealizedRate, Summary, realized_rates
from probdmp.io import write_atomically
from probdmp.plotting.example import plot_example_path, plot_test_ratios
from probdmp.plotting.operating import (
    failures_of,
    plot_by_onset,
    plot_latencies,
    plot_operating_curve,
    plot_realized_rates,
    plot_soon_enough,
)
from probdmp.plotting.report_tables import calibration_table, comparison_table, fault_tables, percent, realized_table
from probdmp.plotting.style import figure_style
from probdmp.plotting.trajectories import draw_bands

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["write_report"]

PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>probdmp report</title>
<style>
  body {{ font: 16px/1.5 system-ui, sans-serif; color: #1c1c1c; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }}
  h1 {{ font-size: 1.6rem; }} h2 {{ font-size: 1.2rem; margin-top: 2.2rem; }}
  table {{ border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .9rem; margin: .6rem 0 1.2rem; }}
  th, td {{ text-align: left; padding: .35rem .9rem .35rem 0; border-bottom: 1px solid #ddd; vertical-align: top; }}
  td small {{ display: block; color: #555; white-space: nowrap; }} h3 {{ font-size: 1rem; margin: 1.2rem 0 0; }}
  .wide {{ overflow-x: auto; }} figure {{ margin: 1rem 0; }} svg {{ width: 100%; height: auto; }}
  figcaption, .note {{ font-size: .9rem; color: #444; }} code {{ background: #f2f2f2; padding: .1rem .3rem; }}
</style>
<h1>Probabilistic Dynamic Movement Primitives: does it notice a failure?</h1>
{body}
<h2>Make it again</h2>
<p><code>{command}</code></p>
</html>
"""
INTRODUCTION = """<p>{classes} learned from {train} demonstrations. {test} further executions of each were
judged while they ran, as recorded and with faults that begin at a random moment. The executions were told
{told}{seeds}.{asked}</p>"""
TOLD = {
    "known": "their start, goal and duration (task “known”)",
    "nominal": "their start; goal and duration are as learned (task “nominal”)",
}
RATES_NOTE = """<p class="note">Counts, rates and 95 % intervals, {interval}. Latency: from the onset of the fault to the alarm,
in percent of the duration of the movement.{paper}</p>"""
PAPER_NOTE = """ The paper's rule: failed below twice the least log-likelihood of the training demonstrations; “predictive” and
“posterior”, “per step” and “cumulative” are what its text leaves open."""
INTERVALS = {1: "exact (Clopper–Pearson)"}


def write_report(path: str | Path, evaluation: Evaluation, example: Example, command: str) -> None:
    """Write the page, atomically. Operating curves are left out unless the judges keep their traces.

    Parameters
    ----------
    command : what to type to make it again.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    name, summary = next(iter(evaluation.summaries().items()))
    judgements = [split[name] for split in evaluation.by_seed.values()]
    has_traces = all(f.trace is not None for o in evaluation.outcomes[name] for f in o.findings.values())
    realized = realized_rates(judgements) if has_traces else []
    body = [
        _introduction(evaluation),
        _rates(evaluation, summary),
        _calibration(evaluation, name, realized),
        _operating(evaluation, name, summary, realized) if has_traces else "",
        _when(summary),
        _example(example),
        _learned(example),
    ]
    page = PAGE.format(body="\n".join(body), command=escape(command))
    write_atomically(path, page.encode())


def _introduction(evaluation: Evaluation) -> str:
    experiment, n_classes = evaluation.experiment, evaluation.as_dict()["classes"]
    calibrated = any(judgement.calibrations for split in evaluation.by_seed.values() for judgement in split.values())
    asked = (
        f" The detector was asked for {percent(experiment.false_alarm_rate)} false alarms per execution." if calibrated else ""
    )
    return INTRODUCTION.format(
        classes="A movement was" if n_classes == 1 else f"{n_classes} movements were each",
        train=experiment.train,
        test=experiment.test,
        told=TOLD[experiment.task],
        seeds="" if experiment.seeds == 1 else f". {experiment.seeds} splits were drawn and are pooled",
        asked=asked,
    )


def _rates(evaluation: Evaluation, summary: Summary) -> str:
    experiment, summaries = evaluation.experiment, evaluation.summaries()
    parts = ["<h2>False alarms and detected failures</h2>", comparison_table(evaluation, experiment.faults[0])]
    if len(experiment.faults) > 1 or experiment.faults[0] not in failures_of(summary):
        for name, its in summaries.items():
            parts += [f"<h3>{escape(name)}</h3>" if len(summaries) > 1 else "", fault_tables(its)]
    interval = INTERVALS.get(experiment.seeds, "by bootstrap over classes, where several splits reuse the recordings")
    has_paper = any(name.startswith(("predictive", "posterior")) for name in summaries)
    parts.append(RATES_NOTE.format(interval=interval, paper=PAPER_NOTE if has_paper else ""))
    worst = summary.worst_class
    if worst is not None and worst.count:
        parts.append(f'<p class="note">Most false alarms: “{escape(worst.label)}”, {worst.count} of {worst.n}.</p>')
    return "\n".join(parts)


def _calibration(evaluation: Evaluation, name: str, realized: Sequence[RealizedRate]) -> str:
    calibrations = {seed: split[name].calibrations for seed, split in evaluation.by_seed.items()}
    if not any(calibrations.values()):
        return ""
    parts = ["<h2>Is the rate of false alarms kept?</h2>", calibration_table(calibrations)]
    if realized:
        parts += [realized_table(realized), _figure(_draw_realized(realized), CALIBRATION_CAPTION)]
    return "\n".join(parts)


CALIBRATION_CAPTION = """α is per execution. <em>Attainable</em>: the least rate that n calibration executions can vouch for,
1 / (n + 1). <em>Flagged</em>: movements with more calibration executions above the threshold than chance explains, and their
share. Grey: where the realised rate lies in 95 % of splits if executions are exchangeable."""
OPERATING_CAPTION = """Left: what is detected when the threshold is moved, against the false alarms it then
raises (dots: as set); an alarm before the onset is a miss, so a curve may fall. Right: the
share of “{fault}” detected within a time since the onset{several}."""
WHEN_CAPTION = """Left: detection by the moment at which the failure begins. Right: from onset to alarm; the line goes from the
10th to the 90th percentile, the dot is the median, the tick the 95th percentile."""
EXAMPLE_CAPTION = """“{label}” as recorded (solid green) and with the fault “{fault}” from {onset:.2f} s on (dashed orange), in
the learned band; right, the test ratio of both: statistic over threshold. Shown is the first test execution that was judged
rightly both times, if there was one. As recorded: {undisturbed}. With the fault: {disturbed}."""
LEARNED_CAPTION = """Left: the demonstrations (grey), moved to one start, and the mean movement. Right: position, velocity and
acceleration with 95 % bands, as planned for this execution."""


def _operating(evaluation: Evaluation, name: str, summary: Summary, realized: Sequence[RealizedRate]) -> str:
    failures = failures_of(summary)
    if not failures:
        return ""
    outcomes = evaluation.outcomes[name]
    several = ", at the thresholds for several rates of false alarms" if realized else ""
    with figure_style():
        import matplotlib.pyplot as plt

        figure, (left, right) = plt.subplots(1, 2, figsize=(11, 3.6), layout="constrained")
        plot_operating_curve(left, outcomes, summary).set_title("At what price")
        plot_soon_enough(right, outcomes, realized, failures[0]).set_title(f"How soon: “{failures[0]}”")
    caption = OPERATING_CAPTION.format(fault=escape(failures[0]), several=several)
    return "<h2>Operating curves</h2>\n" + _figure(figure, caption)


def _when(summary: Summary) -> str:
    failures = failures_of(summary)
    if not failures:
        return ""
    with figure_style():
        import matplotlib.pyplot as plt

        figure, (left, right) = plt.subplots(1, 2, figsize=(11, 2.2 + 0.25 * len(failures)), layout="constrained")
        plot_by_onset(left, summary).set_title("By onset")
        plot_latencies(right, summary).set_title("Latency")
    return "<h2>When</h2>\n" + _figure(figure, WHEN_CAPTION)


def _example(example: Example) -> str:
    n_dof = min(example.primitive.n_dof, 2)
    with figure_style():
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(1, n_dof + 1, figsize=(11, 3.2), layout="constrained")
        for dof in range(n_dof):
            plot_example_path(axes[dof], example, dof)
        plot_test_ratios(axes[-1], example)
    undisturbed, disturbed = (_said(finding) for finding in example.findings.values())
    caption = EXAMPLE_CAPTION.format(
        label=escape(example.label),
        fault=escape(example.fault),
        onset=example.onset,
        undisturbed=escape(undisturbed),
        disturbed=escape(disturbed),
    )
    return "<h2>One execution</h2>\n" + _figure(figure, caption)


def _learned(example: Example) -> str:
    with figure_style():
        figure = draw_bands(example.training, example.rollout)
    return f"<h2>What was learned: “{escape(example.label)}”</h2>\n" + _figure(figure, LEARNED_CAPTION)


def _said(finding: Finding) -> str:
    if finding.alarm is None:
        return "fine"
    why = f", {finding.kind}: {finding.cause}" if finding.kind else ""
    better = f", looks like “{finding.better}”" if finding.better else ""
    return f"failed at {finding.alarm:.2f} s{why}{better}"


def _draw_realized(realized: Sequence[RealizedRate]) -> "Figure":
    with figure_style():
        import matplotlib.pyplot as plt

        figure, ax = plt.subplots(figsize=(5.5, 3.2), layout="constrained")
        plot_realized_rates(ax, realized)
    return figure


def _figure(figure: "Figure", caption: str) -> str:
    """A picture as SVG in the page; as wide as it was drawn, on a page of eleven inches."""
    with figure_style():
        import matplotlib.pyplot as plt

        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
        share = min(100, round(100 * float(figure.get_size_inches()[0]) / 11))
        plt.close(figure)
    svg = text.getvalue()[text.getvalue().index("<svg") :]
    return f'<figure><div style="width: {share}%; min-width: 20rem">{svg}</div><figcaption>{caption}</figcaption></figure>'
