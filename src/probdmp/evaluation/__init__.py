"""The paper's experiment on any labelled demonstrations: protocol, rates with intervals, latency."""

from probdmp.evaluation.experiment import Evaluation, Experiment, evaluate
from probdmp.evaluation.illustration import Illustration, illustrate
from probdmp.evaluation.metrics import Rate, rate_of
from probdmp.evaluation.outcomes import READINGS, Outcome, Reading, Summary, published_summary, summarize

__all__ = [
    "READINGS",
    "Evaluation",
    "Experiment",
    "Illustration",
    "Outcome",
    "Rate",
    "Reading",
    "Summary",
    "evaluate",
    "illustrate",
    "published_summary",
    "rate_of",
    "summarize",
]
