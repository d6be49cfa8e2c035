"""What a user chooses about a detector."""

from dataclasses import dataclass

import numpy as np

from probdmp.checks import check_choice, check_count, check_fraction
from probdmp.detection.calibration import CALIBRATIONS
from probdmp.detection.sources import INNOVATION_STATISTICS
from probdmp.errors import InputError, InputTypeError

__all__ = ["STATISTICS", "DetectorOptions"]

STATISTICS = ("trajectory", *INNOVATION_STATISTICS)
MOST_PERSISTENT = 100


@dataclass(frozen=True, slots=True)
class DetectorOptions:
    """Of a calibrated detector."""

    false_alarm_rate: float = 0.01
    """alpha: share of normal executions that may be called failed."""
    statistic: str = "trajectory"
    """One of `STATISTICS`."""
    calibration: str = "leave_one_out"
    """One of `probdmp.detection.calibration.CALIBRATIONS`."""
    pooled: bool = True
    """Whether the primitives of a library share one threshold."""
    persistence: int = 1
    """Moments in a row above the threshold that make an alarm."""

    def __post_init__(self) -> None:
        rate = check_fraction(self.false_alarm_rate, "false_alarm_rate")
        if not 0 < rate < 1:
            raise InputError("false_alarm_rate between 0 and 1", f"{rate:g}", "0.01: one normal execution in a hundred.")
        object.__setattr__(self, "false_alarm_rate", rate)
        check_choice(self.statistic, "statistic", STATISTICS)
        check_choice(self.calibration, "calibration", CALIBRATIONS)
        if not isinstance(self.pooled, bool | np.bool_):
            raise InputTypeError("pooled as True or False", f"{self.pooled!r:.100}")
        object.__setattr__(self, "pooled", bool(self.pooled))
        object.__setattr__(self, "persistence", check_count(self.persistence, "persistence", most=MOST_PERSISTENT))
