"""Recordings of one primitive as arrays, side by side."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.demonstrations import Demonstration
from probdmp.detection.phase_clock import TICKS
from probdmp.execution import ExecutionBatch, SensorArray, readings_of

__all__ = ["RecordedSignals"]

AT_ONCE = 2048
"""Recordings that are judged side by side; more would only cost memory."""
MOST_TICKS = 4 * TICKS * AT_ONCE
"""Ticks of all of them together: a few recordings that go on for very long are judged apart from the others."""


class RecordedSignals(NamedTuple):
    """N recordings."""

    values: FloatArray
    """(N, T, S) array, units of each signal: positions and learned channels; NaN where nothing was measured."""
    lengths: IntArray
    """(N,) array: samples of each; what comes after them has no meaning."""
    dts: FloatArray
    """(N,) array, seconds between samples."""

    @classmethod
    def of(cls, array: SensorArray, recordings: Sequence[Demonstration]) -> "RecordedSignals":
        """What sensors have seen of recordings of any length."""
        signals = [array.signals(readings_of(array, recording)) for recording in recordings]
        lengths = np.array([len(values) for values in signals])
        stacked = np.full((len(signals), lengths.max(), signals[0].shape[1]), np.nan)
        for row, values in zip(stacked, signals, strict=True):
            row[: len(values)] = values
        return cls(stacked, lengths, np.array([recording.dt for recording in recordings]))

    @classmethod
    def of_batch(cls, array: SensorArray, batch: ExecutionBatch) -> "RecordedSignals":
        """What sensors have seen of recordings of equal length."""
        n, n_samples, _ = batch.observations.shape
        return cls(array.signals(batch.observations), np.full(n, n_samples), np.full(n, batch.dt))

    def chosen(self, rows: IntArray) -> "RecordedSignals":
        """Some of them, as far as the longest of these goes."""
        if np.array_equal(rows, np.arange(len(self.lengths))):  # whose numbers need not be copied
            return RecordedSignals(self.values[:, : self.lengths.max()], self.lengths, self.dts)
        lengths = self.lengths[rows]
        return RecordedSignals(self.values[rows, : lengths.max()], lengths, self.dts[rows])

    def parts(self, rows: IntArray, durations: FloatArray) -> Iterator[IntArray]:
        """Some of them in parts that are small enough; movements of the same duration together.

        Parameters
        ----------
        durations : (N,) array, seconds: of the movements that they should be.
        """
        n_ticks = np.maximum((self.lengths - 1) * self.dts / durations * TICKS, TICKS)
        ordered = rows[np.lexsort((durations[rows], n_ticks[rows]))]
        begin = 0
        while begin < len(ordered):
            ticks = n_ticks[ordered[begin : begin + AT_ONCE]]
            count = max(int(np.sum(ticks * np.arange(1, len(ticks) + 1) <= MOST_TICKS)), 1)
            yield ordered[begin : begin + count]
            begin += count
