"""Where movements come from: whatever is kept is in its own unit and place, and only shown elsewhere."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from probdmp.checks import check_array
from probdmp.demonstrations import Demonstration, Placement, are_within, placement_within
from probdmp.dmp import Primitive
from probdmp.errors import DataFileError, InputError, InputTypeError
from probdmp.studio.fields import FARTHEST, name_of, number_of
from probdmp.studio.limits import CANVAS

__all__ = ["DRAWN", "Origin", "as_executed", "origin_in", "origin_of"]

AS_IT_IS = Placement(1.0, np.array([0.0, 0.0]))
FINEST = 1e-9
"""Smallest scale, and one over the largest."""


@dataclass(frozen=True, slots=True, eq=False)
class Origin:
    """The degrees of freedom of a movement, their unit, and how it is shown on the canvas."""

    names: tuple[str, ...]
    units: str
    """Empty if nothing says."""
    placement: Placement
    """From the own unit to the canvas."""

    def of(self, stroke: Demonstration) -> Demonstration:
        """A stroke as one of this movement."""
        return replace(stroke, names=self.names, units=self.units)

    def joined(self, other: "Origin", label: str) -> "Origin":
        """Of a movement that gets recordings of another origin; shown as before.

        Raises
        ------
        InputError
            If one movement cannot be learned from both.
        """
        is_alike = (self.names, self.units) == (other.names, other.units)
        is_moved = not (self.placement.is_identity and other.placement.is_identity)
        if not is_alike or (is_moved and self is not other and DRAWN in (self, other)):
            hint = "Rename the letter that is there first, or delete it."
            raise InputError(f"recordings of {label!r} as those that are there, {self}", str(other), hint)
        return self

    def __str__(self) -> str:
        return f"{', '.join(self.names)} in {self.units or ('units of the canvas' if self is DRAWN else 'an unknown unit')}"

    @property
    def note(self) -> str:
        """What a person should know of how it is shown."""
        if self.placement.is_identity:
            return ""
        return f"Shown {self.placement.scale:.3g} times as large, to fit the canvas; kept and saved in its own unit and place."

    def as_dict(self) -> dict[str, Any] | None:
        """For a page, which gives it back with strokes that it teaches again; None of what was drawn."""
        if self is DRAWN:
            return None
        shown = {"scale": self.placement.scale, "shift": self.placement.shift.tolist()}
        return {"names": list(self.names), "units": self.units, **shown}


DRAWN = Origin(("x", "y"), "", AS_IT_IS)
"""Of strokes that were drawn on the canvas."""


def origin_of(recordings: Sequence[Demonstration]) -> Origin:
    """Of recordings from one file, shown together: as they are if they lie on the canvas, else in its middle."""
    first = recordings[0]
    placement = AS_IT_IS if are_within(recordings, CANVAS) else placement_within(recordings, CANVAS)
    is_drawn = placement.is_identity and (first.names, first.units) == (DRAWN.names, DRAWN.units)
    return DRAWN if is_drawn else Origin(first.names, first.units, placement)


def origin_in(message: Mapping[str, Any]) -> Origin | None:
    """That a page gives back, checked; None if it gives none."""
    value = message.get("origin")
    if value is None:
        return None
    if not isinstance(value, dict) or not isinstance(value.get("names"), list) or len(value["names"]) != len(CANVAS):
        raise InputTypeError("an origin as it was shown", f"{value!r:.100}")
    names = tuple(name_of({"label": name}) for name in value["names"])
    units = "" if value.get("units", "") == "" else name_of(value, "units")
    shift = check_array(value.get("shift", ()), "shift", (len(CANVAS),))
    if not all(abs(x) <= FARTHEST / FINEST for x in shift.tolist()):
        raise InputError("a shift to the canvas", f"{shift!r:.100}")
    return Origin(names, units, Placement(number_of(value, "scale", FINEST, 1 / FINEST), shift))


def as_executed(recording: Demonstration, primitive: Primitive) -> Demonstration:
    """A recording as an execution of a movement, whose names it gets.

    Raises
    ------
    DataFileError
        If it is in another unit.
    """
    if recording.units and primitive.units and recording.units != primitive.units:
        raise DataFileError(f"an execution in {primitive.units}, as learned", recording.units, "Convert it first.")
    return replace(recording, names=primitive.names, units=primitive.units)
