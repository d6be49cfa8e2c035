"""Pictures of an execution under the eyes of a detector: log-likelihood, test ratio, threshold, onset, verdict."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from probdmp.checks import FloatArray
from probdmp.evaluation import JudgedExecution
from probdmp.execution import GaussianTrajectory
from probdmp.plotting.panels import Panel
from probdmp.plotting.style import ALARM, FAULTY, RECORDED, legend_beside, mark_onset
from probdmp.plotting.trajectories import plot_rollout

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "Curve",
    "mark_alarm",
    "monitoring_panels",
    "plot_log_likelihoods",
    "plot_monitored_position",
    "plot_test_ratios",
]

RATIO_TICKS = (0, 0.5, 1, 2, 5, 10, 20, 50, 100, 1000, 10_000, 100_000, 1_000_000)
THRESHOLD: dict[str, Any] = {"color": "0.2", "linewidth": 1, "linestyle": ":", "label": "threshold"}


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A statistic of one execution."""

    label: str
    times: FloatArray
    """(T,) array, seconds."""
    values: FloatArray
    """(T,) array; what is not finite is left out."""
    is_faulty: bool = False

    def draw(self, ax: "Axes") -> None:
        """Solid as recorded, dashed with a fault."""
        color, line = (FAULTY, "--") if self.is_faulty else (RECORDED, "-")
        finite = np.where(np.isfinite(self.values), self.values, np.nan)
        ax.plot(self.times, finite, color=color, linestyle=line, label=self.label)


def plot_log_likelihoods(ax: "Axes", curves: Sequence[Curve], level: float | None = None, onset: float | None = None) -> "Axes":
    """Log-likelihoods over time; the axis is linear near zero and logarithmic beyond: failures fall by orders of magnitude.

    Parameters
    ----------
    level : nats, below which an execution has failed, if the rule goes by it.
    onset : seconds, if a fault began.
    """
    ax.set_yscale("symlog", linthresh=10)
    for curve in curves:
        curve.draw(ax)
    if level is not None:
        ax.axhline(level, **THRESHOLD)
    mark_onset(ax, onset)
    ax.set(xlabel="Time [s]", ylabel="Log-likelihood per step [nats]")
    ax.yaxis.set_major_formatter("{x:g}")
    ax.minorticks_off()
    return ax


def plot_test_ratios(ax: "Axes", curves: Sequence[Curve], onset: float | None = None) -> "Axes":
    """Test ratios over time; linear up to the threshold, 1, and logarithmic beyond.

    Parameters
    ----------
    onset : seconds, if a fault began.
    """
    ax.set_yscale("symlog", linthresh=1)
    for curve in curves:
        curve.draw(ax)
    ax.axhline(1, **THRESHOLD)
    mark_onset(ax, onset)
    ax.set(xlabel="Time [s]", ylabel="Test ratio")
    ax.set_ylim(0, max(1.2, ax.get_ylim()[1]))
    ax.set_yticks([tick for tick in RATIO_TICKS if tick <= ax.get_ylim()[1]])
    ax.yaxis.set_major_formatter("{x:g}")
    ax.minorticks_off()
    return ax


def mark_alarm(ax: "Axes", time: float | None, height: float) -> None:
    """A mark where an alarm was raised, if it was."""
    if time is not None:
        ax.plot(time, height, marker="v", color=ALARM, markersize=8, linestyle="none", label="alarm")


def plot_monitored_position(
    ax: "Axes", rollout: GaussianTrajectory, judged: JudgedExecution, dof: int, onset: float | None = None
) -> "Axes":
    """One degree of freedom of an execution over the learned band, with the onset of a fault and the alarm, if there were."""
    plot_rollout(ax, rollout, dof, is_backdrop=True)
    recording, verdict = judged.recording, judged.verdict
    Curve("execution", recording.times, recording.positions[:, dof]).draw(ax)
    mark_onset(ax, onset)
    if verdict.failed:
        here = float(recording.positions[min(verdict.step, recording.n_samples - 1), dof])
        planned = float(np.interp(verdict.time, rollout.times, rollout.positions[:, dof]))
        mark_alarm(ax, verdict.time, here if np.isfinite(here) else planned)
    return ax


def monitoring_panels(rollout: GaussianTrajectory, judged: JudgedExecution, onset: float | None = None) -> list[Panel]:
    """Each degree of freedom, then the log-likelihood, then the test ratio."""
    times, verdict = judged.recording.times, judged.verdict
    alarm = verdict.time if verdict.failed else None

    def draw_position(ax: "Axes", dof: int) -> None:
        plot_monitored_position(ax, rollout, judged, dof, onset)
        if dof == 0:
            ax.legend(loc="best")

    def draw_ratios(ax: "Axes") -> None:
        plot_test_ratios(ax, [Curve("execution", times, judged.test_ratios)], onset)
        mark_alarm(ax, alarm, 1.0)
        ax.legend(loc="best")

    def draw_likelihoods(ax: "Axes") -> None:
        plot_log_likelihoods(ax, [Curve("execution", times, judged.statistic)], judged.level, onset)
        if judged.level is not None:
            legend_beside(ax)

    return [
        *(Panel(name, partial(draw_position, dof=dof)) for dof, name in enumerate(rollout.names)),
        Panel("Log-likelihood", draw_likelihoods),
        Panel("Test ratio", draw_ratios),
    ]
