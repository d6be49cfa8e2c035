"""Pictures of movements as planned: bands over time, the path in its tube."""

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.execution import GaussianTrajectory
from probdmp.plotting.panels import Panel
from probdmp.plotting.style import BAND, MEAN, axis_label, band, legend_beside

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "QUANTITIES",
    "band_edges",
    "band_panels",
    "ellipses",
    "evenly_spaced",
    "path_panel",
    "plot_path_tube",
    "plot_rollout",
    "tube_ellipses",
]

QUANTITIES = {
    "position": ("positions", "position_stds", ""),
    "velocity": ("velocities", "velocity_stds", "/s"),
    "acceleration": ("accelerations", "acceleration_stds", "/s²"),
}
"""What to draw: attributes of a GaussianTrajectory for mean and standard deviation, and how the unit goes on."""
TUBE_STDS = 2.0
"""Half the width of a tube in standard deviations; an ellipse of two dimensions then holds 86 %."""
MOST_ELLIPSES = 120
OUTLINED = 9


def plot_rollout(
    ax: "Axes", rollout: GaussianTrajectory, dof: int, quantity: str = "position", is_backdrop: bool = False
) -> "Axes":
    """Mean and 95 % band of one degree of freedom over time.

    Parameters
    ----------
    quantity : `"position"`, `"velocity"` or `"acceleration"`.
    is_backdrop : whether an execution will be drawn over it.
    """
    means, stds, per = QUANTITIES[quantity]
    band(ax, rollout.times, getattr(rollout, means)[:, dof], getattr(rollout, stds)[:, dof], is_backdrop)
    ax.set_xlabel("Time [s]")
    ax.set_ylabel(axis_label(f"{rollout.names[dof]} {quantity}", rollout.units, per))
    return ax


def plot_path_tube(ax: "Axes", rollout: GaussianTrajectory, covariances: FloatArray, dofs: tuple[int, int] = (0, 1)) -> "Axes":
    """Two degrees of freedom against each other: the mean path, and where executions pass, two standard deviations wide.

    Parameters
    ----------
    covariances : (T, D, D) array, data units squared, of the positions at each time.
    """
    from matplotlib.collections import PolyCollection
    from scipy.spatial import ConvexHull

    chosen = evenly_spaced(len(rollout.times), MOST_ELLIPSES)
    path = rollout.positions[:, dofs]
    hairline = (1e-3 * (float(np.ptp(path)) or 1.0)) ** 2  # a hull needs width, even where the position is known
    outlines = ellipses(path[chosen], covariances[chosen][:, dofs][..., dofs] + hairline * np.eye(2), TUBE_STDS)
    pairs = [np.concatenate(pair) for pair in pairwise(outlines)]
    hulls: list[Any] = [points[ConvexHull(points).vertices] for points in pairs]
    tube = PolyCollection(hulls, facecolor=BAND, edgecolor=BAND, linewidth=0.4, zorder=1, label="2 std, 86 % at each time")
    ax.add_collection(tube)
    for k in evenly_spaced(len(chosen), OUTLINED):
        ax.plot(*outlines[k].T, color=MEAN, linewidth=0.5, linestyle=":", zorder=2)
    ax.plot(path[:, 0], path[:, 1], color=MEAN, linewidth=2, label="mean", zorder=3)
    ax.plot(*path[0], color=MEAN, marker="o", linestyle="none", label="start", zorder=4)
    ax.plot(*path[-1], color=MEAN, marker="X", markersize=8, linestyle="none", label="goal", zorder=4)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel=axis_label(rollout.names[dofs[0]], rollout.units), ylabel=axis_label(rollout.names[dofs[1]], rollout.units))
    return ax


def evenly_spaced(count: int, most: int) -> IntArray:
    """Places of at most so many samples out of `count`, evenly spread, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(np.int64))


def ellipses(centers: FloatArray, covariances: FloatArray, n_stds: float, n_points: int = 32) -> FloatArray:
    """Outlines (M, n_points, 2) at a Mahalanobis distance of n_stds around centers (M, 2), data units."""
    angles = np.linspace(0, 2 * np.pi, n_points)
    eigenvalues, vectors = np.linalg.eigh(covariances)
    factors = vectors * np.sqrt(np.maximum(eigenvalues, 0.0))[:, None, :]
    circle = n_stds * np.stack([np.cos(angles), np.sin(angles)])
    return np.asarray(centers[:, None, :] + np.swapaxes(factors @ circle, 1, 2))


def tube_ellipses(centers: FloatArray, covariances: FloatArray, n_stds: float = TUBE_STDS) -> FloatArray:
    """Ellipses at a Mahalanobis distance of n_stds, (M, 5) array: centre x and y, both half axes, angle of the first, radians.

    Parameters
    ----------
    centers : (M, 2) array, data units.
    covariances : (M, 2, 2) array, data units squared.
    """
    eigenvalues, vectors = np.linalg.eigh(covariances)
    half_axes = n_stds * np.sqrt(np.maximum(eigenvalues, 0.0))
    return np.column_stack([centers, half_axes, np.arctan2(vectors[:, 1, 0], vectors[:, 0, 0])])


def band_edges(means: FloatArray, stds: FloatArray, n_stds: float = TUBE_STDS) -> tuple[FloatArray, FloatArray]:
    """Lower and upper edge of a band of n_stds standard deviations on either side; arrays of the same shape and unit each."""
    return means - n_stds * stds, means + n_stds * stds


def band_panels(rollout: GaussianTrajectory, dofs: Sequence[int]) -> list[Panel]:
    """Position, velocity and acceleration of each of the degrees of freedom, three in a row."""
    return [
        Panel(f"{rollout.names[dof]}: {quantity}", partial(plot_rollout, rollout=rollout, dof=dof, quantity=quantity))
        for dof in dofs
        for quantity in QUANTITIES
    ]


def path_panel(title: str, rollout: GaussianTrajectory, covariances: FloatArray, dofs: tuple[int, int] = (0, 1)) -> Panel:
    """The path in its tube, with a legend; arguments as in `plot_path_tube`."""

    def draw(ax: "Axes") -> None:
        plot_path_tube(ax, rollout, covariances, dofs)
        legend_beside(ax)

    return Panel(title, draw, 5.6, 3.6)
