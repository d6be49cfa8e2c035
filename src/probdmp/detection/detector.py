"""Failure detectors: a statistic and a threshold for each primitive, the same online and over recordings."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import check_array, check_choice
from probdmp.demonstrations import Demonstration, Recordings, as_demonstrations
from probdmp.detection.monitoring import LikelihoodMonitor, LikelihoodStatistic, replay
from probdmp.detection.statistics import LIKELIHOODS
from probdmp.detection.thresholds import PaperThreshold
from probdmp.detection.verdict import Verdict
from probdmp.dmp import Primitive, Task
from probdmp.errors import InputError, InputTypeError, NotFittedError
from probdmp.execution import check_tasks, task_of_recording

__all__ = ["FailureDetector"]

RULES = ("paper",)


class Learned(Protocol):
    """Something that holds a learned primitive, such as a ProbabilisticDMP."""

    @property
    def primitive_(self) -> Primitive: ...


class FailureDetector:
    """Decides, while a movement runs or over its recording, whether it is still the movement that was taught.

    Parameters
    ----------
    rule : `"paper"`: failed when the log-likelihood falls below twice its minimum over the training demonstrations.
    likelihood : `"per_step"`: of each step by itself; `"cumulative"`: of all steps so far. The paper does not say which.
    """

    def __init__(self, *, rule: str = "paper", likelihood: str = "per_step") -> None:
        self.rule, self.likelihood = rule, likelihood

    def fit(
        self,
        learned: Primitive | Learned | Mapping[str, Learned],
        demonstrations: Recordings | Mapping[str, Recordings],
        dt: float | None = None,
        tasks: Sequence[Task] | Mapping[str, Sequence[Task]] | None = None,
    ) -> Self:
        """Learn what is normal from the demonstrations that taught a primitive.

        Parameters
        ----------
        learned : a learned primitive, or a library of them by label; demonstrations and tasks then come by label too.
        dt : seconds between samples of bare arrays; as learned unless given.
        tasks : what each demonstration was asked to do. Unless given, to start at its own first row and to reach the learned
            goal in the learned time: what `execute(start=…)` knows. Say as much as will be known when executing, for the
            detector takes the spread it is shown for normal.
        """
        check_choice(self.rule, "rule", RULES)
        check_choice(self.likelihood, "likelihood", LIKELIHOODS)
        library = learned if isinstance(learned, Mapping) else {"": learned}
        recordings = _by_label(demonstrations, library, "demonstrations")
        asked = _by_label(tasks, library, "tasks") if tasks is not None else dict.fromkeys(library)
        primitives = {label: _primitive_of(item) for label, item in library.items()}
        self.thresholds_ = {
            primitive.identity: self._threshold(primitive, recordings[label], dt, asked[label])
            for label, primitive in primitives.items()
        }
        self.primitives_ = primitives
        return self

    def monitor(self, primitive: Primitive) -> LikelihoodMonitor:
        """A fresh judge for one execution of a primitive, which the detector must have been fitted to."""
        threshold = self._fitted_thresholds().get(primitive.identity)
        if threshold is None:
            raise InputError(
                "a primitive that this detector was fitted to", "another one", "Learned anew? Fit the detector again too."
            )
        return LikelihoodMonitor(primitive, self.likelihood, threshold)

    def verdicts(self, executions: Recordings, dt: float | None = None, tasks: Sequence[Task] | None = None) -> list[Verdict]:
        """A verdict for each recorded execution; with a library, the label of an execution says which primitive it runs.

        Parameters
        ----------
        dt, tasks : as in `fit`, one task for each execution.
        """
        self._fitted_thresholds()
        dts = {primitive.dt for primitive in self.primitives_.values()}
        recordings = as_demonstrations(executions, dts.pop() if dt is None and len(dts) == 1 else dt)
        if tasks is not None:
            check_tasks(tasks, recordings)
        verdicts: dict[int, Verdict] = {}
        for label, members in self._members(recordings).items():
            primitive, chosen = self.primitives_[label], [recordings[k] for k in members]
            asked = [tasks[k] for k in members] if tasks is not None else _own_tasks(primitive, chosen)
            for k, ticks in zip(members, replay(primitive, asked, chosen), strict=True):
                monitor = self.monitor(primitive)
                for observed in ticks:
                    monitor.update(observed)
                verdicts[k] = monitor.verdict
        return [verdicts[k] for k in range(len(recordings))]

    def predict(
        self, executions: Recordings, dt: float | None = None, tasks: Sequence[Task] | None = None
    ) -> NDArray[np.int64]:
        """(N,) array: +1 for a fine execution, -1 for a failed one; arguments as in `verdicts`."""
        return np.array([-1 if verdict.failed else 1 for verdict in self.verdicts(executions, dt, tasks)], dtype=np.int64)

    def state(self) -> dict[str, Any]:
        """What a model file keeps, as plain values."""
        minima = {identity: threshold.minimum for identity, threshold in self._fitted_thresholds().items()}
        return {"rule": self.rule, "likelihood": self.likelihood, "minima": minima}

    @classmethod
    def from_state(cls, state: object, primitives: Mapping[str, Primitive]) -> Self:
        """A fitted detector from its state and the primitives it was fitted to, by label.

        Raises
        ------
        InputError, InputTypeError
            If the state is not one, or that of a detector for other primitives.
        """
        if not isinstance(state, Mapping):
            raise InputTypeError("the state of a detector as a mapping", f"{state!r:.100}")
        identities = {primitive.identity for primitive in primitives.values()}
        complete = set(state) == {"rule", "likelihood", "minima"} and isinstance(state["minima"], Mapping)
        if not complete or set(state["minima"]) != identities:
            raise InputError("a detector with rule, likelihood and a minimum for each primitive", f"{state!r:.200}")
        detector = cls(
            rule=check_choice(state["rule"], "rule", RULES),
            likelihood=check_choice(state["likelihood"], "likelihood", LIKELIHOODS),
        )
        minima = {identity: float(check_array(minimum, "minimum", ())) for identity, minimum in state["minima"].items()}
        detector.primitives_ = dict(primitives)
        detector.thresholds_ = {identity: PaperThreshold(minimum) for identity, minimum in minima.items()}
        return detector

    def _fitted_thresholds(self) -> dict[str, PaperThreshold]:
        if not hasattr(self, "thresholds_"):
            raise NotFittedError("a fitted detector", "one without thresholds", "Call fit(primitive, demonstrations) first.")
        return self.thresholds_

    def _members(self, recordings: Sequence[Demonstration]) -> dict[str, list[int]]:
        """Which recordings are executions of which primitive; one that is alone needs no label."""
        alone = next(iter(self.primitives_)) if len(self.primitives_) == 1 else None
        members: dict[str, list[int]] = {}
        for k, recording in enumerate(recordings):
            label = alone if alone is not None and "" in (alone, recording.label) else recording.label
            if label not in self.primitives_:
                raise InputError(f"executions labelled as one of {sorted(self.primitives_)}", repr(label))
            members.setdefault(label, []).append(k)
        return members

    def _threshold(
        self, primitive: Primitive, demonstrations: Recordings, dt: float | None, tasks: Sequence[Task] | None
    ) -> PaperThreshold:
        recordings = as_demonstrations(demonstrations, primitive.dt if dt is None else dt)
        minimum = np.inf
        asked = _own_tasks(primitive, recordings) if tasks is None else check_tasks(tasks, recordings)
        for ticks in replay(primitive, asked, recordings):
            statistic = LikelihoodStatistic(self.likelihood, primitive.ranges)
            minimum = min(minimum, *(statistic.update(observed)[0] for observed in ticks))
        if not np.isfinite(minimum):
            raise InputError("demonstrations of which something was measured", "only missing samples")
        return PaperThreshold(minimum)


def _primitive_of(learned: Primitive | Learned) -> Primitive:
    primitive = learned if isinstance(learned, Primitive) else getattr(learned, "primitive_", None)
    if not isinstance(primitive, Primitive):
        raise NotFittedError("a learned primitive", f"{learned!r:.100}", "Call fit(demonstrations) first.")
    return primitive


def _own_tasks(primitive: Primitive, recordings: Sequence[Demonstration]) -> list[Task]:
    return [task_of_recording(primitive, recording, duration=primitive.duration) for recording in recordings]


def _by_label(values: Any, library: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """Values given for one primitive or by label, by label."""
    if set(library) == {""} and not isinstance(values, Mapping):
        return {"": values}
    if not isinstance(values, Mapping) or not set(library) <= set(values):
        given = sorted(values) if isinstance(values, Mapping) else type(values).__name__
        raise InputError(f"{name} by label for each of {sorted(library)}", str(given))
    return values
