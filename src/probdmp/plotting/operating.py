"""Pictures of an evaluation: what is detected at which price, how soon, and whether the rate of false alarms is kept."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from probdmp.demonstrations import FAILURE
from probdmp.evaluation import JudgeRecord, OperatingCurves, RealizedRate, Summary
from probdmp.plotting.panels import Panel
from probdmp.plotting.style import MEAN, RECORDED, legend_beside, series

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "failures_of",
    "onset_panels",
    "operating_panels",
    "plot_by_onset",
    "plot_latencies",
    "plot_operating_curve",
    "plot_realized_rates",
    "plot_soon_enough",
]


ASIDE = 0.7
"""Percent of the movement."""


def failures_of(summary: Summary) -> list[str]:
    """Names of the faults that are failures of the movement."""
    return [name for name, figures in summary.faults.items() if figures.nature == FAILURE]


def plot_operating_curve(ax: "Axes", curves: OperatingCurves, summary: Summary) -> "Axes":
    """Detection against realised false alarms, a line for each failure; crosses where the threshold lies."""
    for k, (fault, shares) in enumerate(curves.detected.items()):
        ax.plot(100 * np.array(curves.false_alarms), 100 * np.array(shares), label=fault, **series(k))
        detected = summary.faults[fault].detected
        if detected is not None:
            here = 100 * summary.false_alarms.rate, 100 * detected.rate
            ax.plot(*here, marker="X", markersize=8, color=series(k)["color"], linestyle="none", clip_on=False)
    ax.set(xlabel="False alarms [% of executions]", ylabel="Detected [%]")
    ax.set_xlim(0, max(5.0, 100 * max(curves.false_alarms, default=0.0), 105 * summary.false_alarms.rate))
    _from_a_round_number(ax)
    _legend(ax)
    return ax


def plot_soon_enough(ax: "Axes", curves: OperatingCurves, fault: str) -> "Axes":
    """Share detected within a time since the onset, at the thresholds for several rates of false alarms."""
    for k, one in enumerate(curves.promptness):
        name = "as set" if one.nominal is None else f"α = {100 * one.nominal:g} %"
        ax.plot(100 * np.array(curves.latencies), 100 * np.array(one.detected[fault]), label=name, **series(k))
    ax.set(xlabel="Time since the onset [% of the duration]", ylabel="Detected so far [%]", ylim=(0, 101))
    ax.set_xlim(0, 100 * max(curves.latencies, default=1.0))
    ax.legend(loc="lower right")
    return ax


def plot_by_onset(ax: "Axes", summary: Summary) -> "Axes":
    """Detection by when the failure begins, in percent of the movement; marks stand a little aside, so that none is hidden."""
    failures = failures_of(summary)
    for k, fault in enumerate(failures):
        bins, aside = summary.faults[fault].by_onset, ASIDE * (k - (len(failures) - 1) / 2)
        middles = [50 * (one.begin + one.end) + aside for one in bins]
        shares = [100 * one.detected / one.n if one.n else np.nan for one in bins]
        if bins:
            ax.plot(middles, shares, label=fault, **series(k, always_marked=True))
    ax.set(xlabel="Onset [% of the duration]", ylabel="Detected [%]", xlim=(30, 70))
    _from_a_round_number(ax)
    _legend(ax)
    return ax


def plot_latencies(ax: "Axes", summary: Summary) -> "Axes":
    """Latency of each failure: a line from the 10th to the 90th percentile, a dot at the median, a tick at the 95th."""
    names = [name for name in failures_of(summary) if summary.faults[name].latency_deciles is not None]
    for row, name in enumerate(names):
        figures = summary.faults[name]
        deciles, median, p95 = figures.latency_deciles, figures.latency_median, figures.latency_p95
        if not deciles or median is None or p95 is None:
            continue
        ax.plot([100 * deciles[0], 100 * deciles[-1]], [row, row], color=MEAN)
        ax.plot(100 * median, row, marker="o", color=MEAN)
        ax.plot(100 * p95, row, marker="|", markersize=10, color=MEAN)
    ax.set_yticks(range(len(names)), names)
    ax.set(xlabel="Latency [% of the duration]", ylim=(len(names) - 0.5, -0.5))
    ax.set_xlim(left=min(0.0, ax.get_xlim()[0]))
    return ax


def plot_realized_rates(ax: "Axes", realized: Sequence[RealizedRate]) -> "Axes":
    """False alarms that came about against those that were asked for, with the limits of chance."""
    nominal = [100 * one.nominal for one in realized]
    rates = np.array([[one.realized.rate, one.realized.low, one.realized.high] for one in realized]) * 100
    ax.fill_between(
        nominal, [100 * one.low for one in realized], [100 * one.high for one in realized],
        color="0.85", linewidth=0, label="limits of chance, one split",
    )  # fmt: skip
    ax.plot([0, nominal[-1]], [0, nominal[-1]], color="0.5", linewidth=1, linestyle=":", label="as asked for")
    errors = [rates[:, 0] - rates[:, 1], rates[:, 2] - rates[:, 0]]
    ax.errorbar(nominal, rates[:, 0], errors, color=RECORDED, marker="o", linestyle="none", capsize=3, label="realised, 95 %")
    ax.set(xlabel="α, asked for [% of executions]", ylabel="False alarms [%]")
    ax.set_xlim(left=0)
    ax.set_ylim(0, 1.4 * ax.get_ylim()[1])  # room for the legend
    ax.legend(loc="upper left")
    return ax


def _from_a_round_number(ax: "Axes") -> None:
    """Percentages from the multiple of twenty below them, 80 at the most, to 100."""
    heights = [np.asarray(line.get_ydata(), dtype=float) for line in ax.lines]
    lowest = min((float(np.nanmin(values)) for values in heights if np.isfinite(values).any()), default=0.0)
    bottom = min(80.0, 20.0 * (lowest // 20))
    ax.set_yticks(np.arange(bottom, 101, 5 if bottom == 80 else 20))
    ax.set_ylim(bottom, 101)


def _legend(ax: "Axes") -> None:
    """Beside the lines if there are many."""
    if len(ax.get_legend_handles_labels()[0]) > 3:
        legend_beside(ax)
    elif ax.get_legend_handles_labels()[0]:
        ax.legend(loc="lower right")


def operating_panels(judge: JudgeRecord) -> list[Panel]:
    """What is detected at which price, and how soon each failure is; nothing without traces."""
    curves = judge.operating
    if curves is None or not curves.detected:
        return []
    price = Panel("At what price", partial(plot_operating_curve, curves=curves, summary=judge.summary))
    return [price, *(Panel(f"How soon: “{f}”", partial(plot_soon_enough, curves=curves, fault=f)) for f in curves.detected)]


def onset_panels(summary: Summary) -> list[Panel]:
    """Detection by onset, and latencies; nothing without failures."""
    failures = failures_of(summary)
    if not failures:
        return []
    by_onset = (
        [Panel("By onset", partial(plot_by_onset, summary=summary))]
        if any(summary.faults[name].by_onset for name in failures)
        else []
    )
    height = max(2.9, 1.2 + 0.25 * len(failures))
    return [*by_onset, Panel("Latency", partial(plot_latencies, summary=summary), height=height)]
