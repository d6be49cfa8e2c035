"""Is this still the movement it was taught? Statistics, thresholds, detectors and verdicts."""

from probdmp.detection.calibration_facts import CalibrationFacts
from probdmp.detection.detector import FailureDetector
from probdmp.detection.verdict import Verdict

__all__ = ["CalibrationFacts", "FailureDetector", "Verdict"]
