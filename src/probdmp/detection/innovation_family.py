"""Innovations of the filter as what is judged: the paper's log-likelihood and its usual relatives, calibrated."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration
from probdmp.detection.library import Member
from probdmp.detection.monitoring import replay
from probdmp.detection.sources import InnovationSource
from probdmp.dmp import Primitive, Task
from probdmp.execution import Observed, SensorArray
from probdmp.learning import LearningOptions, fit_primitive

__all__ = ["InnovationFamily"]


class InnovationFamily:
    """One statistic of single innovations.

    Parameters
    ----------
    statistic : a name from `probdmp.detection.sources.INNOVATION_STATISTICS`.
    arrays : the sensors of each primitive, by its identity.
    """

    def __init__(self, statistic: str, arrays: Mapping[str, SensorArray]) -> None:
        self.statistic, self.channels, self._arrays = statistic, (statistic,), arrays
        self.floors = self.handicaps = np.zeros(1)

    def source(self, primitive: Primitive, task: Task, dt: float) -> InnovationSource:
        """For one execution."""
        return InnovationSource(self.statistic, self._arrays[primitive.identity].scales, task, dt)

    def watched(self, primitive: Primitive) -> tuple[str, ...]:
        """Names of what is judged: the outputs of the sensors."""
        return self._arrays[primitive.identity].outputs

    def replay(
        self, primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration]
    ) -> Iterator[tuple[InnovationSource, Iterator[Observed]]]:
        """For each recording a source, and what an execution would have shown it."""
        yield from self._replay(primitive, tasks, recordings, self._arrays[primitive.identity])

    def _replay(
        self, primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration], array: SensorArray
    ) -> Iterator[tuple[InnovationSource, Iterator[Observed]]]:
        replayed = replay(primitive, tasks, recordings, array)
        for task, recording, ticks in zip(tasks, recordings, replayed, strict=True):
            yield InnovationSource(self.statistic, array.scales, task, recording.dt), ticks

    def left_out_maxima(self, member: Member, tasks: Sequence[Task]) -> FloatArray:
        """Largest value over each recording, judged by a primitive that the others teach: (K, 1) array."""
        pooled = member.primitive.variation is None
        options = LearningOptions("pooled" if pooled else "hierarchical", channels=member.primitive.channel_names)
        maxima = []
        for k in range(len(member.recordings)):
            others = [recording for i, recording in enumerate(member.recordings) if i != k]
            primitive, _ = fit_primitive(others, member.primitive.configuration, options)
            array = SensorArray(primitive, member.given_sensors)
            left_out = replace(member, primitive=primitive, recordings=[member.recordings[k]], array=array)
            maxima.append(self.maxima(left_out, [tasks[k]])[0])
        return np.stack(maxima)

    def maxima(self, member: Member, tasks: Sequence[Task]) -> FloatArray:
        """Largest value over each recording, which the primitive has not learned from: (K, 1) array."""
        largest = []
        for source, ticks in self._replay(member.primitive, tasks, member.recordings, member.array):
            values = [value for observed in ticks for value in source.update(observed)]
            largest.append(np.max(values, axis=0) if values else np.zeros(1))
        return np.stack(largest)

    def state(self) -> dict[str, Any]:
        """Nothing is learned but the thresholds."""
        return {}
