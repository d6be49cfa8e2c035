"""Pictures of movements: demonstrations, rollouts with their bands, paths."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from probdmp.demonstrations import Demonstration
from probdmp.execution import GaussianTrajectory
from probdmp.plotting.style import MEAN, band

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_bands", "plot_paths", "plot_rollout"]

QUANTITIES = {
    "position": ("positions", "position_stds", ""),
    "velocity": ("velocities", "velocity_stds", "/s"),
    "acceleration": ("accelerations", "acceleration_stds", "/s²"),
}
"""What to draw: attributes of a GaussianTrajectory for mean and standard deviation, and how the unit goes on."""


def plot_rollout(ax: "Axes", rollout: GaussianTrajectory, dof: int, quantity: str = "position") -> "Axes":
    """Mean and 95 % band of one degree of freedom over time.

    Parameters
    ----------
    quantity : `"position"`, `"velocity"` or `"acceleration"`.
    """
    means, stds, per = QUANTITIES[quantity]
    band(ax, rollout.times, getattr(rollout, means)[:, dof], getattr(rollout, stds)[:, dof], "95 % band")
    ax.set_xlabel("Time [s]")
    ax.set_ylabel(f"{rollout.names[dof]} {quantity} [{rollout.units or '–'}{per}]")
    return ax


def plot_paths(ax: "Axes", demonstrations: Sequence[Demonstration], rollout: GaussianTrajectory) -> "Axes":
    """Demonstrations and the mean rollout in the plane of the first two degrees of freedom, all from one start."""
    for demonstration in demonstrations:
        path = demonstration.positions - demonstration.positions[0] + rollout.positions[0]
        ax.plot(path[:, 0], path[:, 1], color="0.65", linewidth=0.8)
    ax.plot(rollout.positions[:, 0], rollout.positions[:, 1], color=MEAN, linewidth=2)
    ax.set_aspect("equal")
    ax.set_xlabel(f"{rollout.names[0]} [{rollout.units or '–'}]")
    ax.set_ylabel(f"{rollout.names[1]} [{rollout.units or '–'}]")
    return ax


def draw_bands(demonstrations: Sequence[Demonstration], rollout: GaussianTrajectory) -> "Figure":
    """Demonstrations and bands of the first two degrees of freedom."""
    import matplotlib.pyplot as plt

    n_dof = min(len(rollout.names), 2)
    figure, axes = plt.subplot_mosaic(
        [["path", *(f"{quantity} {dof}" for quantity in QUANTITIES)] for dof in range(n_dof)],
        figsize=(11, 2.6 * n_dof),
        layout="constrained",
    )
    if n_dof == 2:
        plot_paths(axes["path"], demonstrations, rollout)
    else:
        axes["path"].set_axis_off()
    for dof in range(n_dof):
        for quantity in QUANTITIES:
            plot_rollout(axes[f"{quantity} {dof}"], rollout, dof, quantity)
    return figure
