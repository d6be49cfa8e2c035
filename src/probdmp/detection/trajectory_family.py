"""The trajectory as what is judged: sources of its channels for executions and recordings, and what is normal of them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration
from probdmp.detection.comparison import Comparison
from probdmp.detection.execution_ticks import ticks_of_recording
from probdmp.detection.library import Library, Member
from probdmp.detection.path_model import path_model
from probdmp.detection.profile import ExecutionProfile
from probdmp.detection.trajectory_model import CHANNELS, FLOORS, HANDICAPS, TrajectoryModel
from probdmp.detection.trajectory_source import Expectation, TrajectorySource
from probdmp.dmp import Primitive, Task, Variation
from probdmp.dmp.phase import phases_at
from probdmp.errors import InputError
from probdmp.execution import Observed
from probdmp.learning import left_out_variations

__all__ = ["TrajectoryFamily", "tells_goal"]


def tells_goal(task: Task) -> bool:
    """Whether an execution is told where it has to end, in every degree of freedom."""
    return not bool(np.isnan(task.goal).any())


class TrajectoryFamily:
    """The trajectories of a library of primitives.

    Parameters
    ----------
    primitives : by label.
    profiles : by identity of the primitive.
    """

    channels, floors, handicaps = CHANNELS, FLOORS, HANDICAPS

    def __init__(self, primitives: Mapping[str, Primitive], profiles: Mapping[str, ExecutionProfile]) -> None:
        self.profiles = profiles
        self._others = Comparison(primitives, profiles)
        self._expectations: dict[tuple[str, bool], Expectation] = {}
        self._left_out: dict[str, list[Variation]] = {}

    @classmethod
    def fit(cls, library: Library) -> Self:
        """From the recordings of every primitive."""
        for label, member in library.members.items():
            if member.primitive.variation is None:
                raise InputError(
                    "primitives that know how executions vary",
                    f"{label!r} with pooled weights" if label else "pooled weights",
                    'Learn with weight_model="hierarchical", or use rule="paper" or statistic="nis".',
                )
        profiles = {m.primitive.identity: ExecutionProfile.of(m.recordings) for m in library.members.values()}
        return cls({label: member.primitive for label, member in library.members.items()}, profiles)

    def source(self, primitive: Primitive, task: Task, dt: float) -> TrajectorySource:
        """For one execution."""
        return TrajectorySource(self._expectation(primitive, tells_goal(task)), task, dt)

    def replay(
        self, primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration]
    ) -> Iterator[tuple[TrajectorySource, Iterator[Observed]]]:
        """For each recording a source, whose values are computed side by side, and what it is to be shown."""
        profile = self.profiles[primitive.identity]
        ticks = [ticks_of_recording(primitive, profile, *pair) for pair in zip(tasks, recordings, strict=True)]
        values: list[FloatArray] = [np.empty(0)] * len(ticks)
        for knows_goal in {tells_goal(task) for task in tasks}:
            chosen = [k for k, task in enumerate(tasks) if tells_goal(task) == knows_goal]
            trajectory = self._expectation(primitive, knows_goal).trajectory
            for k, value in zip(chosen, values_of(trajectory, [ticks[k] for k in chosen]), strict=True):
                values[k] = value
        for task, recording, value in zip(tasks, recordings, values, strict=True):
            source = TrajectorySource(self._expectation(primitive, tells_goal(task)), task, recording.dt, value)
            yield source, _observations(recording, task)

    def left_out_maxima(self, member: Member, tasks: Sequence[Task]) -> FloatArray:
        """Largest value of every channel over each recording, judged by what the others teach: (K, C) array."""
        primitive = member.primitive
        knows_goal = tells_goal(tasks[0])
        profile = self.profiles[primitive.identity]
        maxima = []
        if primitive.identity not in self._left_out:
            self._left_out[primitive.identity] = list(left_out_variations(primitive, member.recordings))
        variations = self._left_out[primitive.identity]
        for variation, task, recording in zip(variations, tasks, member.recordings, strict=True):
            others = replace(primitive, variation=variation)
            trajectory = TrajectoryModel(path_model(others, profile, knows_goal))
            ticks = ticks_of_recording(primitive, profile, task, recording)
            maxima.append(_maxima(values_of(trajectory, [ticks])[0]))
        return np.stack(maxima)

    def maxima(self, member: Member, tasks: Sequence[Task]) -> FloatArray:
        """Largest value of every channel over each recording, which the primitive has not learned from: (K, C) array."""
        trajectory = self._expectation(member.primitive, tells_goal(tasks[0])).trajectory
        profile = self.profiles[member.primitive.identity]
        pairs = zip(tasks, member.recordings, strict=True)
        ticks = [ticks_of_recording(member.primitive, profile, *pair) for pair in pairs]
        return np.stack([_maxima(values) for values in values_of(trajectory, ticks)])

    def state(self) -> dict[str, Any]:
        """Plain values."""
        return {identity: profile.state() for identity, profile in self.profiles.items()}

    @classmethod
    def from_state(cls, state: Mapping[str, Any], primitives: Mapping[str, Primitive]) -> Self:
        """The family again."""
        found = {p.identity: ExecutionProfile.from_state(state[p.identity], p.n_dof) for p in primitives.values()}
        return cls(primitives, found)

    def _expectation(self, primitive: Primitive, knows_goal: bool) -> Expectation:
        key, profile = (primitive.identity, knows_goal), self.profiles[primitive.identity]
        if key not in self._expectations:
            trajectory = TrajectoryModel(path_model(primitive, profile, knows_goal))
            self._expectations[key] = Expectation(primitive, profile, trajectory, self._others)
        return self._expectations[key]


def values_of(trajectory: TrajectoryModel, ticks: Sequence[tuple[FloatArray, FloatArray]]) -> list[FloatArray]:
    """Channels of paths of different lengths, (T_k, C) arrays, side by side.

    Parameters
    ----------
    ticks : path (T_k, D) and goal (D,) of each execution.
    """
    longest = max(len(path) for path, _ in ticks)
    if longest == 0:
        return [np.zeros((0, len(CHANNELS))) for _ in ticks]
    # What lies beyond the end of a path is never looked at.
    paths = np.stack(
        [np.pad(path, ((0, longest - len(path)), (0, 0)), mode="edge" if len(path) else "empty") for path, _ in ticks]
    )
    values = trajectory.values(paths, np.stack([goal for _, goal in ticks]))
    return [value[: len(path)] for value, (path, _) in zip(values, ticks, strict=True)]


def _maxima(values: FloatArray) -> FloatArray:
    return np.asarray(np.max(np.nan_to_num(values), axis=0))


def _observations(recording: Demonstration, task: Task) -> Iterator[Observed]:
    """What the trajectory is judged by; the filter is not asked."""
    nothing = np.full(recording.n_dof, np.nan)
    phases = phases_at(recording.times, task.duration)
    for t, (row, phase) in enumerate(zip(recording.positions, phases, strict=True)):
        yield Observed(t, t * recording.dt, float(phase), row, nothing, nothing, nothing)
