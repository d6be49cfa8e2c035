"""From a method to a judge of `probdmp.evaluation`: left-out scores of every class, one threshold, traces.

This is the seam at which detectors join the comparison. Any `probdmp.evaluation.Judge` that keeps traces does; one that
calibrates itself, such as those in `probdmp.evaluation.DETECTORS`, needs nothing from here.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed

from baselines.alignment import Command, commands_for
from baselines.array_types import FloatArray
from baselines.calibration import Standardization, threshold_for
from baselines.method import Method
from probdmp import Demonstration
from probdmp.evaluation import Assessment, Experiment, Finding, Judge, Outcome, Trace, Trial, outcomes_of
from probdmp.evaluation.judges import Progress

__all__ = ["judge_by"]


def judge_by(make: Callable[[], Method], alpha: float, jobs: int = 1) -> Judge:
    """A judge that learns each class alone and calibrates on left-out training demonstrations of all classes.

    Parameters
    ----------
    make : a new method, not yet learned; to be pickled where `jobs` is above 1.
    alpha : false alarms per execution, as a fraction.
    jobs : classes that are learned at the same time.
    """

    def judge(trials: Sequence[Trial], experiment: Experiment, on_class: Progress) -> Assessment:
        tasks = (delayed(_raw_traces)(make, trial, experiment.task) for trial in trials)
        raw = []
        for trial, traces in zip(trials, Parallel(n_jobs=jobs, return_as="generator")(tasks), strict=True):
            raw.append(traces)
            on_class(trial.label)
        standardization = Standardization.fit({trial.label: r.left_out for trial, r in zip(trials, raw, strict=True)})
        pooled = [standardization.apply(trial.label, r.left_out) for trial, r in zip(trials, raw, strict=True)]
        threshold = threshold_for(np.concatenate(pooled), alpha)
        outcomes: list[Outcome] = []
        for trial, traces in zip(trials, raw, strict=True):
            findings = {
                name: [
                    _finding(execution, standardization.apply(trial.label, statistics) / threshold, experiment.traces)
                    for execution, statistics in zip(executions, traces.tests[name], strict=True)
                ]
                for name, executions in trial.executions.items()
            }
            outcomes += outcomes_of(trial, findings)
        return Assessment(outcomes)

    return judge


@dataclass(frozen=True, slots=True, eq=False)
class _RawTraces:
    left_out: FloatArray
    """(K, C) array: largest value of each statistic for each training demonstration, by a model learned without it."""
    tests: dict[str, list[FloatArray]]
    """(T, C) arrays by name, as in `Trial.executions`."""


def _raw_traces(make: Callable[[], Method], trial: Trial, task: str) -> _RawTraces:
    told = commands_for(trial.training, task)
    left_out = _left_out_scores(make, trial.training, told)
    method = make().fit(trial.training, told)
    # A faulty execution keeps the command of the undisturbed one.
    commands = commands_for(trial.tests, task)
    return _RawTraces(
        left_out,
        {
            name: [method.trace(execution, command) for execution, command in zip(executions, commands, strict=True)]
            for name, executions in trial.executions.items()
        },
    )


def _left_out_scores(make: Callable[[], Method], training: Sequence[Demonstration], commands: Sequence[Command]) -> FloatArray:
    n = len(training)
    part_of = np.arange(n) % (make().folds or n)
    scores: list[FloatArray] = [np.empty(0)] * n
    for part in np.unique(part_of):
        kept = np.flatnonzero(part_of != part).tolist()
        method = make().fit([training[k] for k in kept], [commands[k] for k in kept])
        for k in np.flatnonzero(part_of == part).tolist():
            scores[k] = method.trace(training[k], commands[k]).max(axis=0)
    return np.stack(scores)


def _finding(execution: Demonstration, test_ratios: FloatArray, keep: bool) -> Finding:
    above = test_ratios > 1
    alarm = float(execution.times[np.argmax(above)]) if above.any() else None
    return Finding(alarm, trace=Trace(execution.times, test_ratios) if keep else None)
