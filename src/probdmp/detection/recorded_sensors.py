"""The sensors of recorded executions side by side: what is believed of each, and what was wrong with them when."""

from typing import NamedTuple

import numpy as np

from probdmp.checks import BoolArray, FloatArray, IntArray
from probdmp.detection.profile import ExecutionProfile
from probdmp.detection.sensor_watch import SensorWatch

__all__ = ["NEVER", "Sensing", "SensorRecord", "watch_recordings"]

NEVER = np.iinfo(np.int64).max
"""Step of what has not happened."""


class SensorRecord(NamedTuple):
    """What `SensorWatch` says of N executions from step to step."""

    believed: FloatArray
    """(N, T, S) array: samples without what is suspicious of them, which is NaN instead."""
    faulty_from: IntArray
    """(N,) array: step at which a fault was first seen, or `NEVER`; so are the steps below."""
    causes: IntArray
    """(N,) array: which fault, in the order of `probdmp.detection.sensor_watch.CAUSES`."""
    fault_ratios: FloatArray
    """(N,) array: of what was wrong to what may be, at that step."""
    fault_shares: FloatArray
    """(N, S) array: of each sensor."""
    stale_from: IntArray
    """(N,) array: step at which a sensor had first been silent for too long."""
    staleness: FloatArray
    """(N,) array: for how long relative to how long it may be, at that step."""
    is_stale: BoolArray
    """(N,) array: whether it is so at the end."""
    is_whole: BoolArray
    """(N,) array: whether all was measured and believed, and nothing repeats."""


class Sensing(NamedTuple):
    """What the sensors of executions of a primitive are like."""

    profile: ExecutionProfile
    ranges: FloatArray
    """(S,) array, units of each signal."""
    n_dof: int

    def watch(self, durations: FloatArray, dts: FloatArray) -> SensorWatch:
        """Of a batch of executions."""
        return SensorWatch(self.profile, self.ranges, self.n_dof, durations, dts)


def watch_recordings(
    sensing: Sensing, signals: FloatArray, lengths: IntArray, durations: FloatArray, dts: FloatArray
) -> SensorRecord:
    """Watch N recordings.

    Parameters
    ----------
    signals : (N, T, S) array, units of each.
    lengths : (N,) array: samples of each; what comes after them is not looked at.
    durations, dts : (N,) arrays, seconds.
    """
    n, _, n_signals = signals.shape
    is_whole = sensing.watch(durations, dts).is_plain(signals) & (lengths == signals.shape[1])
    record = SensorRecord(
        signals,
        *(np.full(n, NEVER), np.zeros(n, dtype=np.int64), np.zeros(n), np.zeros((n, n_signals))),
        *(np.full(n, NEVER), np.zeros(n), np.zeros(n, dtype=np.bool_), is_whole),
    )
    others = np.flatnonzero(~is_whole)
    if not len(others):
        return record
    watched = _watch(sensing.watch(durations[others], dts[others]), signals[others], lengths[others])
    believed = np.array(signals)
    for whole, part in zip((believed, *record[1:-1]), watched, strict=True):
        whole[others] = part
    return record._replace(believed=believed)


def _watch(watch: SensorWatch, signals: FloatArray, lengths: IntArray) -> tuple[FloatArray | IntArray | BoolArray, ...]:
    """All of a record but the last, step by step."""
    n, n_samples, n_signals = signals.shape
    believed = np.full(signals.shape, np.nan)
    faulty_from, stale_from, causes = np.full(n, NEVER), np.full(n, NEVER), np.zeros(n, dtype=np.int64)
    ratios, shares, staleness, is_stale = np.zeros(n), np.zeros((n, n_signals)), np.zeros(n), np.zeros(n, dtype=np.bool_)
    for t in range(n_samples):
        goes_on = t < lengths
        believed[:, t] = np.where(goes_on[:, None], watch.believe(signals[:, t]), np.nan)
        now, stale = watch.causes, watch.is_stale
        new = goes_on & (now > 0) & (faulty_from == NEVER)
        if new.any():
            faulty_from[new], causes[new], ratios[new], shares[new] = t, now[new], watch.ratio[new], watch.shares[new]
        new = goes_on & stale & (stale_from == NEVER)
        if new.any():
            stale_from[new], staleness[new] = t, watch.staleness[new]
        is_stale = np.where(goes_on, stale, is_stale)
    return believed, faulty_from, causes, ratios, shares, stale_from, staleness, is_stale
