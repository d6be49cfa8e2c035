"""What a calibration can vouch for, as plain facts to report."""

from collections.abc import Mapping
from dataclasses import dataclass

from probdmp.detection.calibration import Calibration

__all__ = ["REPORTED_RATES", "CalibrationFacts", "facts_of"]

REPORTED_RATES = (0.01, 0.02, 0.05, 0.1)
"""Rates of false alarms that are reported on beside the one that was asked for."""


@dataclass(frozen=True, slots=True)
class CalibrationFacts:
    """One threshold: what was asked for, from how many executions it comes, how far it may be trusted."""

    task: str
    """`"known"`: for executions that are told their goal and duration; `"nominal"`: for those told their start only."""
    label: str
    """Of the primitive it is for; nothing for one that the whole library shares."""
    false_alarm_rate: float
    """alpha, share of normal executions that may be called failed."""
    n: int
    """Calibration executions."""
    attainable_rate: float
    """Least rate that n executions can vouch for, 1 / (n + 1)."""
    source: str
    """Where they come from: `"leave_one_out"` or `"held_out"`."""
    method: str
    """`"conformal"`: the threshold is one of their values; `"tail"`: it lies on a tail fitted to the largest of them."""
    guarantee: str
    """How far the rate may be trusted, in words."""
    threshold: float
    """Surprise above which an execution has failed, nats."""
    thresholds: Mapping[float, float]
    """By rate: what the threshold would be if it were asked for."""
    suspects: Mapping[str, float]
    """Primitives with more executions among the most surprising tenth than chance explains, or that rank higher throughout than
    it explains: label to the share of their executions in that tenth."""
    own_thresholds: Mapping[str, float]
    """The higher thresholds of the suspects, by label."""
    suspects_at: Mapping[float, Mapping[str, float]]
    """By rate: which primitives would be suspects."""
    own_thresholds_at: Mapping[float, Mapping[str, float]]
    """By rate: what their thresholds would be."""

    def relative_level(self, rate: float, label: str) -> float:
        """Threshold of a primitive at one of the reported rates, relative to the one that it has."""
        return self.own_thresholds_at[rate].get(label, self.thresholds[rate]) / self.own_thresholds.get(label, self.threshold)


def facts_of(calibration: Calibration, task: str, label: str) -> CalibrationFacts:
    """The facts about a calibration; `task` and `label` as in `CalibrationFacts`."""
    c = calibration
    others = {rate: c.at_rate(rate) for rate in REPORTED_RATES}
    return CalibrationFacts(
        task=task,
        label=label,
        false_alarm_rate=c.false_alarm_rate,
        n=c.n,
        attainable_rate=c.attainable_rate,
        source=c.method,
        method="conformal" if c.is_conformal else "tail",
        guarantee=c.guarantee,
        threshold=c.threshold,
        thresholds={rate: other.threshold for rate, other in others.items()},
        suspects=c.suspects,
        own_thresholds=c.own_thresholds,
        own_thresholds_at={rate: other.own_thresholds for rate, other in others.items()},
        suspects_at={rate: other.suspects for rate, other in others.items()},
    )
