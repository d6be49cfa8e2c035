"""Executions on a common grid of phases, start-aligned and in units of the movement's size: what every baseline sees.

Phase is time divided by the commanded duration, or by the mean duration of training where none is commanded. A value at a
phase is available from the first sample at or after it: nothing looks ahead.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from baselines.array_types import FloatArray, IndexArray
from probdmp import Demonstration

__all__ = ["STEP", "Alignment", "Command", "Path", "commands_for", "displacements"]

STEP = 0.01
"""Phase between grid points."""
ROUNDING = 1e-9
"""Phases that should be equal differ by this much at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Command:
    """What an execution was told."""

    start: FloatArray
    """(D,) array, data units."""
    goal: FloatArray | None = None
    """(D,) array, data units; None: as learned."""
    duration: float | None = None
    """Seconds; None: as learned."""


def commands_for(executions: Sequence[Demonstration], task: str) -> list[Command]:
    """The command of each undisturbed execution; with `"known"` goal and duration are told too, with `"nominal"` not."""
    if task == "nominal":
        return [Command(_seen(e.positions)[0]) for e in executions]
    return [Command(_seen(e.positions)[0], _seen(e.positions)[-1], e.duration) for e in executions]


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """An execution at the phases 0, 0.01, … that it reached."""

    position: FloatArray
    """(N, D) array, extents: from the commanded start."""
    to_goal: FloatArray
    """(N, D) array, extents: from the commanded goal; (N, 0) where none is commanded."""
    reached: IndexArray
    """(T,) array: last grid point available at each sample."""


@dataclass(frozen=True, slots=True)
class Alignment:
    """The units of a class."""

    extent: float
    """Mean over the training demonstrations of their largest extent along an axis, data units."""
    duration: float
    """Mean over the training demonstrations, seconds."""

    @classmethod
    def fit(cls, training: Sequence[Demonstration]) -> Self:
        """Measure the training demonstrations."""
        extents = [np.max(np.nanmax(d.positions, axis=0) - np.nanmin(d.positions, axis=0)) for d in training]
        return cls(float(np.mean(extents)), float(np.mean([d.duration for d in training])))

    def path(self, execution: Demonstration, command: Command) -> Path:
        """Resample an execution along straight lines; a missing sample repeats the one before it."""
        phases = execution.times / (command.duration or self.duration)
        reached = np.floor(phases / STEP + ROUNDING).astype(np.intp)
        grid = STEP * np.arange(reached[-1] + 1)
        positions = _filled(execution.positions)
        at_grid = np.column_stack([np.interp(grid, phases, column) for column in positions.T])
        nothing = np.empty((len(grid), 0))
        to_goal = nothing if command.goal is None else (at_grid - command.goal) / self.extent
        return Path((at_grid - command.start) / self.extent, to_goal, reached)


def displacements(positions: FloatArray, lag: int) -> FloatArray:
    """How far each point is from the one `lag` steps before, or from the first; (N, D) array to (N, D) array."""
    return positions - positions[np.maximum(np.arange(len(positions)) - lag, 0)]


def _seen(positions: FloatArray) -> FloatArray:
    return positions[~np.isnan(positions).any(axis=1)]


def _filled(positions: FloatArray) -> FloatArray:
    missing = np.isnan(positions)
    if not missing.any():
        return positions
    last = np.maximum.accumulate(np.where(missing, 0, np.arange(len(positions))[:, None]), axis=0)
    filled = np.take_along_axis(positions, last, axis=0)
    first = _seen(positions)[0]
    return np.where(np.isnan(filled), first, filled)
