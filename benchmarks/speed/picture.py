"""Cost against N, T and D."""

from collections.abc import Iterable
from functools import partial
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from peers.system import systems_of
from probdmp.plotting.style import figure_style, series
from speed.execution_rows import STEPPED, our_stepper, peer_stepped, stepped
from speed.filter_rows import ENOUGH, OURS, TWIN, score_contestants
from speed.interleaving import Clocked
from speed.rows import raced
from speed.twin import Twin
from speed.workload import N_STEPS, model_of, recordings_of

__all__ = ["draw_costs", "measured_costs"]

SHOWN = (OURS, TWIN, "dynamax", "simdkalman", "statsmodels", "filterpy")
"""In the order of colours, which the panels share."""
N_SERIES = 1_000
SERIES_COUNTS = (1, 10, 100, 1_000, 10_000, 100_000)
LENGTHS = (20, 50, 200, 1_000)
DIMENSIONS = (1, 2, 7, 30)
TICKS = 100
LARGEST = {"simdkalman": 10_000}
"""Series beyond which a package is not asked."""

Costs = dict[str, dict[int, float]]
"""Seconds, by name and by what they are drawn against."""


def measured_costs(twin: Twin, rounds: int) -> dict[str, Costs]:
    """By panel."""
    against_n = ((n, ("letter", N_STEPS, 1), n) for n in SERIES_COUNTS)
    against_t = ((t, ("letter", t, 1), N_SERIES) for t in LENGTHS)
    return {
        "N, series": _scoring(against_n, twin, rounds),
        "T, samples": _scoring(against_t, twin, rounds),
        "D, degrees of freedom": _scoring_dimensions(twin, rounds),
        "D, degrees of freedom, online": _stepping(rounds),
    }


def draw_costs(costs: dict[str, Costs], path: Path) -> None:
    """The picture."""
    titles = (f"T = {N_STEPS}, D = 1", f"N = {N_SERIES:,}, D = 1", f"N = {N_SERIES:,}, T = {N_STEPS}", "One online step")
    with figure_style():
        figure, axes = plt.subplots(1, 4, figsize=(11, 3.4), layout="constrained")
        for ax, (label, panel), title in zip(axes, costs.items(), titles, strict=True):
            is_online = label.endswith("online")
            _lines(ax, panel, 1e6 if is_online else 1e9)
            ax.set(xscale="log", yscale="log", xlabel=label.removesuffix(", online"), title=title)
            ax.set_ylabel("µs per step" if is_online else "ns per step, series and DoF")
            _label_decades(ax, next(iter(panel.values())))
        handles = {label: line for ax in axes for line, label in zip(*ax.get_legend_handles_labels(), strict=True)}
        figure.legend(
            [handles[name] for name in SHOWN if name in handles],
            [n for n in SHOWN if n in handles],
            loc="outside lower center",
            ncols=6,
        )
        figure.savefig(path, dpi=150)
        plt.close(figure)


def _label_decades(ax: Axes, measured_at: Iterable[int]) -> None:
    """Powers of ten as plain numbers; along x what was measured."""
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.10g}"))
    ax.set_xticks(list(measured_at), [f"{x / 1000:g}k" if x >= 1000 else str(x) for x in measured_at])
    ax.minorticks_off()


def _lines(ax: Axes, panel: Costs, factor: float) -> None:
    for k, name in enumerate(SHOWN):
        if name in panel:
            x = np.array(list(panel[name]))
            ax.plot(x, factor * np.array(list(panel[name].values())), label=name, **series(k, always_marked=True))


def _scoring(points: Iterable[tuple[int, tuple[str, int, int], int]], twin: Twin, rounds: int) -> Costs:
    costs: Costs = {}
    for x, workload, n_series in points:
        contestants = {
            name: run
            for name, run in score_contestants(workload, n_series, twin).items()
            if name in SHOWN and n_series <= LARGEST.get(name, n_series)
        }
        times = raced(contestants, rounds)
        for name in times:
            scored = min(n_series, ENOUGH.get(name, n_series))
            costs.setdefault(name, {})[x] = times.typical(name) / (scored * workload[1] * workload[2])
    return costs


def _scoring_dimensions(twin: Twin, rounds: int) -> Costs:
    """This library alone: others score one degree of freedom after the other."""
    costs: Costs = {}
    for n_dof in DIMENSIONS:
        workload = ("body", N_STEPS, n_dof)
        times = raced(score_contestants(workload, N_SERIES, twin, ours_only=True), rounds)
        for name in times:
            costs.setdefault(name, {})[n_dof] = times.typical(name) / (N_SERIES * N_STEPS * n_dof)
    return costs


def _stepping(rounds: int) -> Costs:
    """`step()` of the three movements, and of packages on the same systems."""
    costs: Costs = {}
    for movement in ("letter", "arm", "body"):
        model = model_of(movement)
        (n_dof,) = model.batch_shape
        systems, observations = systems_of(model), recordings_of(model, 1)[0][:TICKS]
        contestants: dict[str, Clocked | None] = {OURS: stepped(partial(our_stepper, movement), observations)}
        for name in STEPPED:
            contestants[name] = peer_stepped(name, systems, observations)
        times = raced(contestants, rounds)
        for name in times:
            costs.setdefault(name, {})[n_dof] = times.typical(name) / TICKS
    return costs
