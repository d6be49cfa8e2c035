"""Via-points of one execution, wherever it starts and ends."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import check_array, check_number
from probdmp.dmp import Primitive, Task, ViaPoint, condition_primitive
from probdmp.errors import InputError
from probdmp.execution.rollout import roll_out

__all__ = ["via_points_for"]

PASSING = 0.01
"""Standard deviation of the distance at which an execution passes a via-point, as a fraction of the range."""
MOST_CORRECTIONS = 10
N_PHASES = 201


def via_points_for(primitive: Primitive, task: Task, points: Sequence[tuple[float, ArrayLike]]) -> list[ViaPoint]:
    """What `condition_primitive` has to be given so that an execution of a task passes through points.

    Via-points are those of a movement as it was learned; another start and another goal bend it elsewhere too, by what is
    found by rolling out and corrected.

    Parameters
    ----------
    points : (part of the duration, above 0 and up to 1; position, (D,), data units, NaN where free) each; executions pass them
        within a hundredth of the range.

    Raises
    ------
    InputError, InputTypeError
        If a point is none, or the weights of the primitive are not joint.
    """
    parts = np.array([check_number(part, "the part of the duration at a via-point") for part, _ in points])
    if not np.all((parts > 0) & (parts <= 1)):
        raise InputError("parts of the duration above 0 and up to 1 at via-points", f"{parts}")
    shape = (primitive.n_dof,)
    wanted = np.array([check_array(p, "the position of a via-point", shape, missing=True) for _, p in points])
    near, step = PASSING * primitive.ranges, float(task.duration) / (N_PHASES - 1)
    aims = wanted - primitive.starts(task) + primitive.start
    placed: list[ViaPoint] = []
    for _ in range(MOST_CORRECTIONS):
        placed = [(part * primitive.duration, aim, near) for part, aim in zip(parts.tolist(), aims, strict=True)]
        planned = roll_out(condition_primitive(primitive, placed), task, step)
        phases = planned.times / planned.times[-1]
        passed = np.column_stack([np.interp(parts, phases, column) for column in planned.positions.T])
        missed = wanted - passed
        if not np.any(np.abs(missed) > near):
            break
        aims = aims + missed
    return placed
