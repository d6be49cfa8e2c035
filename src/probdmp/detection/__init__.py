"""Is this still the movement it was taught? Statistics, thresholds, detectors and verdicts."""

from probdmp.detection.detector import FailureDetector
from probdmp.detection.verdict import Verdict

__all__ = ["FailureDetector", "Verdict"]
