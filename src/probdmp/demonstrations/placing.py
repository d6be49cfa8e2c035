"""Movements moved and scaled as a whole, to where there is room for them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, frozen
from probdmp.demonstrations.demonstration import Demonstration
from probdmp.errors import InputError

__all__ = ["Placement", "are_within", "placement_within"]


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Where movements are put: scale times position, plus shift."""

    scale: float
    """The same along all axes, > 0."""
    shift: FloatArray
    """(D,) array, new units."""

    def placed(self, demonstration: Demonstration) -> Demonstration:
        """The demonstration there; its channels stay as they are."""
        return replace(demonstration, positions=self.scale * demonstration.positions + self.shift)

    @property
    def is_identity(self) -> bool:
        """Whether it leaves everything where it is."""
        return self.scale == 1.0 and not np.any(self.shift)


def are_within(demonstrations: Sequence[Demonstration], corner: ArrayLike, least: float = 0.1) -> bool:
    """Whether movements lie in the box from zero to its far corner, and are not lost in it.

    Parameters
    ----------
    corner : (D,) array, data units.
    least : fraction of the box that they extend over at least, together, along some axis.
    """
    rows, box = np.concatenate([d.positions for d in demonstrations]), np.asarray(corner, dtype=np.float64)
    seen = rows[~np.isnan(rows).any(axis=1)]
    inside = bool(np.all((seen >= 0) & (seen <= box)))
    return inside and bool(np.any(np.ptp(seen, axis=0) >= least * box)) if len(seen) else False


def placement_within(demonstrations: Sequence[Demonstration], corner: ArrayLike, filled: float = 0.6) -> Placement:
    """How to put movements into the middle of the box from zero to its far corner, all together and undistorted.

    Parameters
    ----------
    corner : (D,) array, new units, > 0.
    filled : fraction of the box, along the tighter axis, that they take together.

    Raises
    ------
    InputError
        If there are none, they have not the axes of the box, or nothing of them was measured or moves.
    """
    if not demonstrations or any(d.n_dof != np.size(corner) for d in demonstrations):
        raise InputError(f"demonstrations of {np.size(corner)} degrees of freedom", f"{demonstrations!r:.100}")
    box = check_array(corner, "corner", (demonstrations[0].n_dof,))
    rows = np.concatenate([d.positions for d in demonstrations])
    if np.isnan(rows).all(axis=0).any():
        raise InputError("positions along every axis", "an axis of which nothing was measured")
    lowest, highest = np.nanmin(rows, axis=0), np.nanmax(rows, axis=0)
    extents = highest - lowest
    if not np.any(extents > 0):
        raise InputError("movements that move", "demonstrations that stand still")
    scale = float(filled * np.min(box[extents > 0] / extents[extents > 0]))
    return Placement(scale, frozen(box / 2 - scale * (lowest + highest) / 2))
