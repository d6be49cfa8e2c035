"""From samples at any rate to ticks of one hundredth of the movement.

Statistics of the trajectory are evaluated at the ticks, so what they say does not depend on the control rate. Between samples
the path is taken for straight. A tick waits for the first sample after it; where a sensor is silent for longer than
`LONGEST_GAP` around a tick, the tick goes on without it, as NaN.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import FloatArray

__all__ = ["TICKS", "PhaseClock", "Tick", "longest_gaps"]

TICKS = 100
"""Ticks in a movement, hence TICKS + 1 phases from its start to its end."""
LONGEST_GAP = 3.0
"""Ticks between two samples across which the path is taken for straight; at least two and a half samples."""
ROUNDING = 1e-6


class Tick(NamedTuple):
    """The movement at one tick."""

    number: int
    """Ticks since the start; beyond `TICKS` once the movement should be over."""
    values: FloatArray
    """(S,) array, as given to the clock; NaN where nothing was seen around the tick."""


def longest_gaps(usual_gaps: FloatArray, rate: FloatArray, dt: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Ticks across which the path is taken for straight, and for which a sample is waited for.

    Parameters
    ----------
    usual_gaps : (S,) array, seconds: how far apart the samples of each signal are; infinite for what is never measured.
    rate, dt : ticks per second, and seconds between samples.
    """
    measured = np.isfinite(usual_gaps)
    gaps = 1.5 * np.where(measured, usual_gaps, 0.0) * rate
    longest = np.maximum(np.maximum(LONGEST_GAP, 2.5 * dt * rate), gaps)
    return longest, np.where(measured, longest, -np.inf)  # what is never measured is not waited for


class PhaseClock:
    """Turns the samples of one execution into ticks.

    Parameters
    ----------
    usual_gaps : (S,) array, seconds: how far apart the samples of each signal are; infinite for what is never measured.
    duration, dt : seconds, of the movement and between samples.
    """

    def __init__(self, usual_gaps: FloatArray, duration: float, dt: float) -> None:
        self._rate = TICKS / duration
        self._longest_gaps, self._patience = longest_gaps(usual_gaps, np.asarray(self._rate), np.asarray(dt))
        self._last_times = np.full(len(usual_gaps), -np.inf)
        self._last_values = np.full(len(usual_gaps), np.nan)
        self._everything = np.ones(len(usual_gaps))
        self._pending: list[Tick] = []
        self._next = 0

    def advance(self, time: float, values: FloatArray) -> list[Tick]:
        """Take in a sample; returns the ticks that are complete now, or that have waited long enough.

        Parameters
        ----------
        time : seconds since the start, not before the last one.
        values : (S,) array, any unit; NaN where nothing was measured.
        """
        now = time * self._rate
        while self._next <= now + ROUNDING:
            self._pending.append(Tick(self._next, np.full(len(values), np.nan)))
            self._next += 1
        seen = ~np.isnan(values)
        if not self._pending and seen.all():  # between ticks: nothing to do but to remember
            self._last_times, self._last_values = self._everything * now, values
            return []
        if self._pending and seen.any():
            self._fill(now, values, seen)
        self._last_times = np.where(seen, now, self._last_times)
        self._last_values = np.where(seen, values, self._last_values)
        ready = 0
        for tick in self._pending:
            if np.any(np.isnan(tick.values) & (now - tick.number < self._patience)):
                break
            ready += 1
        done, self._pending = self._pending[:ready], self._pending[ready:]
        return done

    def _fill(self, now: float, values: FloatArray, seen: NDArray[np.bool_]) -> None:
        """Straight lines from the last sample to this one, over the ticks between them."""
        gaps = now - self._last_times
        near = seen & (gaps <= self._longest_gaps)
        slopes = np.where(near, (values - self._last_values) / np.maximum(gaps, ROUNDING), 0.0)
        for tick in self._pending:
            here = seen & (np.abs(now - tick.number) <= ROUNDING)
            reached = here | (near & (self._last_times <= tick.number + ROUNDING))
            fill = reached & np.isnan(tick.values)
            tick.values[fill] = (values - np.where(here, 0.0, slopes * (now - tick.number)))[fill]
