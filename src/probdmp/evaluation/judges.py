"""Who decides whether an execution has failed.

A judge is given the trials of all classes at once, so that it may learn from the training demonstrations of all of them, and
returns an assessment: an outcome for each test execution, trial by trial, and where its thresholds come from. It sees no test
demonstration before it has made up its mind how to judge. `outcomes_of` puts its findings together.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from probdmp.demonstrations import Demonstration
from probdmp.detection import FailureDetector
from probdmp.dmp import Configuration, Primitive, Task
from probdmp.evaluation.experiment import Experiment
from probdmp.evaluation.outcomes import Assessment, Finding, Outcome, Trace, outcomes_of
from probdmp.evaluation.trials import Trial, commanded_tasks
from probdmp.learning import LearningOptions, fit_primitive

__all__ = [
    "DETECTORS",
    "READINGS",
    "STAGES",
    "Judge",
    "Progress",
    "Reading",
    "fit_paper_detector",
    "judge_by_calibrated",
    "learned_primitive",
    "shown_primitive",
]

Progress = Callable[[str], None]
"""Called by a judge with its label after each class; by the calibrated one after each of its stages."""
STAGES = {"calibrated": 3}
"""By judge: how often it calls for each class, if more than once: learned, calibrated, judged."""
Judge = Callable[[Sequence[Trial], Experiment, Progress], Assessment]
"""(trials of one seed, the experiment with that seed, progress) to one outcome for each test, in the order of the trials."""


@dataclass(frozen=True, slots=True)
class Reading:
    """A way to understand what the paper leaves open."""

    forcing_noise: str
    """Whose variance: `"predictive"` or `"posterior"`, see `probdmp.dmp.forcing_term`; or `BETWEEN`."""
    likelihood: str
    """`"per_step"` or `"cumulative"`; see `probdmp.detection.statistics`."""

    @property
    def name(self) -> str:
        """In words."""
        return f"{self.forcing_noise}, {self.likelihood.replace('_', ' ')}"


BETWEEN = "between"
"""Sigma_w is how the weights of single demonstrations differ, not how well their mean is known; nothing scales with goals."""

READINGS = tuple(
    Reading(noise, likelihood) for noise in ("predictive", "posterior", BETWEEN) for likelihood in ("per_step", "cumulative")
)
"""All readings; the first is the one that `as_published` takes."""


def fit_paper_detector(trial: Trial, reading: Reading, experiment: Experiment) -> tuple[Primitive, FailureDetector]:
    """Learn a class from its training demonstrations, and the paper's detector with the task knowledge of the experiment."""
    configuration, weight_model = experiment.configuration_for("paper"), "pooled"
    if reading.forcing_noise == BETWEEN:
        configuration, weight_model = replace(configuration, scaling="none"), "hierarchical"
    else:
        configuration = replace(configuration, forcing_noise=reading.forcing_noise)
    primitive = learned_primitive(trial, configuration, weight_model)
    detector = FailureDetector(rule="paper", likelihood=reading.likelihood)
    tasks = commanded_tasks(primitive, trial.training, experiment.task)
    return primitive, detector.fit(primitive, trial.training, tasks=tasks)


def learned_primitive(trial: Trial, configuration: Configuration, weight_model: str = "pooled") -> Primitive:
    """The primitive that the training demonstrations teach; remembered, since several judges ask for the same."""
    return _learned(tuple(trial.training), configuration, weight_model)


@lru_cache(maxsize=128)
def _learned(training: tuple[Demonstration, ...], configuration: Configuration, weight_model: str) -> Primitive:
    return fit_primitive(training, configuration, LearningOptions(weight_model))[0]


def shown_primitive(trial: Trial, experiment: Experiment) -> Primitive:
    """The primitive of a class as the first judge of the experiment has it, for pictures."""
    if experiment.detector == "paper":
        return learned_primitive(trial, replace(experiment.configuration_for("paper"), forcing_noise=READINGS[0].forcing_noise))
    return _varied_primitive(trial, experiment)


def _varied_primitive(trial: Trial, experiment: Experiment) -> Primitive:
    configuration = experiment.configuration_for("calibrated")
    return fit_primitive(trial.training, configuration, LearningOptions("hierarchical", channels=experiment.channels))[0]


def _judge_by_paper(reading: Reading, trials: Sequence[Trial], experiment: Experiment, on_class: Progress) -> Assessment:
    outcomes: list[Outcome] = []
    for trial in trials:
        primitive, detector = fit_paper_detector(trial, reading, experiment)
        outcomes += _judged(trial, detector, primitive, experiment)
        on_class(trial.label)
    return Assessment(outcomes)


def judge_by_calibrated(trials: Sequence[Trial], experiment: Experiment, on_class: Progress) -> Assessment:
    """The calibrated detector: every class taught with its variation, all of them calibrated together."""
    primitives: dict[str, Primitive] = {}
    for trial in trials:
        primitives[trial.label] = _varied_primitive(trial, experiment)
        on_class(trial.label)
    detector = FailureDetector(experiment.false_alarm_rate)
    asked = {t.label: commanded_tasks(primitives[t.label], t.training, experiment.task) for t in trials}
    training = {trial.label: trial.training for trial in trials}
    detector.fit(primitives, training, tasks=asked, on_part=lambda label, n_parts: on_class(label))
    outcomes: list[Outcome] = []
    for trial in trials:
        outcomes += _judged(trial, detector, primitives[trial.label], experiment)
        on_class(trial.label)
    return Assessment(outcomes, detector.calibrations_)


def _judged(trial: Trial, detector: FailureDetector, primitive: Primitive, experiment: Experiment) -> list[Outcome]:
    tasks = commanded_tasks(primitive, trial.tests, experiment.task)
    findings = {
        name: _findings(detector, primitive, tasks, executions, experiment.traces)
        for name, executions in trial.executions.items()
    }
    return outcomes_of(trial, findings)


def _findings(
    detector: FailureDetector, primitive: Primitive, tasks: Sequence[Task], executions: Sequence[Demonstration], traces: bool
) -> list[Finding]:
    findings = []
    for execution, (monitor, ticks) in zip(executions, detector.replay(primitive, tasks, executions), strict=True):
        ratios = np.array([monitor.update(observed) for observed in ticks])
        verdict = monitor.verdict
        alarm = verdict.time if verdict.failed else None
        trace = Trace(execution.times, ratios) if traces else None
        findings.append(Finding(alarm, verdict.kind, verdict.cause, verdict.better, trace))
    return findings


DETECTORS: dict[str, Mapping[str, Judge]] = {
    "calibrated": {"calibrated": judge_by_calibrated},
    "paper": {reading.name: partial(_judge_by_paper, reading) for reading in READINGS},
}
"""By name, as given to `--detector`: its judges, the first of which stands for it."""
