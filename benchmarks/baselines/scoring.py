"""From trials to scores: the seam at which any detector joins the comparison.

A scorer gets all trials of one seed and returns one trace for each execution. `cross_fitted` makes a scorer of a `Method`;
a detector that calibrates itself in its own way offers a function of the same signature.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed

from baselines.alignment import Command, commands_for
from baselines.array_types import FloatArray
from baselines.calibration import Standardization
from baselines.method import Method
from probdmp import Demonstration
from probdmp.evaluation.experiment import Trial

__all__ = ["Scorer", "Scores", "cross_fitted"]


@dataclass(frozen=True, slots=True, eq=False)
class Scores:
    """What a detector said of the executions of one seed; more is worse, an execution above the threshold has failed."""

    calibration: FloatArray
    """(n,) array: largest value for each left-out training demonstration."""
    undisturbed: Sequence[FloatArray]
    """(T,) array for each test execution as recorded, trial after trial."""
    faulty: dict[str, Sequence[FloatArray]]
    """By fault, the same for the test executions with it."""


Scorer = Callable[[Sequence[Trial], str], Scores]
"""From the trials of one seed and `"known"` or `"nominal"`."""


def cross_fitted(make: Callable[[], Method], jobs: int = 1) -> Scorer:
    """A scorer that learns each class alone and calibrates on left-out demonstrations of all."""

    def scores(trials: Sequence[Trial], task: str) -> Scores:
        parts = list(Parallel(n_jobs=jobs)(delayed(_score_class)(make, trial, task) for trial in trials))
        standardization = Standardization.fit({part.label: part.left_out for part in parts})
        combined = [(part, lambda s, part=part: standardization.apply(part.label, s)) for part in parts]
        return Scores(
            calibration=np.concatenate([combine(part.left_out) for part, combine in combined]),
            undisturbed=[combine(s) for part, combine in combined for s in part.undisturbed],
            faulty={
                fault: [combine(s) for part, combine in combined for s in part.faulty[fault]] for fault in trials[0].faulty
            },
        )

    return scores


@dataclass(frozen=True, slots=True, eq=False)
class _ClassScores:
    label: str
    left_out: FloatArray
    """(K, C) array: largest value of each statistic for each training demonstration, by a model learned without it."""
    undisturbed: list[FloatArray]
    """(T, C) arrays."""
    faulty: dict[str, list[FloatArray]]


def _score_class(make: Callable[[], Method], trial: Trial, task: str) -> _ClassScores:
    method, commands = make(), commands_for(trial.tests, task)
    left_out = _left_out_scores(make, trial.training, commands_for(trial.training, task))
    method.fit(trial.training, commands_for(trial.training, task))
    return _ClassScores(
        trial.label,
        left_out,
        [method.trace(e, c) for e, c in zip(trial.tests, commands, strict=True)],
        # A faulty execution keeps the command of the undisturbed one.
        {f: [method.trace(e, c) for e, c in zip(es, commands, strict=True)] for f, es in trial.faulty.items()},
    )


def _left_out_scores(
    make: Callable[[], Method], training: Sequence[Demonstration], commands: Sequence[Command]
) -> FloatArray:
    n = len(training)
    part_of = np.arange(n) % (make().folds or n)
    scores: list[FloatArray] = [np.empty(0)] * n
    for part in np.unique(part_of):
        kept = np.flatnonzero(part_of != part)
        method = make().fit([training[k] for k in kept], [commands[k] for k in kept])
        for k in np.flatnonzero(part_of == part):
            scores[k] = method.trace(training[k], commands[k]).max(axis=0)
    return np.stack(scores)
