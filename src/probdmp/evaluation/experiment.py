"""The paper's experiment, on any labelled demonstrations.

For every class: draw training demonstrations, learn a primitive, store the detector's threshold; draw test demonstrations,
judge each as recorded and with a fault injected at a random onset in 30 to 70 % of the movement.
Source: Meier & Schaal 2016, "Failure Detection with Probabilistic DMPs".
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, TypeVar

import numpy as np

from probdmp.checks import check_choice, check_count
from probdmp.demonstrations import FAULTS, Demonstration
from probdmp.detection import FailureDetector, Verdict
from probdmp.dmp import PUBLISHED, Configuration, Primitive, Task, task_for
from probdmp.errors import TooFewDemonstrationsError
from probdmp.evaluation.outcomes import READINGS, Outcome, Reading, Summary, published_summary, summarize
from probdmp.learning import LearningOptions, fit_primitive

__all__ = ["DETECTORS", "TASKS", "Evaluation", "Experiment", "Trial", "draw_trial", "evaluate", "group_by_label"]

DETECTORS = ("paper",)
TASKS = ("known", "nominal")
ONSETS = (0.3, 0.7)
"""Faults begin in this part of the movement."""


@dataclass(frozen=True, slots=True)
class Experiment:
    """What is run."""

    train: int = 10
    """Demonstrations per class that teach the primitive."""
    test: int = 10
    """Other demonstrations per class that are judged."""
    seed: int = 0
    """Decides the split, the onsets and the noise of the faults; each class draws independently of the others."""
    detector: str = "paper"
    """`"paper"`: the paper's rule, in all its readings."""
    task: str = "known"
    """`"known"`: start, goal and duration of each execution are commanded (the paper); `"nominal"`: only the start is, goal
    and duration are as learned."""
    faults: tuple[str, ...] = ("hold",)
    """Names from `probdmp.demonstrations.FAULTS`."""
    configuration: Configuration = PUBLISHED
    """How primitives are made; the paper's unless given. The forcing noise is that of each reading."""

    def __post_init__(self) -> None:
        for name in ("train", "test"):
            check_count(getattr(self, name), name)
        check_count(self.seed, "seed", least=0)
        check_choice(self.detector, "detector", DETECTORS)
        check_choice(self.task, "task", TASKS)
        for fault in self.faults:
            check_choice(fault, "fault", FAULTS)


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """What came of it."""

    experiment: Experiment
    outcomes: Mapping[Reading, Sequence[Outcome]]
    """By reading, one entry per test execution."""

    def as_dict(self) -> dict[str, Any]:
        """The document that `probdmp evaluate --json` prints: the first reading at the top, then all of them."""
        experiment, summaries = self.experiment, {reading: summarize(o) for reading, o in self.outcomes.items()}
        first = next(iter(summaries))
        return {
            "classes": len({outcome.label for outcome in self.outcomes[first]}),
            "train": experiment.train,
            "test": experiment.test,
            "seed": experiment.seed,
            "detector": experiment.detector,
            "task": experiment.task,
            "configuration": {k: v for k, v in asdict(experiment.configuration).items() if k != "forcing_noise"},
            **asdict(first),
            **summaries[first].as_dict(),
            "readings": [{**asdict(reading), **summary.as_dict()} for reading, summary in summaries.items()],
            "by_class": {label: _counts(o) for label, o in group_by_label(self.outcomes[first]).items()},
            "published": published_summary().as_dict(),
        }

    def summaries(self) -> dict[Reading, Summary]:
        """The figures of each reading."""
        return {reading: summarize(outcomes) for reading, outcomes in self.outcomes.items()}


def evaluate(
    demonstrations: Sequence[Demonstration],
    experiment: Experiment,
    on_class: Callable[[str], None] = lambda label: None,
) -> Evaluation:
    """Run an experiment on labelled demonstrations.

    Parameters
    ----------
    on_class : called with its label after each class, for a progress bar.

    Raises
    ------
    TooFewDemonstrationsError
        If a class has too few demonstrations; all such classes are named.
    """
    classes = _classes(demonstrations, experiment.train + experiment.test)
    outcomes: dict[Reading, list[Outcome]] = {reading: [] for reading in READINGS}
    for label, members in classes.items():
        trial = draw_trial(label, members, experiment)
        for noise in dict.fromkeys(reading.forcing_noise for reading in READINGS):
            configuration = replace(experiment.configuration, forcing_noise=noise)
            primitive, _ = fit_primitive(trial.training, configuration, LearningOptions())
            for reading in READINGS:
                if reading.forcing_noise == noise:
                    outcomes[reading] += judge_trial(trial, primitive, reading, experiment)
        on_class(label)
    return Evaluation(experiment, outcomes)


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """The executions of one class."""

    label: str
    training: list[Demonstration]
    tests: list[Demonstration]
    onsets: dict[str, list[int]]
    """By fault: sample of each test at which it begins."""
    faulty: dict[str, list[Demonstration]]
    """By fault: each test with it."""


