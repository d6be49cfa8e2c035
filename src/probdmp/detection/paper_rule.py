"""The paper's rule: the least log-likelihood of the training demonstrations, doubled, for each primitive by itself.

Source: Meier & Schaal 2016, "Failure Detection with Probabilistic DMPs".
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from probdmp.checks import check_array, check_choice
from probdmp.demonstrations import Demonstration
from probdmp.detection.library import Library
from probdmp.detection.monitoring import LikelihoodMonitor, LikelihoodStatistic, replay
from probdmp.detection.statistics import LIKELIHOODS
from probdmp.detection.thresholds import PaperThreshold
from probdmp.dmp import Primitive, Task
from probdmp.errors import InputError
from probdmp.execution import SensorArray

__all__ = ["PaperRule"]


class PaperRule:
    """A threshold on the log-likelihood of each primitive.

    Parameters
    ----------
    likelihood : a name from `LIKELIHOODS`.
    thresholds, arrays : the threshold and the sensors of each primitive, by its identity.
    """

    def __init__(self, likelihood: str, thresholds: Mapping[str, PaperThreshold], arrays: Mapping[str, SensorArray]) -> None:
        self.likelihood, self.thresholds, self.arrays = likelihood, thresholds, arrays

    @classmethod
    def fit(cls, likelihood: str, library: Library) -> "PaperRule":
        """From what every primitive was taught with."""
        check_choice(likelihood, "likelihood", LIKELIHOODS)
        thresholds = {}
        for member in library.members.values():
            minimum = np.inf
            for ticks in replay(member.primitive, member.tasks_or_own(), member.recordings, member.array):
                statistic = LikelihoodStatistic(likelihood, member.array.scales)
                minimum = min(minimum, *(statistic.update(observed)[0] for observed in ticks))
            if not np.isfinite(minimum):
                raise InputError("demonstrations of which something was measured", "only missing samples")
            thresholds[member.primitive.identity] = PaperThreshold(minimum)
        return cls(likelihood, thresholds, library.arrays)

    def monitor(self, primitive: Primitive, task: Task, dt: float) -> LikelihoodMonitor:
        """A fresh judge for one execution."""
        identity = primitive.identity
        return LikelihoodMonitor(self.arrays[identity], self.likelihood, self.thresholds[identity])

    def replay(
        self, primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration]
    ) -> Iterator[tuple[LikelihoodMonitor, Iterator[Any]]]:
        """For each recording, a judge and what an execution would have shown it."""
        replayed = replay(primitive, tasks, recordings, self.arrays[primitive.identity])
        for task, recording, ticks in zip(tasks, recordings, replayed, strict=True):
            yield self.monitor(primitive, task, recording.dt), ticks

    def watched(self, primitive: Primitive) -> tuple[str, ...]:
        """Names of what is judged: the outputs of the sensors."""
        return self.arrays[primitive.identity].outputs

    def judge(self, primitive: Primitive, tasks: Task, recorded: object) -> None:
        """Recordings are not judged side by side: the filter has to be asked."""
        return

    def state(self) -> dict[str, Any]:
        """Plain values."""
        return {"likelihood": self.likelihood, "minima": {i: t.minimum for i, t in self.thresholds.items()}}

    @classmethod
    def from_state(
        cls, state: Mapping[str, Any], primitives: Mapping[str, Primitive], arrays: Mapping[str, SensorArray]
    ) -> "PaperRule":
        """The rule again."""
        minima = state.get("minima")
        if set(state) != {"likelihood", "minima"} or not isinstance(minima, Mapping):
            raise InputError("a detector with a likelihood and minima", f"{state!r:.200}")
        if set(minima) != {primitive.identity for primitive in primitives.values()}:
            raise InputError("a minimum for each primitive", f"{minima!r:.200}")
        return cls(
            check_choice(state["likelihood"], "likelihood", LIKELIHOODS),
            {identity: PaperThreshold(float(check_array(m, "minimum", ()))) for identity, m in minima.items()},
            arrays,
        )
