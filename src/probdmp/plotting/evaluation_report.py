"""The report of an evaluation: its tables and its pictures, how each number was made, and how to make it again."""

from functools import partial
from html import escape
from typing import TYPE_CHECKING

from probdmp.evaluation import EvaluationRecord, Example, Finding, JudgeRecord
from probdmp.evaluation.metrics import BOOTSTRAP
from probdmp.plotting.demonstrations import plot_demonstrated_paths
from probdmp.plotting.example import example_panels
from probdmp.plotting.operating import failures_of, onset_panels, operating_panels, plot_realized_rates
from probdmp.plotting.page import code, definitions, figure, heading, note, page, paragraph
from probdmp.plotting.panels import Panel
from probdmp.plotting.report_tables import (
    FLAGGED,
    calibration_table,
    comparison_table,
    fault_tables,
    is_papers,
    percent,
    realized_table,
)
from probdmp.plotting.style import MEAN, require_matplotlib
from probdmp.plotting.trajectories import QUANTITIES, band_panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["evaluation_page"]

TITLE = "Probabilistic Dynamic Movement Primitives: does it notice a failure?"
INTRODUCTION = """{classes} learned from {train} demonstrations. {test} further executions of each were judged while they ran,
as recorded and with faults that begin at a random moment. The executions were told {told}{seeds}.{asked}"""
TOLD = {
    "known": "their start, goal and duration (task “known”)",
    "nominal": "their start; goal and duration are as learned (task “nominal”)",
}
RATES_NOTE = """Counts, rates and 95 % intervals. Latency: from the onset of the fault to the alarm, in percent of the duration
of the movement."""
CALIBRATION_CAPTION = f"""α is per execution. <em>Attainable</em>: the least rate that n calibration executions can vouch for,
1 / (n + 1). {FLAGGED} Grey: where the realised rate lies in 95 % of splits if executions are exchangeable."""
OPERATING_CAPTION = """First what is detected when the threshold is moved, against the false alarms it then raises (crosses: as
set); an alarm before the onset is a miss, so a curve may fall. Then, for each failure, the share detected within a time since
the onset{several}."""
ONSET_CAPTION = """Detection by the moment at which the failure begins, and the time from onset to alarm: the line goes from the
10th to the 90th percentile, the dot is the median, the tick the 95th percentile."""
EXAMPLE_CAPTION = """“{label}” as recorded (solid) and with the fault “{fault}” from {onset:.2f} s on (dashed), in the learned
band; then the test ratio of both: statistic over threshold. Shown is the first test execution that was judged rightly both
times, if there was one. As recorded: {undisturbed}. With the fault: {disturbed}."""
LEARNED_CAPTION = """Position, velocity and acceleration with 95 % bands, as planned for this execution; and the demonstrations
(grey), moved to one start, around the mean movement."""
WITHOUT_RECORDINGS = """The file this page is made from holds figures, no recordings. The command below, with
<code>--report</code>, adds an execution and what was learned."""
EXACT = "Exact for the binomial, at 95 % (Clopper–Pearson): executions count as independent."
OVER_CLASSES = """By bootstrap over classes, at 95 %: splits reuse the recordings and executions of a class are alike, so whole
classes are drawn again; where all classes have the same rate, exact for as many cases as one split has."""
MADE = {
    "False alarms": "Executions as recorded that were called failed at any time, of all that were judged.",
    "Detected at or after the onset": "Executions with the fault whose first alarm came at its onset or later; an earlier "
    "alarm is a miss.",
    "At any time": "Executions with the fault that were ever called failed, as the paper counts.",
    "Latency": "Of those detected: time from onset to alarm, as a fraction of the duration of the execution as recorded.",
    "Said to be": "What the alarms of those detected were about, and how many were.",
}
MADE_CURVES = {
    "Operating curve": "Judges kept their test ratio over time. For each number of false alarms the lowest threshold is taken "
    "that raises no more, and the first alarm of every execution is looked for again. Alarms about sensors "
    "stay where they are.",
}
MADE_REALIZED = {
    "Realised, limits of chance": "False alarms at the thresholds that calibration gives for other α. The limits hold 95 % of "
    "the rates that so many test executions show if they are like those that calibrated (beta-binomial).",
}
MADE_PAPER = {
    "The paper's rule": "Failed below twice the least log-likelihood of the training demonstrations; “predictive” and "
    "“posterior”, “per step” and “cumulative” are what its text leaves open.",
}


