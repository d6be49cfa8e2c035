"""Is this still the movement it was taught? Statistics, thresholds, detectors and verdicts."""

from probdmp.detection.batch import BatchJudgement
from probdmp.detection.calibration_facts import CalibrationFacts
from probdmp.detection.detector import FailureDetector
from probdmp.detection.verdict import Verdict

__all__ = ["BatchJudgement", "CalibrationFacts", "FailureDetector", "Verdict"]
