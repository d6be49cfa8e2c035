"""What is done in worker processes: learning, calibrating, reading files that strangers may have made."""

from collections.abc import Mapping, Sequence
from typing import Any

from probdmp.demonstrations import Demonstration, synthetic_letters
from probdmp.detection import FailureDetector
from probdmp.estimator import ProbabilisticDMP

__all__ = ["calibrate", "learn", "warm_up"]


def learn(strokes: Sequence[Demonstration], parameters: Mapping[str, Any]) -> ProbabilisticDMP:
    """A movement from its demonstrations."""
    return ProbabilisticDMP(**parameters).fit(list(strokes))


def calibrate(
    library: Mapping[str, ProbabilisticDMP], strokes: Mapping[str, Sequence[Demonstration]], alpha: float
) -> dict[str, FailureDetector]:
    """Detectors by label: one that all labels with two or more demonstrations share, the paper's rule for the others."""
    several = {label: p for label, p in library.items() if len(strokes[label]) > 1}
    detectors: dict[str, FailureDetector] = {}
    if several:
        shared = FailureDetector(alpha).fit(several, {label: list(strokes[label]) for label in several})
        detectors = dict.fromkeys(several, shared)
    for label in library.keys() - several.keys():
        detectors[label] = FailureDetector(rule="paper").fit({label: library[label]}, {label: list(strokes[label])})
    return detectors


def warm_up() -> None:
    """Load what the first piece of work would wait for."""
    taught = synthetic_letters(2, letters="a")
    calibrate({"a": learn(taught, {})}, {"a": taught}, 0.01)
