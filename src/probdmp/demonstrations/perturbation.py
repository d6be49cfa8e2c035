"""Faults put into recorded executions: when they begin, and what is drawn."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations.demonstration import Demonstration
from probdmp.demonstrations.faults import Fault

__all__ = ["ONSETS", "fault_generator", "perturb_executions"]

ONSETS = (0.3, 0.7)
"""Faults begin in this part of the movement, unless told where."""


def fault_generator(seed: int, label: str, fault: Fault) -> np.random.Generator:
    """Random numbers for the executions of one class: neither other classes nor other faults change what is drawn."""
    # 256 is no byte: it keeps the label apart from the name.
    return np.random.default_rng([seed, *label.encode(), 256, *fault.kind.encode()])


def perturb_executions(
    fault: Fault,
    executions: Sequence[Demonstration],
    others: Sequence[Demonstration],
    rng: np.random.Generator,
    onset: float | None = None,
) -> tuple[list[Demonstration], list[int]]:
    """Executions as they would have been recorded with a fault, without sensor channels, of which a fault says nothing.

    Parameters
    ----------
    others : executions of other movements, for faults that take them; those at another rate are passed over.
    onset : where the fault begins, fraction of the samples, 0 to 1; drawn from `ONSETS` for each execution unless given.

    Returns
    -------
    The executions with the fault, and the first sample of each that has it.

    Raises
    ------
    TooFewDemonstrationsError
        If the fault needs other movements and there are none.
    """
    onsets = [_onset(fault, d.n_samples, rng, onset) for d in executions]
    faulty = [
        replace(d, positions=fault(d.positions, first, rng, _comparable(d, others)), channels={})
        for d, first in zip(executions, onsets, strict=True)
    ]
    return faulty, onsets


def _onset(fault: Fault, n_samples: int, rng: np.random.Generator, onset: float | None) -> int:
    if fault.takes_others:
        return 0
    fraction = rng.uniform(*ONSETS) if onset is None else onset
    return min(max(1, int(fraction * n_samples)), n_samples - 1)


def _comparable(execution: Demonstration, others: Sequence[Demonstration]) -> list[FloatArray]:
    """Positions of those at the same rate with as many degrees of freedom."""
    return [o.positions for o in others if o.n_dof == execution.n_dof and math.isclose(o.dt, execution.dt, rel_tol=1e-6)]
