"""Is the sensor to be believed? Exact repeats, single wild samples, silence.

A sample that is far from the straight line through the two before it is set aside until the next one: if that is near it, the
movement has jumped, and counts from there on; if not, it was a spike. So a spike never reaches the statistics of the
movement, and a movement that runs away soon does.
"""

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.profile import ExecutionProfile

__all__ = ["SensorWatch"]

JUMP_FACTOR = 3.0
"""A sample is suspicious from so many times the largest jump of the demonstrations."""
LEAST_JUMP = 0.05
"""And at least this fraction of the range."""
SPIKES = 3
"""So many spikes in an execution make a sensor fault."""
LONGEST_SPIKE = 3
"""Samples; what is wild for longer is how the movement goes, whether or not they agree."""
REPEAT_FACTOR = 2.0
"""A sensor is stuck from so many times the longest repetition of the demonstrations."""
LEAST_REPEATS = 5
LEAST_REPEAT_SHARE = 0.04
"""And at least so many samples and this fraction of the duration."""
SILENCE_SHARE = 0.1
"""Nothing measured for this fraction of the duration: the execution can no longer be judged."""


class SensorWatch:
    """The sensors of one execution.

    Parameters
    ----------
    profile : what the demonstrations showed.
    ranges : (D,) array, data units.
    duration, dt : seconds, of the movement and between samples.
    """

    def __init__(self, profile: ExecutionProfile, ranges: FloatArray, duration: float, dt: float) -> None:
        n_dof = len(ranges)
        self._largest_jumps = np.maximum(JUMP_FACTOR * profile.largest_jumps, LEAST_JUMP * ranges)
        self._most_repeats = np.maximum(
            REPEAT_FACTOR * profile.longest_repeats / dt, max(LEAST_REPEATS, LEAST_REPEAT_SHARE * duration / dt)
        )
        self._most_silent = max(SILENCE_SHARE * duration / dt, 2.0)
        self._believed = np.full((2, n_dof), np.nan)
        self._suspicious = np.full(n_dof, np.nan)
        self._last = np.full(n_dof, np.nan)
        self._silent, self._skipped = np.zeros(n_dof), np.zeros(n_dof)
        self.repeats, self.spikes = np.zeros(n_dof), np.zeros(n_dof)

    @property
    def cause(self) -> str:
        """What is wrong, in a word or two; nothing if nothing is."""
        if np.any(self.repeats > self._most_repeats):
            return "stuck"
        return "spikes" if np.any(self.spikes >= SPIKES) else ""

    @property
    def is_stale(self) -> bool:
        """Whether a sensor has been silent for too long."""
        return bool(np.any(self._silent > self._most_silent))

    @property
    def shares(self) -> FloatArray:
        """(D,) array: how far each sensor has gone towards being called faulty, 1 and more when it is."""
        return np.maximum(self.repeats / self._most_repeats, self.spikes / SPIKES)

    def believe(self, measured: FloatArray) -> FloatArray:
        """The sample (D,) without what is suspicious of it, which is NaN instead; data units."""
        seen = ~np.isnan(measured)
        self._silent = np.where(seen, 0, self._silent + 1)
        self.repeats = np.where(seen, np.where(measured == self._last, self.repeats + 1, 0), self.repeats)
        self._last = np.where(seen, measured, self._last)
        older, old = self._believed
        jumps = np.abs(measured - old - (self._skipped + 1) * (old - older))
        wild = seen & (jumps > self._largest_jumps)
        agrees = np.abs(measured - self._suspicious) <= self._largest_jumps
        confirmed = wild & (agrees | (self._skipped >= LONGEST_SPIKE))
        self.spikes = self.spikes + (seen & ~wild & ~np.isnan(self._suspicious))
        self._suspicious = np.where(wild & ~confirmed, measured, np.where(seen, np.nan, self._suspicious))
        believed = np.where(seen & ~(wild & ~confirmed), measured, np.nan)
        self._skipped = np.where(seen & np.isnan(believed), self._skipped + 1, 0)
        # After a jump, or a gap, there is no line to compare with.
        gap = confirmed | ~seen
        self._believed = np.where(
            np.isnan(believed), np.where(gap, np.nan, self._believed), np.stack([np.where(gap, np.nan, old), believed])
        )
        return believed
