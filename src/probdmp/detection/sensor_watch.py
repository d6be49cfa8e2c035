"""Is the sensor to be believed? Exact repeats, single wild samples, silence.

A sample that is far from the straight line through the two before it is set aside until the next one: if that is near it, the
movement has jumped, and counts from there on; if not, it was a spike. So a spike never reaches the statistics of the
movement, and a movement that runs away soon does.
"""

import numpy as np

from probdmp.checks import BoolArray, FloatArray, IntArray
from probdmp.detection.profile import ExecutionProfile
from probdmp.gaussian import kernels

__all__ = ["SensorWatch"]

JUMP_FACTOR = 3.0
"""A sample is suspicious from so many times the largest jump of the demonstrations."""
LEAST_JUMP = 0.05
"""And at least this fraction of the range."""
MOST_SPIKES = 1
"""More spikes in an execution, of all degrees of freedom, make a sensor fault."""
LEAST_REPEATS = 8
LEAST_REPEAT_SHARE = 0.08
"""A sensor is stuck from so many exact repeats and this fraction of the duration, if the demonstrations have none."""
COARSE_REPEATS = 2
"""Where the demonstrations have more repeats than this in a row, the sensor is coarse, or they rest exactly."""
COARSE_FACTOR = 3.0
COARSE_SHARE = 0.15
"""Such a sensor is stuck from so many times the longest of these repetitions and this fraction of the duration."""
LONGEST_SPIKE = 3
"""Samples; what is wild for longer is how the movement goes, whether or not they agree."""
SILENCE_SHARE = 0.1
"""Nothing measured for this fraction of the duration: the execution can no longer be judged."""
GAP_FACTOR = 2.0
"""But for a sensor that measures less often than that: for so many times as long as is usual in the demonstrations."""


CAUSES = ("", "stuck", "spikes")