def draw_trial(label: str, members: Sequence[Demonstration], experiment: Experiment) -> Trial:
    """Split a class and inject the faults; depends on the seed and the label alone."""
    rng = np.random.default_rng([experiment.seed, *label.encode()])
    order = rng.permutation(len(members))[: experiment.train + experiment.test]
    tests = [members[i] for i in order[experiment.train :]]
    onsets: dict[str, list[int]] = {}
    faulty: dict[str, list[Demonstration]] = {}
    for fault in experiment.faults:
        onsets[fault] = [max(1, int(rng.uniform(*ONSETS) * d.n_samples)) for d in tests]
        faulty[fault] = [
            replace(d, positions=FAULTS[fault](d.positions, onset, rng)) for d, onset in zip(tests, onsets[fault], strict=True)
        ]
    return Trial(label, [members[i] for i in order[: experiment.train]], tests, onsets, faulty)


def judge_trial(trial: Trial, primitive: Primitive, reading: Reading, experiment: Experiment) -> list[Outcome]:
    """Fit the detector on the training demonstrations, judge the tests; a faulty execution keeps its commanded task."""
    detector = FailureDetector(rule=experiment.detector, likelihood=reading.likelihood)
    detector.fit(primitive, trial.training, tasks=commanded_tasks(primitive, trial.training, experiment.task))
    tasks = commanded_tasks(primitive, trial.tests, experiment.task)
    undisturbed = detector.verdicts(trial.tests, tasks=tasks)
    disturbed = {fault: detector.verdicts(executions, tasks=tasks) for fault, executions in trial.faulty.items()}
    return [
        Outcome(
            label=trial.label,
            duration=test.duration,
            false_alarm=_alarm(undisturbed[i]),
            onsets={fault: onsets[i] * test.dt for fault, onsets in trial.onsets.items()},
            alarms={fault: _alarm(verdicts[i]) for fault, verdicts in disturbed.items()},
        )
        for i, test in enumerate(trial.tests)
    ]


def commanded_tasks(primitive: Primitive, recordings: Sequence[Demonstration], task: str) -> list[Task]:
    """What each execution was told: where it starts, and with `"known"` also where it ends and how long it takes."""
    if task == "nominal":
        return [task_for(primitive, start=r.positions[0]) for r in recordings]
    return [task_for(primitive, r.positions[0], r.positions[-1], r.duration) for r in recordings]


def _alarm(verdict: Verdict) -> float | None:
    return verdict.time if verdict.failed else None


def _classes(demonstrations: Sequence[Demonstration], needed: int) -> dict[str, list[Demonstration]]:
    classes = group_by_label(demonstrations)
    if not classes:
        raise TooFewDemonstrationsError("demonstrations", "none")
    scarce = {label: len(members) for label, members in classes.items() if len(members) < needed}
    if scarce:
        least = min(scarce.values())
        raise TooFewDemonstrationsError(
            f"at least train + test = {needed} demonstrations of every class",
            ", ".join(f"{n} of {label!r}" for label, n in scarce.items()),
            f"Ask for fewer: train = {least // 2}, test = {least - least // 2}." if least > 1 else "Leave out such classes.",
        )
    return classes


Labelled = TypeVar("Labelled", Demonstration, Outcome)


def group_by_label(items: Sequence[Labelled]) -> dict[str, list[Labelled]]:
    """Demonstrations or outcomes by label, in the order of first appearance."""
    groups: dict[str, list[Labelled]] = {}
    for item in items:
        groups.setdefault(item.label, []).append(item)
    return groups


def _counts(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    summary = summarize(outcomes)
    return {
        "n": summary.false_alarms.n,
        "false_alarms": summary.false_alarms.count,
        "detected": {fault: s.detected.count for fault, s in summary.faults.items() if s.detected is not None},
    }
