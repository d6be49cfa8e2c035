"""One execution of the experiment in full: as recorded and with a fault, the paper's figure as data."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration
from probdmp.detection import FailureDetector, Verdict
from probdmp.detection.monitoring import LikelihoodStatistic, replay
from probdmp.dmp import Primitive, Task
from probdmp.evaluation.experiment import Experiment
from probdmp.evaluation.judges import READINGS, fit_paper_detector
from probdmp.evaluation.trials import commanded_tasks, draw_trials
from probdmp.execution import GaussianTrajectory, SensorArray, roll_out

__all__ = ["Illustration", "JudgedExecution", "illustrate", "judge_execution"]


@dataclass(frozen=True, slots=True, eq=False)
class JudgedExecution:
    """A recording and what the detector made of it."""

    recording: Demonstration
    statistic: FloatArray
    """(T,) array, nats: log-likelihood with positions in units of their range; infinite where nothing was seen."""
    test_ratios: FloatArray
    """(T,) array: statistic of the detector over its threshold, above 1 for an alarm."""
    verdict: Verdict
    level: float | None
    """With the paper's rule, the log-likelihood below which an execution has failed, nats."""


@dataclass(frozen=True, slots=True, eq=False)
class Illustration:
    """A primitive, a task, and two executions of it."""

    label: str
    primitive: Primitive
    training: Sequence[Demonstration]
    rollout: GaussianTrajectory
    """For the task of the execution."""
    undisturbed: JudgedExecution
    disturbed: JudgedExecution
    fault: str
    onset: float
    """Seconds at which the fault begins."""
    level: float
    """The statistic below which an execution has failed, nats."""


def illustrate(demonstrations: Sequence[Demonstration], experiment: Experiment, label: str | None = None) -> Illustration:
    """Show one execution of an experiment, in the first reading of the paper's rule and with the first fault.

    Parameters
    ----------
    label : class to show; the first unless given. Of its test executions the first is shown that is rightly judged both as
        recorded and with the fault, or the first of all if none is.
    """
    trials, fault = {trial.label: trial for trial in draw_trials(demonstrations, experiment)}, experiment.faults[0]
    trial = trials[next(iter(trials)) if label is None else label]
    primitive, detector = fit_paper_detector(trial, READINGS[0], experiment)
    tasks = commanded_tasks(primitive, trial.tests, experiment.task)
    pairs = [
        (judge_execution(detector, primitive, task, test), judge_execution(detector, primitive, task, faulty))
        for task, test, faulty in zip(tasks, trial.tests, trial.faulty[fault], strict=True)
    ]
    right = [not undisturbed.verdict.failed and disturbed.verdict.failed for undisturbed, disturbed in pairs]
    k = int(np.argmax(right))
    return Illustration(
        label=trial.label,
        primitive=primitive,
        training=trial.training,
        rollout=roll_out(primitive, tasks[k], trial.tests[k].dt),
        undisturbed=pairs[k][0],
        disturbed=pairs[k][1],
        fault=fault,
        onset=trial.onsets[fault][k] * trial.tests[k].dt,
        level=detector.thresholds_[primitive.identity].level,
    )


def judge_execution(detector: FailureDetector, primitive: Primitive, task: Task, recording: Demonstration) -> JudgedExecution:
    """One execution under the eyes of a detector, tick by tick; of any rule, the log-likelihood goes along."""
    own_threshold = detector.thresholds_.get(primitive.identity)
    array = SensorArray(primitive, detector.sensors_)
    statistic = LikelihoodStatistic(detector.likelihood if own_threshold else "per_step", array.scales)
    values = np.array([statistic.update(observed)[0] for observed in next(replay(primitive, [task], [recording], array))])
    ((monitor, ticks),) = detector.replay(primitive, [task], [recording])
    ratios = np.array([monitor.update(observed) for observed in ticks])
    return JudgedExecution(recording, values, ratios, monitor.verdict, own_threshold.level if own_threshold else None)
