"""The executions of an experiment: who teaches, who is judged, and what is done to them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration, Fault, fault_named
from probdmp.dmp import Primitive, Task, task_for
from probdmp.errors import TooFewDemonstrationsError
from probdmp.evaluation.experiment import Experiment

__all__ = ["ONSETS", "UNDISTURBED", "Trial", "commanded_tasks", "draw_trials", "group_by_label"]

ONSETS = (0.3, 0.7)
"""Faults begin in this part of the movement."""
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
        # 256 is no byte: it keeps the label apart from the name.
        rng = np.random.default_rng([experiment.seed, *label.encode(), 256, *fault.kind.encode()])
        onsets[fault.name] = [_onset(fault, d.n_samples, rng) for d in tests]
        faulty[fault.name] = [
            replace(d, positions=fault(d.positions, onset, rng, _comparable(d, others)), channels={})
            for d, onset in zip(tests, onsets[fault.name], strict=True)
        ]
    return Trial(label, training, tests, onsets, faulty)


def _onset(fault: Fault, n_samples: int, rng: np.random.Generator) -> int:
    return 0 if fault.takes_others else max(1, int(rng.uniform(*ONSETS) * n_samples))


def _comparable(execution: Demonstration, others: Sequence[Demonstration]) -> list[FloatArray]:
    """Positions of those at the same rate with as many degrees of freedom."""
    return [o.positions for o in others if o.n_dof == execution.n_dof and math.isclose(o.dt, execution.dt, rel_tol=1e-6)]


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
