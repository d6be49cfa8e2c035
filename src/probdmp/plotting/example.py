"""One execution as recorded and with a fault: its path in the learned band, and the test ratio of both."""

from typing import TYPE_CHECKING

import numpy as np

from probdmp.evaluation import UNDISTURBED, Example
from probdmp.plotting.style import ALARM, FAULTY, RECORDED
from probdmp.plotting.trajectories import plot_rollout

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot_example_path", "plot_test_ratios"]


def plot_example_path(ax: "Axes", example: Example, dof: int) -> "Axes":
    """One degree of freedom of both executions over the learned band, with the onset and the alarm."""
    plot_rollout(ax, example.rollout, dof)
    for name, recording in example.recordings.items():
        color, line = (RECORDED, "-") if name == UNDISTURBED else (FAULTY, "--")
        ax.plot(recording.times, recording.positions[:, dof], color=color, linestyle=line)
    _mark_onset(ax, example)
    finding, recording = example.findings[example.fault], example.recordings[example.fault]
    if finding.alarm is not None:
        step = min(int(np.searchsorted(recording.times, finding.alarm)), recording.n_samples - 1)
        ax.plot(finding.alarm, recording.positions[step, dof], marker="v", color=ALARM, markersize=8, linestyle="none")
    return ax


def plot_test_ratios(ax: "Axes", example: Example) -> "Axes":
    """Test ratio of both executions; linear up to the threshold, 1, and logarithmic beyond."""
    ax.set_yscale("symlog", linthresh=1)
    for name, finding in example.findings.items():
        if finding.trace is not None:
            faulty = name != UNDISTURBED
            ratios = np.where(np.isfinite(finding.trace.test_ratios), finding.trace.test_ratios, np.nan)
            label, color, line = (name, FAULTY, "--") if faulty else ("as recorded", RECORDED, "-")
            ax.plot(finding.trace.times, ratios, color=color, linestyle=line, label=label)
    ax.axhline(1, color="0.2", linewidth=1, linestyle=":", label="threshold")
    _mark_onset(ax, example)
    alarm = example.findings[example.fault].alarm
    if alarm is not None:
        ax.plot(alarm, 1, marker="v", color=ALARM, markersize=8, linestyle="none", label="alarm")
    ax.set(xlabel="Time [s]", ylabel="Test ratio")
    ax.set_ylim(bottom=0)
    ticks = [0, 0.5, 1, 2, 5, 10, 20, 50, 100]
    highest = ax.get_ylim()[1]
    ax.set_yticks([tick for tick in ticks if tick <= max(highest, 1)])
    ax.yaxis.set_major_formatter("{x:g}")
    ax.minorticks_off()
    ax.legend(loc="upper left")
    return ax


def _mark_onset(ax: "Axes", example: Example) -> None:
    ax.axvline(example.onset, color="0.6", linewidth=1, label="onset")