class SensorWatch:
    """The sensors of one execution, or of a batch of them side by side.

    Parameters
    ----------
    profile : what the demonstrations showed.
    ranges : (S,) array, units of each signal.
    n_dof : how many of the signals are positions.
    duration, dt : (*batch) arrays, seconds, of the movement and between samples.
    """

    def __init__(
        self,
        profile: ExecutionProfile,
        ranges: FloatArray,
        n_dof: int,
        duration: FloatArray | float,
        dt: FloatArray | float,
    ) -> None:
        n_signals = len(ranges)
        self._n_dof, shape = n_dof, (*np.shape(duration), n_signals)
        duration, dt = np.asarray(duration)[..., None], np.asarray(dt)[..., None]
        self._largest_jumps = np.maximum(JUMP_FACTOR * profile.largest_jumps, LEAST_JUMP * ranges)
        longest = profile.longest_repeats / dt
        self._most_repeats = np.where(
            longest > COARSE_REPEATS,
            np.maximum(COARSE_FACTOR * longest, COARSE_SHARE * duration / dt),
            np.maximum(LEAST_REPEATS, LEAST_REPEAT_SHARE * duration / dt),
        )
        # A force may well be constant, at rest or at its limit; if it should not be, its own statistic says so.
        self._most_repeats = np.where(np.arange(n_signals) < n_dof, self._most_repeats, np.inf)
        self._most_silent = np.maximum(np.maximum(SILENCE_SHARE * duration / dt, 2.0), GAP_FACTOR * profile.usual_gaps / dt)
        unknown = np.full(shape, np.nan)
        self._believed = (unknown, unknown)
        """The last sample but one, and the last."""
        self._is_calm = False
        self._causes: IntArray | None = None
        self._is_stale: BoolArray | None = None
        """What has been asked since anything was missing, wild or repeated: while nothing is, neither changes."""
        self._suspicious, self._last = unknown, unknown
        self._silent, self._skipped = np.zeros(shape), np.zeros(shape)
        self.repeats, self.spikes = np.zeros(shape), np.zeros(shape)

    @property
    def causes(self) -> IntArray:
        """(*batch) array: which of `CAUSES` applies."""
        if self._causes is None:
            # If nothing moves at all, whether by exact numbers or not, it is the movement that stands still.
            is_stuck = np.any(self.repeats > self._most_repeats, axis=-1) & ~self._all_repeat
            has_spikes = self.spikes.sum(axis=-1) > MOST_SPIKES
            self._causes = np.where(is_stuck, CAUSES.index("stuck"), np.where(has_spikes, CAUSES.index("spikes"), 0))
        return self._causes

    @property
    def cause(self) -> str:
        """What is wrong with a single execution, in a word or two; nothing if nothing is."""
        return CAUSES[int(self.causes)]

    @property
    def _all_repeat(self) -> BoolArray:
        """(*batch) array: whether each of several positions is the same number again and again."""
        return np.all(self.repeats[..., : self._n_dof] > 0, axis=-1) & (self._n_dof > 1)

    @property
    def is_stale(self) -> BoolArray:
        """(*batch) array: whether a sensor has been silent for too long."""
        if self._is_stale is None:
            self._is_stale = np.asarray(self.staleness > 1)
        return self._is_stale

    @property
    def shares(self) -> FloatArray:
        """(*batch, S) array: of what is wrong with each sensor to what may be."""
        return np.maximum(self.repeats / self._most_repeats, self.spikes / MOST_SPIKES)

    @property
    def ratio(self) -> FloatArray:
        """(*batch) array: of what is wrong to what may be, of all sensors together; above 1 for a fault."""
        return np.maximum(np.max(self.repeats / self._most_repeats, axis=-1), self.spikes.sum(axis=-1) / MOST_SPIKES)

    @property
    def staleness(self) -> FloatArray:
        """(*batch) array: how long a sensor has been silent relative to how long it may be; above 1 when it is stale."""
        return np.asarray(np.max(self._silent / self._most_silent, axis=-1))

    def is_plain(self, recorded: FloatArray) -> BoolArray:
        """(N,) array: whether of a whole recording, (N, T, S), all is measured and believed, and nothing repeats."""
        is_plain = np.empty(len(recorded), dtype=np.int64)
        kernels.plain_recordings(np.ascontiguousarray(recorded), self._largest_jumps, is_plain)
        return np.asarray(is_plain == 1)

    def believe(self, measured: FloatArray) -> FloatArray:
        """The sample (*batch, S) without what is suspicious of it, which is NaN instead; units of each signal."""
        older, old = self._believed
        jumps = np.abs(measured - old - (self._skipped + 1) * (old - older))
        if self._is_calm and (jumps <= self._largest_jumps).all() and not (measured == self._last).any():
            self._believed, self._last = (old, measured), measured
            return measured
        return self._look(measured, jumps)

    def _look(self, measured: FloatArray, jumps: FloatArray) -> FloatArray:
        """The same where something may be missing, wild or repeated."""
        self._causes = self._is_stale = None
        older, old = self._believed
        seen = ~np.isnan(measured)
        self._silent = np.where(seen, 0, self._silent + 1)
        self.repeats = np.where(seen, np.where(measured == self._last, self.repeats + 1, 0), self.repeats)
        self._last = np.where(seen, measured, self._last)
        wild = seen & (jumps > self._largest_jumps)
        agrees = np.abs(measured - self._suspicious) <= self._largest_jumps
        confirmed = wild & (agrees | (self._skipped >= LONGEST_SPIKE))
        self.spikes = self.spikes + (seen & ~wild & ~np.isnan(self._suspicious))
        self._suspicious = np.where(wild & ~confirmed, measured, np.where(seen, np.nan, self._suspicious))
        believed = np.where(seen & ~(wild & ~confirmed), measured, np.nan)
        self._skipped = np.where(seen & np.isnan(believed), self._skipped + 1, 0)
        # After a jump, or a gap, there is no line to compare with.
        gap, unknown = confirmed | ~seen, np.isnan(believed)
        self._believed = (
            np.where(gap, np.nan, np.where(unknown, older, old)),
            np.where(unknown, np.where(gap, np.nan, old), believed),
        )
        self._is_calm = bool(seen.all() and not self.repeats.any() and np.isnan(self._suspicious).all())
        return believed
