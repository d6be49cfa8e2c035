"""Pictures of recorded movements."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration
from probdmp.plotting.panels import Panel
from probdmp.plotting.style import FAINT, axis_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["class_panels", "demonstration_panels", "plot_demonstrated_paths", "plot_demonstrations"]


def plot_demonstrations(ax: "Axes", demonstrations: Sequence[Demonstration], dof: int, color: str = FAINT) -> "Axes":
    """One degree of freedom of each recording over time; a gap where samples are missing."""
    for demonstration in demonstrations:
        ax.plot(demonstration.times, demonstration.positions[:, dof], color=color, linewidth=0.9)
    ax.set(xlabel="Time [s]", ylabel=axis_label(demonstrations[0].names[dof], demonstrations[0].units))
    return ax


def plot_demonstrated_paths(
    ax: "Axes",
    demonstrations: Sequence[Demonstration],
    dofs: tuple[int, int] = (0, 1),
    start: FloatArray | None = None,
    color: str = FAINT,
) -> "Axes":
    """Two degrees of freedom against each other, a dot at each start.

    Parameters
    ----------
    start : (D,) array, data units: all recordings are moved to begin there; each where it was unless given.
    """
    for demonstration in demonstrations:
        positions = demonstration.positions
        path = (positions if start is None else positions - positions[0] + start)[:, dofs]
        ax.plot(path[:, 0], path[:, 1], color=color, linewidth=0.9)
        if start is None:
            ax.plot(*path[0], color=color, marker="o", markersize=3, linestyle="none")
    first = demonstrations[0]
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel=axis_label(first.names[dofs[0]], first.units), ylabel=axis_label(first.names[dofs[1]], first.units))
    return ax


def demonstration_panels(demonstrations: Sequence[Demonstration], dofs: tuple[int, int] = (0, 1)) -> list[Panel]:
    """The recordings of one movement: their path, if they have two degrees of freedom, and each of these over time."""
    first, dark = demonstrations[0], "0.35"
    path = Panel("Path", lambda ax: plot_demonstrated_paths(ax, demonstrations, dofs, color=dark))
    each = [
        Panel(f"{name} over time", partial(plot_demonstrations, demonstrations=demonstrations, dof=dof, color=dark))
        for dof, name in enumerate(first.names)
    ]
    return [path, *each] if first.n_dof > 1 else each


def class_panels(by_label: Mapping[str, Sequence[Demonstration]], dofs: tuple[int, int] = (0, 1)) -> list[Panel]:
    """Several movements: the paths of each, or the only degree of freedom over time."""

    def draw(ax: "Axes", members: Sequence[Demonstration]) -> "Axes":
        if members[0].n_dof == 1:
            return plot_demonstrations(ax, members, 0, "0.35")
        return plot_demonstrated_paths(ax, members, dofs, color="0.35")

    titles = {label: f"“{label}”, {len(its)}" if label else f"{len(its)} recordings" for label, its in by_label.items()}
    return [Panel(titles[label], partial(draw, members=members), 2.8, 2.5) for label, members in by_label.items()]
