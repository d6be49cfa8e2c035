"""Windows of many executions as linear maps, ready to be multiplied.

What is compared with the model is z = L^-1 (window - mean - gain ahead), where ahead is how far a goal lies from the mean one.
That is linear in (1, ahead, window), so one matrix for each place holds all of it, for all shifts of tempo together.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.gaussian import kernels

__all__ = ["Densities", "Needed", "Rest", "WindowInputs", "WindowMaps", "linear_maps"]


class WindowInputs(NamedTuple):
    """All that windows of n executions are made of."""

    values: FloatArray
    """(1 + D + T S, n) array: one, goals ahead, and paths tick after tick, numbers that were not seen as zero."""
    n_dof: int
    n_signals: int

    @classmethod
    def of(cls, paths: FloatArray, ahead: FloatArray) -> "WindowInputs":
        """From paths (T, S, n) and goals ahead (D, n)."""
        length, n_signals, n = paths.shape
        first = 1 + len(ahead)
        values = np.empty((first + length * n_signals, n))
        values[0], values[1:first] = 1.0, ahead
        values[first:].reshape(paths.shape)[...] = paths
        return cls(values, len(ahead), n_signals)

    @property
    def paths(self) -> FloatArray:
        """(T, S, n) array."""
        return self.values[1 + self.n_dof :].reshape(-1, self.n_signals, self.values.shape[1])

    def rows(self, n_places: int, offsets: IntArray, signals: IntArray) -> IntArray:
        """Which values make up the windows at places 0, 1, …: (n_places, 1 + D + E) array."""
        first = 1 + self.n_dof
        length = (len(self.values) - first) // self.n_signals
        ticks = np.clip(np.arange(n_places)[:, None] + offsets, 0, length - 1)
        rows = np.empty((n_places, first + len(offsets)), dtype=np.int64)
        rows[:, :first], rows[:, first:] = np.arange(first), first + ticks * self.n_signals + signals
        return rows


@dataclass(frozen=True, eq=False)
class WindowMaps:
    """The maps of windows of one shape at every place."""

    maps: FloatArray
    """(U, R, 1 + D + E) array: R outputs from one, D goals ahead and the E numbers of a window, for U different windows."""
    which: IntArray
    """(T, A) array: which of these each place has under each of A shifts."""
    signals: IntArray
    """(E) which of the signals each number of a window is."""
    reach: IntArray
    """(R) how many inputs, the first ones, an output and those before it depend on."""

    def look(self, place: int, window: FloatArray, ends: IntArray) -> FloatArray:
        """Squared lengths of the outputs from each of J + 1 ends to the next, of one window: (J, A) array.

        Parameters
        ----------
        window : one, goals ahead, and as many numbers as the outputs depend on.
        """
        sums = np.empty((len(ends) - 1, self.which.shape[1]))
        kernels.window_sums(self.maps, self.which[min(place, len(self.which) - 1)], self.reach, window, ends, sums)
        return sums

    def squares(
        self, inputs: WindowInputs, offsets: IntArray, ends: IntArray, wanted: IntArray, penalties: FloatArray
    ) -> list[FloatArray]:
        """Squared lengths of the first outputs, up to each of J ends, at the first places, least over shifts.

        Parameters
        ----------
        offsets : (E) tick at which each number of a window is seen, relative to the place.
        penalties : (A) what is added for each shift.

        Returns
        -------
        J arrays (wanted, n).
        """
        found = self._squares(inputs, offsets, ends, wanted, penalties)
        return kernels.split_sums(found, wanted, inputs.values.shape[1])

    def evidence(
        self,
        inputs: WindowInputs,
        offsets: IntArray,
        ends: IntArray,
        wanted: IntArray,
        densities: "Densities",
        rest: "Rest",
        needed: "Needed",
    ) -> list[FloatArray]:
        """Nats that speak for rest since the second end; arguments as for `squares`.

        Parameters
        ----------
        ends : (J) the first of them is where it may become plain that there is nothing.
        densities : of the squares up to each end, mixed over shifts.
        needed : of J - 2 channels.

        Returns
        -------
        J - 2 arrays (wanted, n).
        """
        stds, constants, central = rest
        found = np.empty(int(wanted[2:].sum()) * inputs.values.shape[1])
        bases, n_halves, freedom = densities
        asked = self._asked(inputs, offsets, ends, wanted)
        kernels.window_evidence(*asked, bases, n_halves, stds, constants, *needed, found, freedom, central)
        return kernels.split_sums(found, wanted[2:], inputs.values.shape[1])

    def ratios(
        self,
        inputs: WindowInputs,
        offsets: IntArray,
        ends: IntArray,
        wanted: int,
        densities: "Densities",
        other: tuple["WindowMaps", "Densities"],
        needed: "Needed",
        central: int,
    ) -> FloatArray:
        """Nats that speak for other windows; arguments as above.

        Parameters
        ----------
        ends : (J) the last of them is asked about; the others are where it may become plain that there is nothing.
        needed : of one channel.
        central : the account that is likeliest beforehand.

        Returns
        -------
        (wanted, n) array.
        """
        (bases, n_halves, freedom), (maps, (other_bases, _, _)) = densities, other
        found, n = np.empty((wanted, inputs.values.shape[1])), np.full(len(ends), wanted)
        asked = self._asked(inputs, offsets, ends, n)
        contrary = (maps.maps, maps.which, maps.reach, other_bases)
        floors, limits = needed
        kernels.window_ratios(*asked, bases, n_halves, *contrary, floors[0], limits, found.reshape(-1), freedom, central)
        return found

    def _squares(
        self, inputs: WindowInputs, offsets: IntArray, ends: IntArray, wanted: IntArray, penalties: FloatArray
    ) -> FloatArray:
        """Those of `squares`, one array after the other."""
        found = np.empty(int(wanted.sum()) * inputs.values.shape[1])
        kernels.least_squares(*self._asked(inputs, offsets, ends, wanted), penalties, found)
        return found

    def _asked(
        self, inputs: WindowInputs, offsets: IntArray, ends: IntArray, wanted: IntArray
    ) -> tuple[FloatArray | IntArray, ...]:
        rows = inputs.rows(int(wanted[0]), offsets, self.signals)
        return inputs.values, rows, self.maps, self.which, ends, self.reach, wanted


class Needed(NamedTuple):
    """What evidence has to be above to matter, of C channels; what does not may be -infinity."""

    floors: FloatArray
    """(C, n) array; while evidence is weighed they rise to what was found."""
    limits: FloatArray
    """(C,) array: up to which they rise; whatever is above that matters."""

    def of(self, channels: Sequence[int]) -> "Needed":
        """The same of some channels, in memory of its own."""
        return Needed(self.floors[channels], self.limits[channels])


class Densities(NamedTuple):
    """sum_a (base_a (1 + square_a / freedom))^-(n_halves / 2), a multivariate t with scales of its own for every shift."""

    bases: FloatArray
    """(T, J, A) array."""
    n_halves: IntArray
    """(J)"""
    freedom: float


class Rest(NamedTuple):
    """That an execution is where it was, and which shift is the likeliest one beforehand."""

    stds: FloatArray
    """(D,) array, as fractions of the range: how much what is at rest still moves."""
    constants: FloatArray
    """(J - 1) logarithms of its density where it is largest."""
    central: int


def linear_maps(whitening: FloatArray, means: FloatArray, gains: FloatArray, signals: IntArray, which: IntArray) -> WindowMaps:
    """From what is expected of U different windows.

    Parameters
    ----------
    whitening, means, gains : L^-1 (U, R, E), and (U, E) and (U, E, D) of what a window is made of.
    signals : (E) which of the signals that is.
    which : (T, A) the window of each place and shift.
    """
    affine = -np.matmul(whitening, np.concatenate([means[..., None], gains], axis=-1))
    maps = np.concatenate([affine, whitening], axis=-1)
    used = np.asarray(maps.any(axis=0))
    last = used.shape[1] - np.argmax(used[:, ::-1], axis=1)
    return WindowMaps(maps, np.ascontiguousarray(which), signals, np.maximum.accumulate(last))
