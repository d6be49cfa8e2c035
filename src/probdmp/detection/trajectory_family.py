"""The trajectory as what is judged: sources of its channels for executions and recordings, and what is normal of them."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Self

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.demonstrations import Demonstration
from probdmp.detection.comparison import Comparison
from probdmp.detection.expectation import Expectation, watched_names
from probdmp.detection.innovation_watch import InnovationWatch, watched_sensors
from probdmp.detection.judgement import Standard, Verdicts, judge_recorded
from probdmp.detection.library import Library, Member
from probdmp.detection.monitoring import replay
from probdmp.detection.path_model import path_model
from probdmp.detection.profile import ExecutionProfile
from probdmp.detection.recorded_sensors import Sensing
from probdmp.detection.recorded_signals import RecordedSignals
from probdmp.detection.recorded_ticks import record_ticks
from probdmp.detection.trajectory_model import MOVEMENT_CHANNELS, TrajectoryModel, channels_for
from probdmp.detection.trajectory_source import TrajectorySource
from probdmp.dmp import Primitive, Task, stack_tasks
from probdmp.dmp.phase import phases_at
from probdmp.errors import InputError
from probdmp.execution import Observed, SensorArray, readings_of
from probdmp.learning import left_out_primitives

__all__ = ["TrajectoryFamily", "tells_goal"]


def tells_goal(task: Task) -> bool:
    """Whether an execution is told where it has to end, in every degree of freedom."""
    return not bool(np.isnan(task.goal).any())


class TrajectoryFamily:
    """The trajectories of a library of primitives.

    Parameters
    ----------
    primitives : by label.
    profiles, arrays : what demonstrations show beside the path, and the sensors, by identity of the primitive.

    Raises
    ------
    InputError
        If primitives were learned with different channels, which no common threshold fits.
    """

    def __init__(
        self,
        primitives: Mapping[str, Primitive],
        profiles: Mapping[str, ExecutionProfile],
        arrays: Mapping[str, SensorArray],
    ) -> None:
        self.profiles, self._arrays = profiles, arrays
        further = {(*p.channel_names, *watched_sensors(arrays[p.identity])) for p in primitives.values()}
        if len(further) > 1:
            hint = "Learn all of them with the same channels, or fit a detector to each."
            raise InputError("primitives with the same channels", " and ".join(map(repr, sorted(further))), hint)
        self.channels, self.floors, self.handicaps = channels_for(further.pop())
        self._others = Comparison(primitives, profiles)
        self._expectations: dict[tuple[str, bool], Expectation] = {}
        self._left_out: dict[str, list[Primitive]] = {}

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
        profiles = {
            m.primitive.identity: ExecutionProfile.of(
                m.recordings, [m.array.signals(readings_of(m.array, r)) for r in m.recordings]
            )
            for m in library.members.values()
        }
        return cls({label: member.primitive for label, member in library.members.items()}, profiles, library.arrays)

    def watched(self, primitive: Primitive) -> tuple[str, ...]:
        """Names of what is judged: positions, learned channels, outputs of other sensors."""
        return watched_names(primitive, self._arrays[primitive.identity])

    def source(self, primitive: Primitive, task: Task, dt: float) -> TrajectorySource:
        """For one execution."""
        return TrajectorySource(self._expectation(primitive, tells_goal(task)), task, dt)

    def replay(
        self, primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration]
    ) -> Iterator[tuple[TrajectorySource, Iterator[Observed]]]:
        """For each recording a source, whose values are computed side by side, and what it is to be shown."""
        profile, array = self.profiles[primitive.identity], self._arrays[primitive.identity]
        ticks = _ticks(primitive, profile, array, tasks, recordings)
        values: list[FloatArray] = [np.empty(0)] * len(ticks)
        for knows_goal in {tells_goal(task) for task in tasks}:
            chosen = [k for k, task in enumerate(tasks) if tells_goal(task) == knows_goal]
            trajectory = self._expectation(primitive, knows_goal).trajectory
            for k, value in zip(chosen, values_of(trajectory, [ticks[k] for k in chosen]), strict=True):
                values[k] = value
        shown = _observations(primitive, array, tasks, recordings)
        for task, recording, value, observed in zip(tasks, recordings, values, shown, strict=True):
            yield TrajectorySource(self._expectation(primitive, tells_goal(task)), task, recording.dt, value), observed

    def judges_recordings(self, primitive: Primitive) -> bool:
        """Whether recordings may be judged side by side: no sensor of the primitive needs the filter."""
        return not watched_sensors(self._arrays[primitive.identity])

    def judge(
        self, primitive: Primitive, tasks: Task, standards: Mapping[bool, Standard], recorded: RecordedSignals
    ) -> list[tuple[IntArray, Verdicts]]:
        """Which of the executions, and what is said of them; all of them together in parts.

        Parameters
        ----------
        tasks : with the batch axis (N).
        standards : by whether the goal is told.
        """
        profile, told = self.profiles[primitive.identity], ~np.isnan(tasks.goal).any(axis=1)
        sensing, found = Sensing(profile, primitive.signals.ranges, primitive.n_dof), []
        for knows_goal, standard in standards.items():
            expectation = self._expectation(primitive, knows_goal)
            for chosen in recorded.parts(np.flatnonzero(told == knows_goal), tasks.duration):
                some = recorded.chosen(chosen)
                durations = tasks.duration[chosen]
                ticks = record_ticks(sensing, *some[:2], tasks.goal[chosen], durations, some.dts)
                found.append((chosen, judge_recorded(expectation, standard, ticks, durations, some.dts)))
        return found

    def left_out_maxima(self, member: Member, tasks: Sequence[Task]) -> FloatArray:
        """Largest value of every channel over each recording, judged by what the others teach: (K, C) array."""
        primitive = member.primitive
        if primitive.identity not in self._left_out:
            self._left_out[primitive.identity] = list(left_out_primitives(primitive, member.recordings))
        profile, knows_goal = self.profiles[primitive.identity], tells_goal(tasks[0])
        maxima = []
        for others, task, recording in zip(self._left_out[primitive.identity], tasks, member.recordings, strict=True):
            trajectory = TrajectoryModel(path_model(others, profile, knows_goal))
            expectation = Expectation(others, profile, trajectory, self._others, SensorArray(others, member.given_sensors))
            maxima.append(_maxima(expectation, [task], [recording])[0])
        return np.stack(maxima)

    def maxima(self, member: Member, tasks: Sequence[Task]) -> FloatArray:
        """Largest value of every channel over each recording, which the primitive has not learned from: (K, C) array."""
        return _maxima(self._expectation(member.primitive, tells_goal(tasks[0])), tasks, member.recordings)

    def state(self) -> dict[str, Any]:
        """Plain values."""
        return {identity: profile.state() for identity, profile in self.profiles.items()}

    @classmethod
    def from_state(
        cls, state: Mapping[str, Any], primitives: Mapping[str, Primitive], arrays: Mapping[str, SensorArray]
    ) -> Self:
        """The family again."""
        found = {p.identity: ExecutionProfile.from_state(state[p.identity], len(p.signals.names)) for p in primitives.values()}
        return cls(primitives, found, arrays)

    def _expectation(self, primitive: Primitive, knows_goal: bool) -> Expectation:
        key, profile = (primitive.identity, knows_goal), self.profiles[primitive.identity]
        if key not in self._expectations:
            trajectory = TrajectoryModel(path_model(primitive, profile, knows_goal))
            array = self._arrays[primitive.identity]
            self._expectations[key] = Expectation(primitive, profile, trajectory, self._others, array)
        return self._expectations[key]


def values_of(trajectory: TrajectoryModel, ticks: Sequence[tuple[FloatArray, FloatArray]]) -> list[FloatArray]:
    """Channels of paths of different lengths, (T_k, C) arrays, side by side.

    Parameters
    ----------
    ticks : path (T_k, S) and goal (D,) of each execution.
    """
    longest = max(len(path) for path, _ in ticks)
    if longest == 0:
        return [np.zeros((0, len(MOVEMENT_CHANNELS) + len(trajectory.feel))) for _ in ticks]
    # What lies beyond the end of a path is never looked at.
    paths = np.stack(
        [np.pad(path, ((0, longest - len(path)), (0, 0)), mode="edge" if len(path) else "empty") for path, _ in ticks]
    )
    values = trajectory.values(paths, np.stack([goal for _, goal in ticks]))
    return [value[: len(path)] for value, (path, _) in zip(values, ticks, strict=True)]


def _maxima(expectation: Expectation, tasks: Sequence[Task], recordings: Sequence[Demonstration]) -> FloatArray:
    """Largest value of every channel over each recording, (K, C) array."""
    primitive, array = expectation.primitive, expectation.array
    ticks = _ticks(primitive, expectation.profile, array, tasks, recordings)
    values = values_of(expectation.trajectory, ticks)
    largest = np.stack([np.max(np.nan_to_num(value), axis=0, initial=0.0) for value in values])
    watches = [InnovationWatch(array, task, recording.dt) for task, recording in zip(tasks, recordings, strict=True)]
    for watch, observations in zip(watches, _observations(primitive, array, tasks, recordings), strict=True):
        for observed in observations if watched_sensors(array) else ():
            watch.update(observed)
    return np.concatenate([largest, np.nan_to_num([watch.take() for watch in watches])], axis=1)


def _ticks(
    primitive: Primitive,
    profile: ExecutionProfile,
    array: SensorArray,
    tasks: Sequence[Task],
    recordings: Sequence[Demonstration],
) -> list[tuple[FloatArray, FloatArray]]:
    """Path (T_k, S) and goal (D,) of each recording."""
    stacked, recorded = stack_tasks(tasks), RecordedSignals.of(array, recordings)
    sensing = Sensing(profile, primitive.signals.ranges, primitive.n_dof)
    ticks = record_ticks(sensing, recorded.values, recorded.lengths, stacked.goal, stacked.duration, recorded.dts)
    return [(path[:count], goal) for path, count, goal in zip(ticks.paths, ticks.counts, ticks.goals, strict=True)]


def _observations(
    primitive: Primitive, array: SensorArray, tasks: Sequence[Task], recordings: Sequence[Demonstration]
) -> Iterator[Iterator[Observed]]:
    """What the trajectory of each recording is judged by; the filter is asked only where a sensor needs it."""
    if watched_sensors(array):
        yield from replay(primitive, tasks, recordings, array)
        return
    for task, recording in zip(tasks, recordings, strict=True):
        yield _signals(recording, task, array)


def _signals(recording: Demonstration, task: Task, array: SensorArray) -> Iterator[Observed]:
    nothing = np.full(len(array.outputs), np.nan)
    phases, signals = phases_at(recording.times, task.duration), array.signals(readings_of(array, recording))
    for t, (row, phase) in enumerate(zip(signals, phases, strict=True)):
        yield Observed(t, t * recording.dt, float(phase), row, nothing, nothing, nothing)
