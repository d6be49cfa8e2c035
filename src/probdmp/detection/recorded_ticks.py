"""The ticks of recorded executions side by side: what `ExecutionTicks` makes of each, from whole recordings at once.

A tick is filled by the first sample of a signal that is not before it, alone or together with the one seen before. It comes out
with the sample that fills its last signal, or at which waiting for that is given up, and never before the tick ahead of it.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import MILLISECONDS_HINT, BoolArray, FloatArray, IntArray
from probdmp.detection.phase_clock import ROUNDING, TICKS, longest_gaps
from probdmp.detection.recorded_sensors import NEVER, Sensing, SensorRecord, watch_recordings
from probdmp.errors import InputError
from probdmp.gaussian import kernels

__all__ = ["RecordedTicks", "record_ticks"]

LONGEST = 1000.0
"""Times the duration that a movement should take, up to which a recording is judged."""


class RecordedTicks(NamedTuple):
    """N executions on the phase clock."""

    paths: FloatArray
    """(N, K, S) array: displacements from the start, and channels, as fractions of the range; NaN where nothing was seen around
    the tick, and of no meaning after the last tick."""
    counts: IntArray
    """(N,) array: ticks of each."""
    steps: IntArray
    """(N, K) array: sample with which each tick came out; `NEVER` after the last one."""
    goals: FloatArray
    """(N, D) array: as of `ExecutionTicks`."""
    sensors: SensorRecord


class Clocks(NamedTuple):
    """The phase clocks of N executions; numbers that they share may have a leading axis of one."""

    rates: FloatArray
    """(N, 1, 1) array, ticks per second."""
    dts: FloatArray
    """(N, 1, 1) array, seconds."""
    gaps: FloatArray
    """(N, 1, S) array, ticks: longest time between samples across which the path is taken for straight."""
    patience: FloatArray
    """(N, 1, S) array, ticks: longest time to wait for a sample."""

    @classmethod
    def of(cls, usual_gaps: FloatArray, durations: FloatArray, dts: FloatArray) -> "Clocks":
        """Of executions with durations (N,), with one clock for all of them if they are alike."""
        alike = np.all(durations == durations[0]) and np.all(dts == dts[0])
        durations, dts = (x[: 1 if alike else None, None, None] for x in (durations, dts))
        rates = TICKS / durations
        gaps, patience = longest_gaps(usual_gaps, rates, dts)
        return cls(rates, dts, gaps, patience)

    def at(self, samples: IntArray) -> FloatArray:
        """Times of samples (N, K, S), ticks since the start."""
        return np.asarray((samples * self.dts) * self.rates)

    def first_reaching(self, ticks: IntArray) -> IntArray:
        """First sample of which a tick is not after it, (N, K, 1) array, for ticks (K, 1)."""
        guess = np.maximum(np.ceil((ticks - ROUNDING) / (self.dts * self.rates)).astype(np.int64) - 1, 0)
        for _ in range(2):
            guess = guess + ~(ticks <= self.at(guess) + ROUNDING)
        return guess

    def first_giving_up(self, ticks: IntArray, reached: IntArray) -> IntArray:
        """First sample at which a tick is not waited for any longer, (N, K, S) array."""
        wait = np.where(np.isfinite(self.patience), self.patience, 0.0)
        guess = np.maximum(np.ceil((ticks + wait) / (self.dts * self.rates)).astype(np.int64) - 1, 0)
        for _ in range(2):
            guess = guess + (self.at(guess) - ticks < self.patience)
        return np.where(np.isfinite(self.patience), np.maximum(guess, reached), reached)

    def is_at(self, samples: IntArray, ticks: IntArray) -> BoolArray:
        """Whether samples (N, K, S) are at ticks (K, 1)."""
        return np.abs(self.at(samples) - ticks) <= ROUNDING

    def chosen(self, of: BoolArray) -> "Clocks":
        """Those of some of the executions."""
        return self if len(self.rates) == 1 else Clocks(*(values[of] for values in self))


def record_ticks(
    sensing: Sensing, signals: FloatArray, lengths: IntArray, goals: FloatArray, durations: FloatArray, dts: FloatArray
) -> RecordedTicks:
    """Put N recordings on the phase clock.

    Parameters
    ----------
    signals : (N, T, S) array, units of each; NaN where nothing was measured.
    lengths : (N,) array: samples of each recording; what comes after them is not looked at.
    goals : (N, D) array, data units; NaN where not told.
    durations, dts : (N,) arrays, seconds.
    """
    n, n_samples, n_signals = signals.shape
    longest = float(np.max((lengths - 1) * dts / durations, initial=0.0))
    if longest > LONGEST:
        raise InputError(
            f"executions at most {LONGEST:g} times as long as the movement should take",
            f"one {longest:g} times as long",
            MILLISECONDS_HINT,
        )
    sensors = watch_recordings(sensing, signals, lengths, durations, dts)
    begun = np.zeros((n, n_signals), dtype=np.int64)
    odd = np.flatnonzero(~sensors.is_whole)
    seen = ~np.isnan(sensors.believed[odd])
    begun[odd] = np.where(seen.any(axis=1), np.argmax(seen, axis=1), NEVER)
    first = np.take_along_axis(sensors.believed, np.minimum(begun, n_samples - 1)[:, None], axis=1)[:, 0]
    starts, d = np.where(np.arange(n_signals) < sensing.n_dof, first, 0.0), sensing.n_dof
    clocks = Clocks.of(sensing.profile.usual_gaps, durations, dts)
    if len(clocks.rates) == 1 and sensors.is_whole.all():
        paths, steps = _drawn_together(clocks, sensors.believed, starts, sensing.ranges)
    else:
        paths, steps = _ticks_of(clocks, sensors.believed, lengths, sensors.is_whole)
        paths -= starts[:, None]
        paths /= sensing.ranges
    if np.any(steps[:, -1] == NEVER):
        paths[steps == NEVER] = 0.0
    # What is told of the goal counts from the start as it was known with the first tick.
    known = (begun[:, :d] <= steps[:, :1]) & (steps[:, :1] < NEVER)
    ahead = np.where(known, (goals - starts[:, :d]) / sensing.ranges[:d], np.nan)
    return RecordedTicks(paths, (steps < NEVER).sum(axis=1), steps, ahead, sensors)


def _drawn_together(clocks: Clocks, values: FloatArray, starts: FloatArray, ranges: FloatArray) -> tuple[FloatArray, IntArray]:
    """Paths (N, K, S) of which every sample was seen, by one clock, and the samples (N, K) with which ticks come out."""
    n, n_samples, n_signals = values.shape
    ticks = np.arange(int(np.floor(clocks.at(np.full((1, 1, 1), n_samples - 1)) + ROUNDING).item()) + 1)[:, None]
    reached = clocks.first_reaching(ticks)
    after = np.minimum(reached, n_samples - 1)
    beyond, _ = _part_beyond(clocks, ticks, np.maximum(after - 1, 0), after)
    points = np.empty((len(ticks), n_signals, n))
    kernels.points_on_lines(np.ascontiguousarray(values), after.ravel(), beyond.ravel(), starts, ranges, points)
    steps = np.where(reached < n_samples, reached, NEVER)
    return points.transpose(2, 0, 1), np.repeat(steps[..., 0], n, axis=0)


def _ticks_of(clocks: Clocks, values: FloatArray, lengths: IntArray, is_whole: BoolArray) -> tuple[FloatArray, IntArray]:
    """Values (N, K, S) at the ticks, and the samples (N, K) with which these come out."""
    n_ticks = int(np.floor(np.max(clocks.at((lengths - 1)[:, None, None])) + ROUNDING)) + 1
    if is_whole.all():
        paths, steps = _fill_whole(clocks, values, n_ticks)
    else:
        paths, steps = np.empty((len(values), n_ticks, values.shape[2])), np.empty((len(values), n_ticks), dtype=np.int64)
        for chosen, fill in ((is_whole, _fill_whole), (~is_whole, _fill)):
            paths[chosen], steps[chosen] = fill(clocks.chosen(chosen), values[chosen], n_ticks)
    return paths, np.where(steps < lengths[:, None], steps, NEVER)


def _fill_whole(clocks: Clocks, values: FloatArray, n_ticks: int) -> tuple[FloatArray, IntArray]:
    """Where every sample was seen: straight lines between each two of them."""
    ticks = np.arange(n_ticks)[:, None]
    reached = clocks.first_reaching(ticks)
    after = np.minimum(reached, values.shape[1] - 1)
    return _lines(clocks, values, ticks, np.maximum(after - 1, 0), after)[0], reached[..., 0]


def _fill(clocks: Clocks, values: FloatArray, n_ticks: int) -> tuple[FloatArray, IntArray]:
    """Where some samples were not seen: by signal, between those that were."""
    n, n_samples, _ = values.shape
    ticks, seen = np.arange(n_ticks)[:, None], ~np.isnan(values)
    samples = np.arange(n_samples)[:, None]
    following = np.minimum.accumulate(np.where(seen, samples, NEVER)[:, ::-1], axis=1)[:, ::-1]
    preceding = np.maximum.accumulate(np.where(seen, samples, -1), axis=1)
    reached = np.broadcast_to(clocks.first_reaching(ticks), (n, n_ticks, 1))
    after = np.take_along_axis(following, np.minimum(reached, n_samples - 1), axis=1)
    after = np.where(reached < n_samples, after, NEVER)
    last = np.minimum(after, n_samples - 1)
    before = np.where(last > 0, np.take_along_axis(preceding, np.maximum(last - 1, 0), axis=1), -1)
    filled, is_near = _lines(clocks, values, ticks, np.maximum(before, 0), last)
    known_at = np.where((after < NEVER) & (is_near & (before >= 0) | clocks.is_at(last, ticks)), after, NEVER)
    done = np.maximum(np.minimum(known_at, clocks.first_giving_up(ticks, reached)).max(axis=2), reached[..., 0])
    steps = np.maximum.accumulate(done, axis=1)
    return np.where(known_at <= steps[..., None], filled, np.nan), steps


def _lines(
    clocks: Clocks, values: FloatArray, ticks: IntArray, before: IntArray, after: IntArray
) -> tuple[FloatArray, BoolArray]:
    """Values at ticks (K, 1) on the lines through samples before and after them, (N, K, S), and whether these are near."""
    beyond, is_near = _part_beyond(clocks, ticks, before, after)
    ends, lines = _at(values, after), _at(values, before)
    lines -= ends
    lines *= beyond
    np.copyto(lines, 0.0, where=beyond == 0)  # there may be nothing before
    lines += ends
    return lines, is_near


def _part_beyond(clocks: Clocks, ticks: IntArray, before: IntArray, after: IntArray) -> tuple[FloatArray, BoolArray]:
    """How far before the sample after it a tick is, as a part of the way between the two, and whether these are near."""
    now, last = clocks.at(after), clocks.at(before)
    beyond = np.where(clocks.is_at(after, ticks), 0.0, now - ticks) / np.maximum(now - last, ROUNDING)
    return beyond, now - last <= clocks.gaps


def _at(values: FloatArray, samples: IntArray) -> FloatArray:
    """Values (N, T, S) at samples (N or 1, K, S or 1)."""
    if len(samples) == 1 and samples.shape[2] == 1:
        return np.take(values, samples[0, :, 0], axis=1)
    return np.take_along_axis(values, np.broadcast_to(samples, (len(values), *samples.shape[1:])), axis=1)
