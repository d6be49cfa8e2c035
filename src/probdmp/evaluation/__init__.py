"""The paper's experiment on any labelled demonstrations: protocol, judges, rates with intervals, latency."""

from probdmp.evaluation.example import Example, example_of
from probdmp.evaluation.experiment import TASKS, Experiment
from probdmp.evaluation.illustration import Illustration, JudgedExecution, illustrate, judge_execution
from probdmp.evaluation.judges import DETECTORS, READINGS, Judge, Reading, learned_primitive
from probdmp.evaluation.metrics import Rate, rate_of
from probdmp.evaluation.operating import (
    OperatingCurves,
    RealizedRate,
    at_level,
    detected_within,
    level_realizing,
    operating_curves,
    realized_rates,
)
from probdmp.evaluation.outcomes import Assessment, Finding, Outcome, Trace, outcomes_of
from probdmp.evaluation.protocol import Evaluation, evaluate
from probdmp.evaluation.record import EvaluationRecord, JudgeRecord, record_of
from probdmp.evaluation.summary import FaultSummary, Summary, published_summary, summarize
from probdmp.evaluation.trials import UNDISTURBED, Trial, commanded_tasks, draw_trials, group_by_label

__all__ = [
    "DETECTORS",
    "READINGS",
    "TASKS",
    "UNDISTURBED",
    "Assessment",
    "Evaluation",
    "EvaluationRecord",
    "Example",
    "Experiment",
    "FaultSummary",
    "Finding",
    "Illustration",
    "Judge",
    "JudgeRecord",
    "JudgedExecution",
    "OperatingCurves",
    "Outcome",
    "Rate",
    "Reading",
    "RealizedRate",
    "Summary",
    "Trace",
    "Trial",
    "at_level",
    "commanded_tasks",
    "detected_within",
    "draw_trials",
    "evaluate",
    "example_of",
    "group_by_label",
    "illustrate",
    "judge_execution",
    "learned_primitive",
    "level_realizing",
    "operating_curves",
    "outcomes_of",
    "published_summary",
    "rate_of",
    "realized_rates",
    "record_of",
    "summarize",
]
