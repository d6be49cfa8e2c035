"""One execution of an evaluation, as recorded and with a fault, and what was said of both."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from probdmp.demonstrations import Demonstration
from probdmp.dmp import Primitive
from probdmp.evaluation.judges import shown_primitive
from probdmp.evaluation.outcomes import Finding, Outcome
from probdmp.evaluation.protocol import Evaluation
from probdmp.evaluation.trials import UNDISTURBED, commanded_tasks, draw_trials
from probdmp.execution import GaussianTrajectory, roll_out

__all__ = ["Example", "example_of"]


@dataclass(frozen=True, slots=True, eq=False)
class Example:
    """A primitive, and an execution of it as recorded and with a fault."""

    label: str
    judge: str
    """Name of the first judge, whose findings these are."""
    primitive: Primitive
    training: Sequence[Demonstration]
    rollout: GaussianTrajectory
    """For the task of the execution."""
    fault: str
    onset: float
    """Seconds at which the fault begins."""
    recordings: Mapping[str, Demonstration]
    """By name: `UNDISTURBED` and the fault."""
    findings: Mapping[str, Finding]
    """Likewise; with traces if the experiment keeps them."""


def example_of(evaluation: Evaluation, demonstrations: Sequence[Demonstration], fault: str | None = None) -> Example:
    """The first test execution of the first seed that is rightly judged both times, or the first of all if none is.

    Parameters
    ----------
    demonstrations : those that were evaluated.
    fault : one of those of the experiment; the first unless given.
    """
    seed, split = next(iter(evaluation.by_seed.items()))
    judge, judgement = next(iter(split.items()))
    experiment = replace(evaluation.experiment, seed=seed, seeds=1)
    chosen = experiment.faults[0] if fault is None else fault
    right = [_is_right(outcome, chosen) for outcome in judgement.outcomes]
    k = right.index(True) if any(right) else 0
    trial = draw_trials(demonstrations, experiment)[k // experiment.test]
    outcome, test = judgement.outcomes[k], k % experiment.test
    primitive = shown_primitive(trial, experiment)
    (task,) = commanded_tasks(primitive, [trial.tests[test]], experiment.task)
    names = (UNDISTURBED, chosen)
    return Example(
        label=trial.label,
        judge=judge,
        primitive=primitive,
        training=trial.training,
        rollout=roll_out(primitive, task, trial.tests[test].dt),
        fault=chosen,
        onset=outcome.onsets[chosen],
        recordings={name: trial.executions[name][test] for name in names},
        findings={name: outcome.findings[name] for name in names},
    )


def _is_right(outcome: Outcome, fault: str) -> bool:
    alarm = outcome.alarms[fault]
    return outcome.false_alarm is None and alarm is not None and alarm >= outcome.onsets[fault]
