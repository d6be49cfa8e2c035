"""Pictures of what a movement is made of: phase, basis functions, forcing term."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from probdmp.dmp import Primitive
from probdmp.dmp.basis import basis_features
from probdmp.dmp.forcing_term import forcing_term
from probdmp.dmp.phase import phases_at
from probdmp.execution.trajectory import HALF_BAND
from probdmp.plotting.panels import Panel
from probdmp.plotting.style import BAND, MEAN, SERIES, WIDER_BAND, axis_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["basis_panels", "forcing_panels", "plot_basis", "plot_forcing", "plot_phase"]

N_TIMES = 401
VISIBLE = 0.02
"""A larger variance by less than this fraction looks the same."""


def plot_phase(ax: "Axes", duration: float) -> "Axes":
    """The phase over the time of a movement, with its value at the end.

    Parameters
    ----------
    duration : seconds.
    """
    times = np.linspace(0.0, duration, N_TIMES)
    phases = phases_at(times, duration)
    ax.plot(times, phases, color=MEAN)
    ax.plot(duration, phases[-1], color=MEAN, marker="o", linestyle="none", clip_on=False)
    ax.annotate(
        f"{phases[-1]:.2g} at the end", (duration, phases[-1]), (-4, 8), textcoords="offset points", ha="right", fontsize=8
    )
    ax.set(xlabel="Time [s]", ylabel="Phase x", ylim=(0, 1.02), xlim=(0, duration))
    return ax


def plot_basis(ax: "Axes", n_basis: int, duration: float) -> "Axes":
    """The basis functions of the forcing term over time; together they are the phase.

    Parameters
    ----------
    n_basis : N.
    duration : seconds.
    """
    times = np.linspace(0.0, duration, N_TIMES)
    phases = phases_at(times, duration)
    for k, feature in enumerate(basis_features(phases, n_basis).T):
        ax.plot(times, feature, color=SERIES[k % 2], linestyle=("-", "--")[k % 2], linewidth=0.9)
    ax.plot(times, phases, color="0.55", linestyle=":", label="their sum, the phase x")
    ax.set(xlabel="Time [s]", ylabel="Basis functions φ", ylim=(0, 1.02), xlim=(0, duration))
    ax.legend(loc="upper right")
    return ax


def plot_forcing(ax: "Axes", primitive: Primitive, dof: int) -> "Axes":
    """Mean of the forcing term of one degree of freedom over time, and its 95 % bands: by the weights alone, and in all."""
    times = np.linspace(0.0, primitive.duration, N_TIMES)
    phases = phases_at(times, primitive.duration)
    means, variances = (values[:, dof] for values in forcing_term(primitive, phases))
    features = basis_features(phases, primitive.configuration.n_basis)
    of_weights = np.einsum("ti,ij,tj->t", features, primitive.weight_covariances[dof], features)
    bands = [(of_weights, BAND, "95 %, by its weights")]
    if np.any(variances > (1 + VISIBLE) * of_weights):
        bands.insert(0, (variances, WIDER_BAND, "95 %, with its noise"))
    for values, color, label in bands:
        half = HALF_BAND * np.sqrt(np.maximum(values, 0.0))
        ax.fill_between(times, means - half, means + half, color=color, linewidth=0, label=label)
    ax.plot(times, means, color=MEAN, label="mean")
    ax.axhline(0, color="0.6", linewidth=0.6, linestyle=":")
    ax.set(
        xlabel="Time [s]", ylabel=axis_label(f"Forcing term of {primitive.names[dof]}", primitive.units), xlim=(0, times[-1])
    )
    return ax


def basis_panels(primitive: Primitive) -> list[Panel]:
    """Phase and basis functions of a primitive."""
    n_basis, duration = primitive.configuration.n_basis, primitive.duration
    return [
        Panel("Phase", partial(plot_phase, duration=duration)),
        Panel(f"{n_basis} basis functions", partial(plot_basis, n_basis=n_basis, duration=duration)),
    ]


def forcing_panels(primitive: Primitive) -> list[Panel]:
    """The forcing term of each degree of freedom."""

    def draw(ax: "Axes", dof: int) -> None:
        plot_forcing(ax, primitive, dof)
        if dof == 0:
            ax.legend(loc="best")

    return [Panel(name, partial(draw, dof=dof)) for dof, name in enumerate(primitive.names)]
