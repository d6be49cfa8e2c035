"""Pictures of an evaluation: what is detected at which price, how soon, and whether the rate of false alarms is kept."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from probdmp.demonstrations import FAILURE
from probdmp.evaluation import Outcome, RealizedRate, Summary, at_level, detected_within, summarize
from probdmp.evaluation.operating import level_realizing
from probdmp.plotting.style import MEAN, RECORDED, series

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["failures_of", "plot_by_onset", "plot_latencies", "plot_operating_curve", "plot_realized_rates", "plot_soon_enough"]

LARGEST_RATE = 0.2
LATENCIES = np.linspace(0.0, 0.4, 81)


def failures_of(summary: Summary) -> list[str]:
    """Names of the faults that are failures of the movement."""
    return [name for name, figures in summary.faults.items() if figures.nature == FAILURE]


def plot_operating_curve(ax: "Axes", outcomes: Sequence[Outcome], summary: Summary) -> "Axes":
    """Detection against realised false alarms, a line for each failure; dots where the threshold lies.

    Parameters
    ----------
    outcomes : with traces, of one judge.
    summary : of the same outcomes.
    """
    allowed = range(int(LARGEST_RATE * len(outcomes)) + 1)
    steps = sorted({round(k) for k in np.linspace(0, len(allowed) - 1, 41)})
    at = [summarize(at_level(outcomes, level_realizing(outcomes, k / len(outcomes)))) for k in steps]
    for k, fault in enumerate(failures_of(summary)):
        rates = [figures.detected.rate for s in at if (figures := s.faults[fault]).detected is not None]
        ax.plot([100 * s.false_alarms.rate for s in at], [100 * rate for rate in rates], label=fault, **series(k))
        detected = summary.faults[fault].detected
        if detected is not None:
            here = 100 * summary.false_alarms.rate, 100 * detected.rate
            ax.plot(*here, marker="o", color=series(k)["color"], clip_on=False)
    ax.set(xlabel="False alarms [% of executions]", ylabel="Detected [%]", xlim=(0, 100 * LARGEST_RATE))
    _from_a_round_number(ax)
    _legend_beside(ax)
    return ax


def plot_soon_enough(ax: "Axes", outcomes: Sequence[Outcome], realized: Sequence[RealizedRate], fault: str) -> "Axes":
    """Share detected within a time, at the thresholds for several rates of false alarms.

    Parameters
    ----------
    realized : thresholds; the one in force if there are none.
    """
    levels = {f"α = {100 * one.nominal:g} %": one.level for one in realized} or {"as set": 1.0}
    for k, (name, level) in enumerate(levels.items()):
        shares = detected_within(at_level(outcomes, level), fault, list(LATENCIES))
        ax.plot(100 * LATENCIES, 100 * np.array(shares), label=name, **series(k))
    ax.set(xlabel="Time since the onset [% of the duration]", ylabel="Detected so far [%]", ylim=(0, 101), xlim=(0, 40))
    ax.legend(loc="lower right")
    return ax


def plot_by_onset(ax: "Axes", summary: Summary) -> "Axes":
    """Detection by when the failure begins."""
    for k, fault in enumerate(failures_of(summary)):
        bins = summary.faults[fault].by_onset
        middles = [50 * (one.begin + one.end) for one in bins]
        shares = [100 * one.detected / one.n if one.n else np.nan for one in bins]
        if bins:
            ax.plot(middles, shares, marker=".", label=fault, **series(k))
    ax.set(xlabel="Onset [% of the duration]", ylabel="Detected [%]", xlim=(30, 70))
    _from_a_round_number(ax)
    _legend_beside(ax)
    return ax


def plot_latencies(ax: "Axes", summary: Summary) -> "Axes":
    """Latency of each failure: a line from the 10th to the 90th percentile, a dot at the median, a tick at the 95th."""
    names = [name for name in failures_of(summary) if summary.faults[name].latency_deciles is not None]
    for row, name in enumerate(names):
        figures = summary.faults[name]
        deciles, median, p95 = figures.latency_deciles, figures.latency_median, figures.latency_p95
        if deciles is None or median is None or p95 is None:
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
    ax.plot([0, nominal[-1]], [0, nominal[-1]], color="0.5", linewidth=1, linestyle=":")
    errors = [rates[:, 0] - rates[:, 1], rates[:, 2] - rates[:, 0]]
    ax.errorbar(nominal, rates[:, 0], errors, color=RECORDED, marker="o", linestyle="none", capsize=3, label="realised, 95 %")
    ax.set(xlabel="α, asked for [% of executions]", ylabel="False alarms [%]")
    ax.set_xlim(left=0)
    ax.set_ylim(bottom=0)
    ax.legend(loc="upper left")
    return ax


def _from_a_round_number(ax: "Axes") -> None:
    """Percentages from the multiple of twenty below them, 80 at the most, to 100."""
    heights = [np.asarray(line.get_ydata(), dtype=float) for line in ax.lines]
    lowest = min((float(np.nanmin(values)) for values in heights if values.size), default=0.0)
    ax.set_ylim(min(80.0, 20.0 * (lowest // 20)), 101)


def _legend_beside(ax: "Axes") -> None:
    """Where no line runs."""
    ax.legend(loc="upper left", bbox_to_anchor=(1, 1))
