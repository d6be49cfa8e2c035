"""The demo's report: one page that needs nothing else, with the paper's table and the paper's figure made from data."""

import io
from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from probdmp.evaluation import Evaluation, FaultSummary, Illustration, Rate, Summary, published_summary
from probdmp.io import write_atomically
from probdmp.plotting.failure_detection import plot_judged_execution, plot_log_likelihoods
from probdmp.plotting.style import figure_style
from probdmp.plotting.trajectories import QUANTITIES, plot_paths, plot_rollout

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_bands", "draw_failure_detection", "write_report"]

PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>probdmp report</title>
<style>
  body {{ font: 16px/1.5 system-ui, sans-serif; color: #1c1c1c; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }}
  h1 {{ font-size: 1.6rem; }} h2 {{ font-size: 1.2rem; margin-top: 2.2rem; }}
  table {{ border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .9rem; }}
  th, td {{ text-align: left; padding: .35rem .9rem .35rem 0; border-bottom: 1px solid #ddd; vertical-align: top; }}
  .wide {{ overflow-x: auto; }} figure {{ margin: 1rem 0; }} svg {{ width: 100%; height: auto; }}
  figcaption, .note {{ font-size: .9rem; color: #444; }} code {{ background: #f2f2f2; padding: .1rem .3rem; }}
</style>
<h1>Probabilistic Dynamic Movement Primitives: does it notice a failure?</h1>
<p>{classes} movements were each learned from {train} demonstrations. {test} further executions of each were judged while they
ran, once as recorded and once blocked at a random moment.</p>
<h2>The paper's table</h2>
<div class="wide"><table>
<tr><th>Forcing noise, log-likelihood<th>False alarms<th>Blocked: alarm at or after onset<th>Blocked: alarm at any time
<th>Latency, median / 95th percentile
{rows}
</table></div>
<p class="note">Counts, rates and exact 95 % intervals (Clopper–Pearson). Latency is from the onset to the alarm, in percent of
the duration of the movement. The paper leaves open whether the regression noise belongs to the forcing term
(predictive) or not (posterior), and whether it means the log-likelihood of a step or of all steps so far: all four are shown.
The rule is the paper's: failed below twice the least value over the training demonstrations.</p>
<h2>What was learned: “{label}”</h2>
<figure>{bands}<figcaption>Left: the demonstrations (grey), moved to one start, and the mean movement. Right: position,
velocity and acceleration with 95 % bands, as planned.</figcaption></figure>
<h2>One execution, as recorded and blocked</h2>
<figure>{failure}<figcaption>The learned band with an execution as recorded (solid green), the same execution blocked at
{onset:.2f} s (dashed orange), and the log-likelihood of both. Shown is the first test
execution that was judged rightly both times, if there was one. {verdict}</figcaption></figure>
<h2>Make it again</h2>
<p><code>{command}</code></p>
</html>
"""


def write_report(path: str | Path, evaluation: Evaluation, illustration: Illustration, command: str) -> None:
    """Write the page, atomically.

    Parameters
    ----------
    command : what to type to make it again.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    experiment, document = evaluation.experiment, evaluation.as_dict()
    named = [("As published", published_summary())]
    named += list(evaluation.summaries().items())
    page = PAGE.format(
        classes=document["classes"],
        train=experiment.train,
        test=experiment.test,
        rows="\n".join(_row(name, summary, illustration.fault) for name, summary in named),
        label=escape(illustration.label),
        bands=_svg(draw_bands, illustration),
        failure=_svg(draw_failure_detection, illustration),
        onset=illustration.onset,
        verdict=escape(f"Verdict on the blocked one: {illustration.disturbed.verdict}."),
        command=escape(command),
    )
    write_atomically(path, page.encode())


def draw_bands(illustration: Illustration) -> "Figure":
    """Demonstrations and bands of the first two degrees of freedom."""
    import matplotlib.pyplot as plt

    n_dof = min(illustration.primitive.n_dof, 2)
    figure, axes = plt.subplot_mosaic(
        [["path", *(f"{quantity} {dof}" for quantity in QUANTITIES)] for dof in range(n_dof)],
        figsize=(11, 2.6 * n_dof),
        layout="constrained",
    )
    if n_dof == 2:
        plot_paths(axes["path"], illustration.training, illustration.rollout)
    else:
        axes["path"].set_axis_off()
    for dof in range(n_dof):
        for quantity in QUANTITIES:
            plot_rollout(axes[f"{quantity} {dof}"], illustration.rollout, dof, quantity)
    return figure


def draw_failure_detection(illustration: Illustration) -> "Figure":
    """The paper's figure: undisturbed, disturbed, log-likelihoods; of the degree of freedom that is blamed."""
    import matplotlib.pyplot as plt

    dof = int(illustration.disturbed.verdict.contributions.argmin())
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.2), layout="constrained")
    plot_judged_execution(left, illustration, illustration.undisturbed, dof).set_title("As recorded")
    plot_judged_execution(middle, illustration, illustration.disturbed, dof).set_title(f"With the fault “{illustration.fault}”")
    plot_log_likelihoods(right, illustration).set_title("Log-likelihood")
    middle.sharey(left)
    return figure


def _svg(draw: Callable[[Illustration], "Figure"], illustration: Illustration) -> str:
    with figure_style():
        import matplotlib.pyplot as plt

        figure, text = draw(illustration), io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
        plt.close(figure)
    return text.getvalue()[text.getvalue().index("<svg") :]


def _row(name: str, summary: Summary, fault: str) -> str:
    figures = summary.faults.get(fault)
    cells = [name, _rate(summary.false_alarms)]
    cells += [_rate(figures.detected), _rate(figures.ever), _latency(figures)] if figures is not None else ["–"] * 3
    return "<tr>" + "".join(f"<td>{escape(cell)}" for cell in cells)


def _latency(figures: FaultSummary) -> str:
    if figures.latency_median is None or figures.latency_p95 is None:
        return "–"
    return f"{100 * figures.latency_median:.1f} / {100 * figures.latency_p95:.1f} %"


def _rate(rate: Rate | None) -> str:
    return "–" if rate is None else str(rate)
