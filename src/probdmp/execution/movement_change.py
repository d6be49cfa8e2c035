"""How one learned movement differs from another: what a further demonstration has changed."""

from dataclasses import dataclass

import numpy as np

from probdmp.dmp import Primitive, task_for
from probdmp.execution.rollout import roll_out

__all__ = ["MovementChange", "movement_change"]

N_PHASES = 101
UNNOTICED = 0.005
"""Relative change of a band that rounds to nothing."""


@dataclass(frozen=True, slots=True)
class MovementChange:
    """Of the later movement against the earlier one."""

    shift: float
    """Root mean square over the movement of the distance between the means, data units."""
    widening: float
    """Mean standard deviation of positions of the later relative to that of the earlier."""

    def __str__(self) -> str:
        moved = f"moved the mean by {self.shift:.2g} units"
        if abs(self.widening - 1) < UNNOTICED:
            return f"{moved} and left the band as wide"
        word = "widened" if self.widening > 1 else "narrowed"
        if self.widening >= 2:
            return f"{moved} and made the band {self.widening:.2g} times as wide"
        return f"{moved} and {word} the band by {100 * abs(self.widening - 1):.0f} %"


def movement_change(earlier: Primitive, later: Primitive) -> MovementChange:
    """Compare two movements of the same degrees of freedom, phase by phase, each as learned."""
    plans = [roll_out(p, task_for(p), p.duration / (N_PHASES - 1)) for p in (earlier, later)]
    before, after = plans
    distances = np.sum((after.positions - before.positions) ** 2, axis=1)
    stds = [float(np.mean(plan.position_stds)) for plan in plans]
    return MovementChange(float(np.sqrt(np.mean(distances))), stds[1] / stds[0] if stds[0] > 0 else 1.0)
