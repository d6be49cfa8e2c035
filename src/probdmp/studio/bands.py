"""What was learned, as it is drawn: path and tube, bands over time, forcing term."""

from typing import Any

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Task, task_for
from probdmp.dmp.forcing_term import forcing_term
from probdmp.dmp.phase import phases_at
from probdmp.estimator import ProbabilisticDMP
from probdmp.execution import movement_change, position_covariances, roll_out, via_points_for
from probdmp.io.plain_values import plain
from probdmp.plotting.trajectories import QUANTITIES, band_edges, evenly_spaced, tube_ellipses
from probdmp.studio.limits import DT
from probdmp.studio.session import Movement, TaskWish
from probdmp.studio.views import task_view

__all__ = ["asked_of", "band_of", "band_view"]

MOST_TIMES = 200
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")


def asked_of(wish: TaskWish, learned: ProbabilisticDMP) -> tuple[ProbabilisticDMP, Task]:
    """The movement that is executed, through the via-points that the page has set, and its task."""
    task = task_for(learned.primitive_, wish.start, wish.goal, wish.duration)
    if not wish.via:
        return learned, task
    return learned.condition(via_points_for(learned.primitive_, task, wish.via)), task


def band_view(label: str, movement: Movement, wish: TaskWish) -> dict[str, Any]:
    """A movement as planned, with its uncertainty."""
    assert movement.learned is not None, "checked"
    executed, task = asked_of(wish, movement.learned)
    primitive = executed.primitive_
    planned = roll_out(primitive, task, DT)
    chosen = evenly_spaced(len(planned.times), MOST_TIMES)
    tube = tube_ellipses(planned.positions[chosen], position_covariances(primitive, task, DT)[chosen])
    bands: dict[str, Any] = {
        "path" if quantity == "position" else quantity: band_of(getattr(planned, means)[chosen], getattr(planned, stds)[chosen])
        for quantity, (means, stds, _) in QUANTITIES.items()
    }
    channels = {name: band_of(channel.means[chosen], channel.stds[chosen]) for name, channel in planned.channels.items()}
    phases = phases_at(planned.times[chosen], float(task.duration))
    forcing = forcing_term(primitive, phases)
    return plain(
        {
            "type": "band",
            "label": label,
            "names": primitive.names,
            "units": primitive.units,
            "times": planned.times[chosen],
            **bands,
            "channels": channels,
            "forcing": {"phase": phases, **band_of(forcing.means, np.sqrt(forcing.variances))},
            "tube": tube,
            "change": _change_text(movement),
            "task": task_view(wish),
            "seconds": {"stroke_to_band": movement.seconds},
        }
    )


def band_of(means: FloatArray, stds: FloatArray) -> dict[str, FloatArray]:
    """A mean and the edges of its band, arrays of one shape, as they are drawn."""
    lower, upper = band_edges(means, stds)
    return {"mean": means, "lower": lower, "upper": upper}


def _change_text(movement: Movement) -> str:
    """What the last demonstration has changed."""
    if movement.learned is None or movement.before is None:
        return ""
    count = len(movement.strokes)
    which = f"the {ORDINALS[count - 1]} demonstration" if 0 < count <= len(ORDINALS) else f"demonstration {count}"
    return f"{which} {movement_change(movement.before.primitive_, movement.learned.primitive_)}"
