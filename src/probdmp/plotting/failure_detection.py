"""The paper's figure: an execution as recorded, the same one blocked, and the log-likelihood of both."""

from typing import TYPE_CHECKING

import numpy as np

from probdmp.evaluation import Illustration
from probdmp.evaluation.illustration import JudgedExecution
from probdmp.plotting.style import ALARM, FAULTY, RECORDED
from probdmp.plotting.trajectories import plot_rollout

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_failure_detection", "plot_judged_execution", "plot_log_likelihoods"]


def plot_judged_execution(ax: "Axes", illustration: Illustration, judged: JudgedExecution, dof: int) -> "Axes":
    """One degree of freedom of an execution over the learned band, with its alarm if there was one."""
    plot_rollout(ax, illustration.rollout, dof)
    faulty = judged is illustration.disturbed
    times, values = judged.recording.times, judged.recording.positions[:, dof]
    ax.plot(times, values, color=FAULTY if faulty else RECORDED, linestyle="--" if faulty else "-")
    if judged.verdict.failed:
        step = judged.verdict.step
        ax.plot(times[step], values[step], marker="v", color=ALARM, markersize=8, linestyle="none")
    return ax


def plot_log_likelihoods(ax: "Axes", illustration: Illustration) -> "Axes":
    """Log-likelihood of both executions over time, with the threshold and the onset of the fault.

    The axis is linear near zero and logarithmic beyond: a blocked movement falls by orders of magnitude.
    """
    ax.set_yscale("symlog", linthresh=10)
    for judged, color, line, name in (
        (illustration.undisturbed, RECORDED, "-", "as recorded"),
        (illustration.disturbed, FAULTY, "--", illustration.fault),
    ):
        finite = np.where(np.isfinite(judged.statistic), judged.statistic, np.nan)
        ax.plot(judged.recording.times, finite, color=color, linestyle=line, label=name)
    ax.axhline(illustration.level, color="0.2", linewidth=1, linestyle=":", label="threshold")
    ax.axvline(illustration.onset, color="0.6", linewidth=1, label="onset")
    if illustration.disturbed.verdict.failed:
        verdict = illustration.disturbed.verdict
        value = illustration.disturbed.statistic[verdict.step]
        ax.plot(verdict.time, value, marker="v", color=ALARM, markersize=8, linestyle="none", label="alarm")
    ax.set_xlabel("Time [s]")
    ax.set_ylabel("Log-likelihood per step [nats]")
    ax.legend(loc="best")
    return ax


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
