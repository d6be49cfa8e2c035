"""Where the values of the channels come from while one execution runs.

A source is given what every tick of the controller shows and returns values whenever some are complete: after every sample
where innovations are judged, at every tick of the phase clock where the trajectory is.
"""

from collections import deque
from typing import Protocol

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.diagnosis import Diagnosis
from probdmp.detection.sensor_watch import SensorWatch
from probdmp.detection.statistics import standardized_contributions
from probdmp.detection.trajectory_model import as_suspicion
from probdmp.dmp import Task
from probdmp.execution import Observed

__all__ = ["INNOVATION_STATISTICS", "InnovationSource", "Source"]

NIS_WINDOW = 0.05
"""Fraction of the duration over which squared innovations are averaged."""
CUSUM_DRIFT = 1.5
"""Squared innovation per number seen from which the cumulative sum grows."""


class Source(Protocol):
    """Judges the ticks of one execution."""

    def update(self, observed: Observed) -> list[FloatArray]:
        """Values of all channels, (C,) arrays, for each moment that is complete now."""
        ...

    def contributions(self, channel: int) -> FloatArray:
        """(W,) array: signed squared deviation of each signal or output that is watched in a channel at the last moment."""
        ...

    def diagnose(self, channel: int, seen_since: int) -> Diagnosis:
        """What seems to have happened, as seen so many moments after a channel has raised the alarm."""
        ...

    def better(self) -> str:
        """Label of the primitive of the library that fits better, if there is one."""
        ...

    @property
    def sensors(self) -> SensorWatch | None:
        """What watches the sensors, if anything does."""
        ...


class InnovationSource:
    """The innovations of the filter at every sample: what the paper judges, and its usual relatives.

    Parameters
    ----------
    statistic : `"log_likelihood"`: of a sample, as in the paper; `"nis"`: squared innovations in standard deviations, averaged
        over a short time; `"cusum"`: their cumulative sum above what is normal (Page 1954).
    scales : (O,) array, units of the outputs of the sensors.
    """

    def __init__(self, statistic: str, scales: FloatArray, task: Task, dt: float) -> None:
        self._judge, self._scales = INNOVATION_STATISTICS[statistic], scales
        self.recent: deque[float] = deque(maxlen=max(1, round(NIS_WINDOW * float(task.duration) / dt)))
        self.sum = 0.0
        self._last: Observed | None = None

    def update(self, observed: Observed) -> list[FloatArray]:
        """One value for each sample of which anything was seen."""
        if np.isnan(observed.innovations).all():
            return []
        self._last = observed
        return [np.array([self._judge(self, observed)])]

    def contributions(self, channel: int) -> FloatArray:
        """Squared innovations in standard deviations."""
        if self._last is None:
            return np.zeros(len(self._scales))
        return signed_squares(self._last)

    def diagnose(self, channel: int, seen_since: int) -> Diagnosis:
        """Innovations do not tell why."""
        return Diagnosis("motion", "unexpected innovations")

    def better(self) -> str:
        """Nor what it is instead."""
        return ""

    sensors = None

    def log_likelihood(self, observed: Observed) -> float:
        """How unlikely this sample is."""
        nats = standardized_contributions(
            observed.contributions, observed.innovations, observed.innovation_variances, self._scales
        )
        return float(as_suspicion(-nats.sum()))

    def nis(self, observed: Observed) -> float:
        """Mean normalised innovation squared."""
        self.recent.append(_mean_square(observed))
        return sum(self.recent) / len(self.recent)

    def cusum(self, observed: Observed) -> float:
        """Page's cumulative sum."""
        self.sum = max(0.0, self.sum + _mean_square(observed) - CUSUM_DRIFT)
        return self.sum


INNOVATION_STATISTICS = {
    "log_likelihood": InnovationSource.log_likelihood,
    "nis": InnovationSource.nis,
    "cusum": InnovationSource.cusum,
}
"""By name: statistics of single innovations."""


def signed_squares(observed: Observed) -> FloatArray:
    """(O,) array: squared innovations in standard deviations, with their sign; 0 where not seen."""
    innovations = np.nan_to_num(observed.innovations)
    return np.sign(innovations) * innovations**2 / observed.innovation_variances


def _mean_square(observed: Observed) -> float:
    squares = observed.innovations**2 / observed.innovation_variances
    seen = ~np.isnan(squares)
    return float(squares.sum(where=seen) / seen.sum())
