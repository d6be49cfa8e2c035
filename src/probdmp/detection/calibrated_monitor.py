"""A calibrated detector at work on one execution."""

from dataclasses import replace

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.calibration import Calibration
from probdmp.detection.sensor_watch import SensorWatch
from probdmp.detection.sources import Source
from probdmp.detection.verdict import Verdict
from probdmp.execution import Observed

__all__ = ["CalibratedMonitor"]

LOOKED_AT_AGAIN = (0, 4, 8, 12)
"""Moments after an alarm at which its reason is looked for; later, what began it is out of sight."""


class CalibratedMonitor:
    """Compares the surprise of one execution with the threshold; the first alarm is latched, its reason looked into further.

    Parameters
    ----------
    label : of the primitive, which may have a threshold of its own.
    channels : (C) names of the channels.
    names : (W) names of what is judged: positions, learned channels, outputs of other sensors.
    persistence : moments in a row with a test ratio above 1 that make an alarm.
    """

    def __init__(
        self,
        source: Source,
        calibration: Calibration,
        label: str,
        channels: tuple[str, ...],
        names: tuple[str, ...],
        persistence: int,
    ) -> None:
        self._source, self._calibration, self._channels = source, calibration, channels
        self._threshold, self._persistence = calibration.threshold_for(label), persistence
        self._ratio, self._n_above, self._n_since, self._is_latched, self._channel = 0.0, 0, 0, False, 0
        self._verdict = Verdict(False, 0, 0.0, 1.0, 0.0, np.zeros(len(names)), names)

    @property
    def verdict(self) -> Verdict:
        """What can be said so far."""
        return self._verdict

    def update(self, observed: Observed) -> float:
        """Take one tick into account; returns the test ratio, above 1 for an alarm."""
        ratios = [self._judge(observed, values) for values in self._source.update(observed)]
        self._ratio = max(ratios, default=self._ratio)
        sensors = self._source.sensors
        if sensors is not None:
            if sensors.cause and not self._verdict.has_sensor_fault:
                self._note_sensor(observed, sensors)
            if bool(sensors.is_stale) != self._verdict.is_stale:
                self._note_silence(observed, sensors)
        return self._ratio

    def _judge(self, observed: Observed, values: FloatArray) -> float:
        surprises = self._calibration.surprises_now(values)
        channel = max(range(len(surprises)), key=surprises.__getitem__)
        ratio = surprises[channel] / self._threshold
        self._n_above = self._n_above + 1 if ratio > 1 else 0
        if self._is_latched:
            self._look_closer()
        elif ratio > self._verdict.test_ratio or self._n_above >= self._persistence:
            self._channel = channel
            self._latch(observed, ratio, self._source.contributions(channel), self._channels[channel])
            if self._n_above >= self._persistence:
                self._is_latched = True
                self._verdict = replace(self._verdict, failed=True)
                self._look_closer()
        return ratio

    def _latch(self, observed: Observed, ratio: float, contributions: FloatArray, channel: str = "") -> None:
        self._verdict = replace(
            self._verdict,
            step=observed.step,
            time=observed.time,
            phase=observed.phase,
            test_ratio=ratio,
            contributions=contributions,
            channel=channel,
        )

    def _look_closer(self) -> None:
        """The reason as it looks now; that of a faulty sensor stands."""
        if self._verdict.kind not in ("sensor", "data missing"):
            if self._n_since in LOOKED_AT_AGAIN:
                kind, cause = self._source.diagnose(self._channel, self._n_since)
                better = self._source.better() if kind == "motion" else ""
                self._verdict = replace(self._verdict, kind=kind, cause=cause, better=better)
            self._n_since += 1

    def _note_sensor(self, observed: Observed, sensors: SensorWatch) -> None:
        """A sensor fault explains what the movement seemed to do."""
        if not self._verdict.failed:
            shares = np.zeros(len(self._verdict.names))
            shares[: len(sensors.shares)] = sensors.shares
            self._latch(observed, float(sensors.ratio), shares, "sensor")
        self._is_latched = True
        verdict = replace(self._verdict, kind="sensor", cause=sensors.cause, better="")
        self._verdict = replace(verdict, failed=True, has_sensor_fault=True)

    def _note_silence(self, observed: Observed, sensors: SensorWatch) -> None:
        """What is not seen cannot be called fine."""
        if sensors.is_stale and not self._verdict.failed:
            self._latch(observed, float(sensors.staleness), np.zeros(len(self._verdict.names)), "silence")
            self._is_latched = True
            self._verdict = replace(self._verdict, failed=True, kind="data missing", cause="nothing measured")
        self._verdict = replace(self._verdict, is_stale=bool(sensors.is_stale))
