"""Detection at a chosen rate of false alarms: any statistic, its threshold from executions that taught the primitive nothing.

Executions that are told their goal and duration and executions that are not differ in what is normal, so there is a
calibration for each. Unless tasks are given, both are made, from demonstrations that are told where they end, or not.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, fields
from functools import cached_property
from typing import Any, Protocol, Self

import numpy as np

from probdmp.checks import FloatArray, check_array
from probdmp.demonstrations import Demonstration
from probdmp.detection.calibrated_monitor import CalibratedMonitor
from probdmp.detection.calibration import Calibration
from probdmp.detection.calibration_facts import CalibrationFacts, facts_of
from probdmp.detection.innovation_family import InnovationFamily
from probdmp.detection.judgement import Standard, Verdicts, joined
from probdmp.detection.library import Library, Member, own_tasks
from probdmp.detection.options import DetectorOptions
from probdmp.detection.recorded_signals import RecordedSignals
from probdmp.detection.sources import Source
from probdmp.detection.trajectory_family import TrajectoryFamily, tells_goal
from probdmp.dmp import Primitive, Task
from probdmp.errors import InputError, TooFewDemonstrationsError
from probdmp.execution import Observed, SensorArray, task_of_recording

__all__ = ["CalibratedRule"]

MODES = {True: "known", False: "nominal"}
"""By whether an execution is told its goal."""
POOLED = ""
"""Stands for the whole library where primitives share a threshold."""


class Family(Protocol):
    """A statistic at work on a library."""

    @property
    def channels(self) -> tuple[str, ...]: ...
    @property
    def floors(self) -> FloatArray: ...
    @property
    def handicaps(self) -> FloatArray: ...
    def source(self, primitive: Primitive, task: Task, dt: float) -> Source: ...
    def replay(
        self, primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration]
    ) -> Iterator[tuple[Source, Iterator[Observed]]]: ...
    def left_out_maxima(self, member: Member, tasks: Sequence[Task]) -> FloatArray: ...
    def maxima(self, member: Member, tasks: Sequence[Task]) -> FloatArray: ...
    def watched(self, primitive: Primitive) -> tuple[str, ...]: ...
    def state(self) -> dict[str, Any]: ...


class CalibratedRule:
    """A statistic and its calibrations.

    Parameters
    ----------
    family : the statistic.
    labels : label of each primitive by its identity.
    calibrations : by whether the goal is told, then by label, or `POOLED`.
    """

    def __init__(
        self,
        options: DetectorOptions,
        family: Family,
        primitives: Mapping[str, Primitive],
        calibrations: Mapping[bool, Mapping[str, Calibration]],
    ) -> None:
        self.options, self.family, self.calibrations = options, family, calibrations
        self._labels = {primitive.identity: label for label, primitive in primitives.items()}
        self._primitives = primitives

    @classmethod
    def fit(cls, options: DetectorOptions, library: Library, on_part: Callable[[str, int], None]) -> Self:
        """Calibrate on the recordings of the library; `on_part` is told after each part, with the number of all."""
        family: Family
        if options.statistic == "trajectory":
            family = TrajectoryFamily.fit(library)
        else:
            family = InnovationFamily(options.statistic, library.arrays)
        primitives = {label: member.primitive for label, member in library.members.items()}
        told = {
            knows_goal: {label: _tasks(member, knows_goal) for label, member in library.members.items()}
            for knows_goal in (True, False)
        }
        told = {knows_goal: tasks for knows_goal, tasks in told.items() if all(tasks.values())}
        if not told:
            raise InputError("tasks that all tell the goal, or that all do not", "some of each")
        n_parts = len(told) * len(primitives)
        calibrations = {
            knows_goal: _calibrate(options, family, library, tasks, lambda label: on_part(label, n_parts))
            for knows_goal, tasks in told.items()
        }
        return cls(options, family, primitives, calibrations)

    def calibration(self, primitive: Primitive, task: Task) -> Calibration:
        """What is normal for an execution."""
        return self._calibration(primitive, tells_goal(task))

    def _calibration(self, primitive: Primitive, knows_goal: bool) -> Calibration:
        by_label = self.calibrations.get(knows_goal)
        if by_label is None:
            told, other = ("tell", "do not") if knows_goal else ("do not tell", "do")
            raise InputError(
                f"a detector calibrated on executions that {told} their goal",
                f"one calibrated on executions that {other}",
                "Fit it without tasks, for both, or give the tasks that executions will have.",
            )
        return by_label[POOLED if self.options.pooled else self._labels[primitive.identity]]

    @cached_property
    def facts(self) -> tuple[CalibrationFacts, ...]:
        """Of every calibration."""
        return tuple(
            facts_of(calibration, MODES[knows_goal], label)
            for knows_goal, by_label in self.calibrations.items()
            for label, calibration in by_label.items()
        )

    def monitor(self, primitive: Primitive, task: Task, dt: float) -> CalibratedMonitor:
        """A fresh judge for one execution."""
        return self._monitor(primitive, task, self.family.source(primitive, task, dt))

    def replay(
        self, primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration]
    ) -> Iterator[tuple[CalibratedMonitor, Iterator[Observed]]]:
        """For each recording, a judge and what an execution would have shown it."""
        for task, (source, ticks) in zip(tasks, self.family.replay(primitive, tasks, recordings), strict=True):
            yield self._monitor(primitive, task, source), ticks

    def watched(self, primitive: Primitive) -> tuple[str, ...]:
        """Names of what is judged."""
        return self.family.watched(primitive)

    def judge(self, primitive: Primitive, tasks: Task, recorded: Callable[[], RecordedSignals]) -> Verdicts | None:
        """Verdicts on recordings side by side, where the statistic can do that.

        Parameters
        ----------
        tasks : with the batch axis (N).
        """
        if not isinstance(self.family, TrajectoryFamily) or not self.family.judges_recordings(primitive):
            return None
        told, label = ~np.isnan(tasks.goal).any(axis=1), self._labels[primitive.identity]
        standards = {}
        for knows_goal in (True, False):
            some = np.flatnonzero(told == knows_goal)
            if len(some):
                calibration = self._calibration(primitive, knows_goal)
                threshold = calibration.threshold_for(label)
                standards[knows_goal] = Standard(calibration, threshold, self.options.persistence, self.family.channels)
        return joined(self.family.judge(primitive, tasks, standards, recorded()))

    def state(self) -> dict[str, Any]:
        """Plain values."""
        calibrations = {
            MODES[knows_goal]: {label: {"maxima": c.maxima.tolist(), "labels": list(c.labels)} for label, c in by_label.items()}
            for knows_goal, by_label in self.calibrations.items()
        }
        return {"options": asdict(self.options), "family": self.family.state(), "calibrations": calibrations}

    @classmethod
    def from_state(
        cls, state: Mapping[str, Any], primitives: Mapping[str, Primitive], arrays: Mapping[str, SensorArray]
    ) -> Self:
        """The rule again.

        Raises
        ------
        InputError, InputTypeError
            If the state is not one, or that of a detector for other primitives.
        """
        try:
            _check_keys(state, ("options", "family", "calibrations"))
            _check_keys(state["options"], [field.name for field in fields(DetectorOptions)])
            options = DetectorOptions(**state["options"])
            family: Family
            identities = [primitive.identity for primitive in primitives.values()]
            _check_keys(state["family"], identities if options.statistic == "trajectory" else ())
            if options.statistic == "trajectory":
                family = TrajectoryFamily.from_state(state["family"], primitives, arrays)
            else:
                family = InnovationFamily(options.statistic, arrays)
            modes = {knows_goal: mode for knows_goal, mode in MODES.items() if mode in state["calibrations"]}
            _check_keys(state["calibrations"], modes.values() or MODES.values())
            calibrations = {}
            for knows_goal, mode in modes.items():
                by_label = state["calibrations"][mode]
                _check_keys(by_label, (POOLED,) if options.pooled else primitives)
                calibrations[knows_goal] = {
                    label: _restored(values, options, family, primitives if options.pooled else (label,))
                    for label, values in by_label.items()
                }
        except (KeyError, TypeError, AttributeError) as error:
            raise InputError("a calibrated detector for these primitives", f"{type(error).__name__}: {error}") from error
        return cls(options, family, primitives, calibrations)

    def _monitor(self, primitive: Primitive, task: Task, source: Source) -> CalibratedMonitor:
        calibration = self.calibration(primitive, task)
        label, channels = self._labels[primitive.identity], self.family.channels
        return CalibratedMonitor(source, calibration, label, channels, self.watched(primitive), self.options.persistence)


def _tasks(member: Member, knows_goal: bool) -> list[Task]:
    """Tasks of the recordings if they tell, or do not tell, the goal; none otherwise."""
    if member.tasks is not None:
        agree = all(tells_goal(task) == knows_goal for task in member.tasks)
        return list(member.tasks) if agree else []
    untold = own_tasks(member.primitive, member.recordings)  # which refuses recordings of another kind
    if not knows_goal:
        return untold
    unseen = np.any([np.isnan(recording.positions).all(axis=0) for recording in member.recordings], axis=0)
    if np.any(unseen & member.array.measured[: len(unseen)]):
        raise InputError("recordings of which every degree of freedom was measured", "one of which one was not")
    if unseen.any():  # where they end is not measured by any sensor, so nothing is known of executions that are told
        return []
    return [task_of_recording(member.primitive, r, goal=_last_seen(r)) for r in member.recordings]


def _last_seen(recording: Demonstration) -> FloatArray:
    """Where a recording ends, (D,) array."""
    return np.array([column[~np.isnan(column)][-1] for column in recording.positions.T])


def _calibrate(
    options: DetectorOptions,
    family: Family,
    library: Library,
    tasks: Mapping[str, Sequence[Task]],
    done: Callable[[str], None],
) -> dict[str, Calibration]:
    """Calibrations by label, or one for all; `done` is told each label."""
    for label, member in library.members.items():
        if options.calibration == "leave_one_out" and len(member.recordings) < 2:
            hint = 'Record more, or give others with calibration="held_out".'
            raise TooFewDemonstrationsError("two or more demonstrations to leave one out", f"one of {label!r}", hint)
    judge = family.left_out_maxima if options.calibration == "leave_one_out" else family.maxima
    labels = list(library.members)
    # One after another: the linear algebra has threads of its own, and more of them get in each other's way.
    found = []
    for label in labels:
        found.append(judge(library.members[label], tasks[label]))
        done(label)
    maxima = dict(zip(labels, found, strict=True))
    of_each = {label: [label] * len(values) for label, values in maxima.items()}
    if not options.pooled:
        return {label: _calibration(maxima[label], of_each[label], options, family) for label in labels}
    return {POOLED: _calibration(np.concatenate(found), [name for label in labels for name in of_each[label]], options, family)}


def _calibration(maxima: FloatArray, labels: Sequence[str], options: DetectorOptions, family: Family) -> Calibration:
    rate, method = options.false_alarm_rate, options.calibration
    return Calibration(maxima, labels, rate, method, family.floors, family.handicaps)


def _restored(values: Mapping[str, Any], options: DetectorOptions, family: Family, expected: Collection[str]) -> Calibration:
    """A calibration on executions of the expected primitives."""
    _check_keys(values, ("maxima", "labels"))
    labels = values["labels"]
    if not isinstance(labels, list) or not all(isinstance(label, str) for label in labels) or set(labels) != set(expected):
        raise InputError(f"labels of calibration executions, out of {sorted(expected)}", f"{labels!r:.200}")
    maxima = check_array(values["maxima"], "maxima", (len(labels), len(family.channels)))
    return _calibration(maxima, labels, options, family)


def _check_keys(state: Mapping[str, Any], expected: Iterable[str]) -> None:
    if set(state) != set(expected):
        raise InputError(f"a calibrated detector with {', '.join(map(repr, expected)) or 'nothing more'}", f"{state!r:.200}")
