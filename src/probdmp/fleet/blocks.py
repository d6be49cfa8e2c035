"""Executions that can be judged side by side: of one primitive, equally long, at one rate."""

from collections.abc import Iterator

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.dmp import Primitive, Task
from probdmp.io import ExecutionTable

__all__ = ["alike", "tasks_of"]

MOST_SAMPLES = 2**19
"""Of the executions of a block together: what a few thousand short ones have."""


DIGITS = 2.0**40


def alike(table: ExecutionTable, owners: IntArray) -> Iterator[IntArray]:
    """Places of executions that make a block, increasing, block by block.

    Parameters
    ----------
    owners : (N,) array: which primitive each is of; -1 where it is not to be judged.
    """
    lengths, steps = np.diff(table.offsets), _rounded(table.steps)
    chosen = np.flatnonzero(owners >= 0)
    if not len(chosen):
        return
    keys = (lengths[chosen], steps[chosen], owners[chosen])
    order = chosen[np.lexsort(keys)]
    differ = np.logical_or.reduce([key[order][1:] != key[order][:-1] for key in (lengths, steps, owners)])
    for group in np.split(order, np.flatnonzero(differ) + 1):
        size = max(MOST_SAMPLES // int(lengths[group[0]]), 1)
        for first in range(0, len(group), size):
            yield group[first : first + size]


def _rounded(steps: FloatArray) -> FloatArray:
    """Seconds to twelve digits: beyond them are the roundings of the times that steps were taken from."""
    mantissas, exponents = np.frexp(steps)
    return np.ldexp(np.round(mantissas * DIGITS) / DIGITS, exponents)


def tasks_of(table: ExecutionTable, which: IntArray, primitive: Primitive) -> Task:
    """What executions were told, as one batch: without it, their first row, no goal, and the learned duration."""

    def told(name: str) -> FloatArray:
        return table.told[name][which] if name in table.told else np.full(len(which), np.nan)

    starts = [
        np.where(np.isnan(told(f"start_{name}")), table.first(which, name), told(f"start_{name}")) for name in primitive.names
    ]
    goals = [told(f"goal_{name}") for name in primitive.names]
    durations = told("duration")
    return Task(
        np.stack(starts, axis=-1),
        np.stack(goals, axis=-1),
        np.where(np.isnan(durations), primitive.duration, durations),
    )
