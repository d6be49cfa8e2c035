"""The executions of an experiment: who teaches, who is judged, and what is done to them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from probdmp.demonstrations import ONSETS, Demonstration, fault_generator, fault_named, perturb_executions
from probdmp.dmp import Primitive, Task, task_for
from probdmp.errors import TooFewDemonstrationsError
from probdmp.evaluation.experiment import Experiment

__all__ = ["ONSETS", "UNDISTURBED", "Trial", "commanded_tasks", "draw_trials", "group_by_label"]

UNDISTURBED = "undisturbed"
"""Under this name the executions as recorded stand beside those with faults."""

Split = tuple[list[Demonstration], list[Demonstration]]
"""Training and test demonstrations."""


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """The executions of one class."""

    label: str
    training: list[Demonstration]
    tests: list[Demonstration]
    onsets: dict[str, list[int]]
    """By fault: first sample of each test that has it."""
    faulty: dict[str, list[Demonstration]]
    """By fault: each test with it."""

    @property
    def executions(self) -> dict[str, list[Demonstration]]:
        """All that is to be judged: `UNDISTURBED`, then each fault; one execution for each test, in the same order."""
        return {UNDISTURBED: self.tests, **self.faulty}


def draw_trials(demonstrations: Sequence[Demonstration], experiment: Experiment) -> list[Trial]:
    """Split every class and inject the faults, one trial for each class in the order of first appearance.

    A class draws by the seed and its label alone, each fault of it by its name as well: neither other classes nor other faults
    change what is drawn. Only `wrong_class` depends on the others, whose test demonstrations it takes. One seed, that of the
    experiment, is drawn.

    Raises
    ------
    TooFewDemonstrationsError
        If a class has too few demonstrations, and all such classes are named; or if a fault needs another class.
    """
    classes = _classes(demonstrations, experiment.train + experiment.test)
    splits = {label: _split(label, members, experiment) for label, members in classes.items()}
    return [_draw(label, splits, experiment) for label in splits]


def commanded_tasks(primitive: Primitive, recordings: Sequence[Demonstration], task: str) -> list[Task]:
    """What each execution was told: where it starts, and with `"known"` also where it ends and how long it takes.

    Parameters
    ----------
    recordings : as recorded; an execution with a fault keeps the task of the one it was made from.
    """
    if task == "nominal":
        return [task_for(primitive, start=r.positions[0]) for r in recordings]
    return [task_for(primitive, r.positions[0], r.positions[-1], r.duration) for r in recordings]


def _split(label: str, members: Sequence[Demonstration], experiment: Experiment) -> Split:
    rng = np.random.default_rng([experiment.seed, *label.encode()])
    order = rng.permutation(len(members))[: experiment.train + experiment.test]
    return [members[i] for i in order[: experiment.train]], [members[i] for i in order[experiment.train :]]


def _draw(label: str, splits: Mapping[str, Split], experiment: Experiment) -> Trial:
    training, tests = splits[label]
    others = [d for other in sorted(set(splits) - {label}) for d in splits[other][1]]
    onsets: dict[str, list[int]] = {}
    faulty: dict[str, list[Demonstration]] = {}
    for fault in map(fault_named, experiment.faults):
        rng = fault_generator(experiment.seed, label, fault)
        faulty[fault.name], onsets[fault.name] = perturb_executions(fault, tests, others, rng)
    return Trial(label, training, tests, onsets, faulty)


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


class _HasLabel(Protocol):
    @property
    def label(self) -> str: ...


Labelled = TypeVar("Labelled", bound=_HasLabel)


def group_by_label(items: Sequence[Labelled]) -> dict[str, list[Labelled]]:
    """Demonstrations or outcomes by label, in the order of first appearance."""
    groups: dict[str, list[Labelled]] = {}
    for item in items:
        groups.setdefault(item.label, []).append(item)
    return groups