def evaluation_page(record: EvaluationRecord, example: Example | None = None) -> str:
    """The page as HTML; what needs the traces of judges, or an example, is left out without them.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    require_matplotlib()
    judge = record.judges[0]
    return page(
        TITLE,
        [
            paragraph(_introduction(record)),
            *_rates(record),
            *_calibration(judge),
            *_operating(judge),
            *_when(judge),
            *([note(WITHOUT_RECORDINGS)] if example is None else [*_example(example), *_learned(example)]),
            *_made(record),
        ],
    )


def _introduction(record: EvaluationRecord) -> str:
    rate = record.false_alarm_rate
    return INTRODUCTION.format(
        classes="A movement was" if record.classes == 1 else f"{record.classes} movements were each",
        train=record.train,
        test=record.test,
        told=TOLD.get(record.task, f"what the task “{escape(record.task)}” says"),
        seeds="" if record.seeds == 1 else f". {record.seeds} splits were drawn and are pooled",
        asked="" if rate is None else f" The detector was asked for {percent(rate)} false alarms per execution.",
    )


def _rates(record: EvaluationRecord) -> list[str]:
    summary = record.judges[0].summary
    faults = list(summary.faults)
    parts = [heading("False alarms and detected failures"), comparison_table(record, faults[0])]
    if len(faults) > 1 or faults[0] not in failures_of(summary):
        for judge in record.judges:
            parts += [heading(judge.name, 3) if len(record.judges) > 1 else "", fault_tables(judge.summary)]
    worst = summary.worst_class
    most = f" Most false alarms: “{escape(worst.label)}”, {worst.count} of {worst.n}." if worst and worst.count else ""
    return [*parts, note(RATES_NOTE + most)]


def _calibration(judge: JudgeRecord) -> list[str]:
    if not judge.calibrations:
        return []
    parts = [heading("Is the rate of false alarms kept?"), calibration_table(judge.calibrations)]
    if not judge.realized:
        return parts
    panel = Panel("False alarms that came about", partial(plot_realized_rates, realized=judge.realized))
    return [*parts, realized_table(judge.realized), figure([panel], CALIBRATION_CAPTION)]


def _operating(judge: JudgeRecord) -> list[str]:
    panels = operating_panels(judge)
    several = ", at the thresholds for several rates of false alarms" if judge.realized else ""
    return [heading("Operating curves"), figure(panels, OPERATING_CAPTION.format(several=several))] if panels else []


def _when(judge: JudgeRecord) -> list[str]:
    panels = onset_panels(judge.summary)
    return [heading("When"), figure(panels, ONSET_CAPTION)] if panels else []


def _example(example: Example) -> list[str]:
    undisturbed, disturbed = (_said(finding) for finding in example.findings.values())
    caption = EXAMPLE_CAPTION.format(
        label=escape(example.label),
        fault=escape(example.fault),
        onset=example.onset,
        undisturbed=escape(undisturbed),
        disturbed=escape(disturbed),
    )
    return [heading("One execution"), figure(example_panels(example), caption)]


def _learned(example: Example) -> list[str]:
    rollout, bands = example.rollout, band_panels(example.rollout, range(min(len(example.rollout.names), 2)))
    panels = [panel for k in range(len(QUANTITIES)) for panel in bands[k :: len(QUANTITIES)]]
    if len(rollout.names) > 1:

        def draw(ax: "Axes") -> None:
            plot_demonstrated_paths(ax, example.training, start=rollout.positions[0])
            ax.plot(rollout.positions[:, 0], rollout.positions[:, 1], color=MEAN, linewidth=2)

        panels.append(Panel("Path", draw))
    return [heading(f"What was learned: “{example.label}”"), figure(panels, LEARNED_CAPTION)]


def _made(record: EvaluationRecord) -> list[str]:
    judge = record.judges[0]
    texts = MADE | {"Intervals": OVER_CLASSES if record.interval == BOOTSTRAP else EXACT}
    texts |= MADE_CURVES if judge.operating is not None else {}
    texts |= MADE_REALIZED if judge.realized else {}
    texts |= MADE_PAPER if any(is_papers(each.name) for each in record.judges) else {}
    command = [code(record.command)] if record.command else [note("The command was not kept.")]
    return [heading("How each number was made"), definitions(texts), heading("Make it again"), *command]


def _said(finding: Finding) -> str:
    if finding.alarm is None:
        return "fine"
    why = f", {finding.kind}: {finding.cause}" if finding.kind else ""
    better = f", looks like “{finding.better}”" if finding.better else ""
    return f"failed at {finding.alarm:.2f} s{why}{better}"
