"""Faults put into recorded executions: when they begin, and what is drawn."""

import math
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import replace

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations.demonstration import Demonstration
from probdmp.demonstrations.faults import Fault
from probdmp.errors import InputError

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
    """Executions as they would have been recorded with a fault.

    Sensor channels of what is held, slowed down, or another movement, are so too; what pushes a movement aside leaves them
    alone, and so do faults of the position sensor. Where all positions of a sample are lost, its channels are.

    Parameters
    ----------
    others : executions of other movements, for faults that take them; those at another rate are passed over.
    onset : where the fault begins, fraction of the samples, 0 to 1; drawn from `ONSETS` for each execution unless given.

    Returns
    -------
    The executions with the fault, and the first sample of each that has it.

    Raises
    ------
    InputError
        If it is a fault of channels and an execution has none.
    TooFewDemonstrationsError
        If the fault needs other movements and there are none.
    """
    onsets = [_onset(fault, d.n_samples, rng, onset) for d in executions]
    faulty = [_perturbed(fault, d, first, rng, _comparable(d, others)) for d, first in zip(executions, onsets, strict=True)]
    return faulty, onsets


def _perturbed(
    fault: Fault, execution: Demonstration, onset: int, rng: np.random.Generator, others: Sequence[Demonstration]
) -> Demonstration:
    """One execution with the fault."""
    names = tuple(execution.channels)
    channels, of_others = _channels(execution, names), [_channels(other, names) for other in others]
    if fault.of_channels:
        if not names:
            hint = "Channels are the columns of a recording that are no positions, such as forces."
            raise InputError(f"executions with sensor channels for the fault {fault.name!r}", "one without", hint)
        return replace(execution, channels=_by_name(names, fault(channels, onset, rng, of_others)))
    own = rng.spawn(1)[0]  # so that channels do not change what is drawn for the positions
    drawn = deepcopy(rng) if fault.takes_others else own
    positions = fault(execution.positions, onset, rng, [other.positions for other in others])
    if fault.takes_others:  # the same one of them
        along = of_others[int(drawn.integers(len(of_others)))]
    else:
        along = fault(channels, onset, own) if names and fault.takes_channels_along else channels
    if len(positions) == execution.n_samples:
        lost = np.isnan(positions).all(axis=1, keepdims=True) & ~np.isnan(execution.positions).all(axis=1, keepdims=True)
        along = np.where(lost, np.nan, along)
    return replace(execution, positions=positions, channels=_by_name(names, along))


def _channels(recording: Demonstration, names: Sequence[str]) -> FloatArray:
    """The named channels of a recording, (T, F) array; NaN where it has none."""
    unseen = np.full(recording.n_samples, np.nan)
    columns = [recording.channels.get(name, unseen) for name in names]
    return np.column_stack(columns) if columns else np.empty((recording.n_samples, 0))


def _by_name(names: Sequence[str], table: FloatArray) -> dict[str, FloatArray]:
    return dict(zip(names, table.T, strict=True))


def _onset(fault: Fault, n_samples: int, rng: np.random.Generator, onset: float | None) -> int:
    if fault.takes_others:
        return 0
    fraction = rng.uniform(*ONSETS) if onset is None else onset
    return min(max(1, int(fraction * n_samples)), n_samples - 1)


def _comparable(execution: Demonstration, others: Sequence[Demonstration]) -> list[Demonstration]:
    """Those at the same rate with as many degrees of freedom."""
    return [o for o in others if o.n_dof == execution.n_dof and math.isclose(o.dt, execution.dt, rel_tol=1e-6)]
