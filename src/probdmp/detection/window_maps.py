"""Windows of many executions as linear maps, ready to be multiplied.

What is compared with the model is z = L^-1 (window - mean - gain ahead), where ahead is how far a goal lies from the mean one.
That is linear in (1, ahead, window), so one matrix for each place holds all of it, for all shifts of tempo together.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.gaussian import kernels

__all__ = ["WindowInputs", "WindowMaps", "linear_maps"]


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


@dataclass(frozen=True, slots=True, eq=False)
class WindowMaps:
    """The maps of windows of one shape at every place."""

    maps: FloatArray
    """(T, R, A, 1 + D + E) array: R outputs under A shifts, from one, D goals ahead and the E numbers of a window."""
    signals: IntArray
    """(E) which of the signals each number of a window is."""
    reach: IntArray
    """(R) how many inputs, the first ones, an output and those before it depend on."""

    def look(self, place: int, window: FloatArray, starts: IntArray, end: int) -> FloatArray:
        """Squared lengths of the outputs from each of J starts to the next, or the end, of one window: (J, A) array.

        Parameters
        ----------
        window : one, goals ahead, and as many numbers as the outputs depend on.
        """
        n_places, n_outputs, n_accounts, n_inputs = self.maps.shape
        flat = self.maps.reshape(n_places, n_outputs * n_accounts, n_inputs)
        white = flat[min(place, n_places - 1), : end * n_accounts, : len(window)].dot(window)
        white *= white
        return np.asarray(np.add.reduceat(white.reshape(end, n_accounts), starts))

    def squares(self, inputs: WindowInputs, offsets: IntArray, ends: IntArray, wanted: IntArray) -> list[FloatArray]:
        """Squared lengths of the first outputs, up to each of J ends, at the first places: J arrays (wanted, A, n).

        Parameters
        ----------
        offsets : (E) tick at which each number of a window is seen, relative to the place.
        """
        rows = inputs.rows(int(wanted[0]), offsets, self.signals)
        n_accounts, n = self.maps.shape[2], inputs.values.shape[1]
        found = np.empty(int(wanted.sum()) * n_accounts * n)
        kernels.whitened_squares(inputs.values, rows, self.maps, ends, self.reach, wanted, found)
        return kernels.split_sums(found, wanted, n_accounts, n)


def linear_maps(whitening: FloatArray, means: FloatArray, gains: FloatArray, signals: IntArray, which: IntArray) -> WindowMaps:
    """From what is expected of U different windows.

    Parameters
    ----------
    whitening, means, gains : L^-1 (U, R, E), and (U, E) and (U, E, D) of what a window is made of.
    signals : (E) which of the signals that is.
    which : (T, A) the window of each place and shift.
    """
    affine = -np.matmul(whitening, np.concatenate([means[..., None], gains], axis=-1))
    own = np.concatenate([affine, whitening], axis=-1)
    used = np.asarray(own.any(axis=0))
    last = used.shape[1] - np.argmax(used[:, ::-1], axis=1)
    # (T, R, A, K)
    maps = own[which[:, None], np.arange(own.shape[1])[:, None]]
    return WindowMaps(maps, signals, np.maximum.accumulate(last))
