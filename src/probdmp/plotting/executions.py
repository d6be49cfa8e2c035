"""Pictures of a recorded execution: as the filter sees it while it runs, and as it looks in hindsight."""

from functools import partial
from typing import TYPE_CHECKING

from probdmp.demonstrations import Demonstration
from probdmp.execution import GaussianTrajectory
from probdmp.execution.trajectory import HALF_BAND
from probdmp.plotting.panels import Panel
from probdmp.plotting.style import BAND, FAULTY, MEAN, axis_label
from probdmp.plotting.trajectories import QUANTITIES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot_filtered_and_smoothed", "plot_uncertainties", "smoothing_panels"]

FILTERED_BAND = "#e9a184"


def plot_filtered_and_smoothed(
    ax: "Axes", filtered: GaussianTrajectory, smoothed: GaussianTrajectory, dof: int, quantity: str = "position"
) -> "Axes":
    """Means and 95 % bands of one degree of freedom, of the filter (dashed) and the smoother (solid).

    Parameters
    ----------
    quantity : `"position"`, `"velocity"` or `"acceleration"`.
    """
    means, stds, per = QUANTITIES[quantity]
    for trajectory, name, color, shade, line in (
        (filtered, "filtered", FAULTY, FILTERED_BAND, "--"),
        (smoothed, "smoothed", MEAN, BAND, "-"),
    ):
        mean, half = getattr(trajectory, means)[:, dof], HALF_BAND * getattr(trajectory, stds)[:, dof]
        ax.fill_between(trajectory.times, mean - half, mean + half, color=shade, alpha=0.55, linewidth=0)
        ax.plot(trajectory.times, mean, color=color, linestyle=line, linewidth=1.2, label=f"{name}, 95 %")
    ax.set(xlabel="Time [s]", ylabel=axis_label(f"{smoothed.names[dof]} {quantity}", smoothed.units, per))
    return ax


def plot_uncertainties(ax: "Axes", filtered: GaussianTrajectory, smoothed: GaussianTrajectory, dof: int) -> "Axes":
    """Standard deviation of the position of one degree of freedom, of the filter and the smoother."""
    for trajectory, name, color, line in ((filtered, "filtered", FAULTY, "--"), (smoothed, "smoothed", MEAN, "-")):
        ax.plot(trajectory.times, trajectory.position_stds[:, dof], color=color, linestyle=line, label=name)
    ax.set(xlabel="Time [s]", ylabel=axis_label(f"{smoothed.names[dof]} position, std", smoothed.units))
    ax.set_ylim(bottom=0)
    return ax


def smoothing_panels(recording: Demonstration, filtered: GaussianTrajectory, smoothed: GaussianTrajectory) -> list[Panel]:
    """Position with what was measured, velocity, and uncertainty of each degree of freedom, three in a row."""

    def draw_positions(ax: "Axes", dof: int) -> None:
        plot_filtered_and_smoothed(ax, filtered, smoothed, dof)
        measured = recording.positions[:, dof]
        ax.plot(recording.times, measured, color="0.2", marker=".", markersize=2, linestyle="none", label="measured")
        if dof == 0:
            ax.legend(loc="best")

    panels = []
    for dof, name in enumerate(smoothed.names):
        velocity = partial(plot_filtered_and_smoothed, filtered=filtered, smoothed=smoothed, dof=dof, quantity="velocity")
        uncertainty = partial(plot_uncertainties, filtered=filtered, smoothed=smoothed, dof=dof)
        panels += [
            Panel(f"{name}: position", partial(draw_positions, dof=dof)),
            Panel(f"{name}: velocity", velocity),
            Panel(f"{name}: uncertainty", uncertainty),
        ]
    return panels
