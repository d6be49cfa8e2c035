"""What a detector is fitted to: primitives by label, the recordings that show what is normal, and their tasks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from probdmp.demonstrations import Demonstration, Recordings, as_demonstrations
from probdmp.dmp import Primitive, Task
from probdmp.errors import InputError, NotFittedError
from probdmp.execution import Sensor, SensorArray, check_tasks, task_of_recording

__all__ = ["Learned", "Library", "Member", "own_tasks"]


class Learned(Protocol):
    """Something that holds a learned primitive, such as a ProbabilisticDMP."""

    @property
    def primitive_(self) -> Primitive: ...


@dataclass(frozen=True, slots=True, eq=False)
class Member:
    """One primitive of the library."""

    primitive: Primitive
    recordings: Sequence[Demonstration]
    tasks: Sequence[Task] | None
    """What each recording was asked to do, if that was said."""
    given_sensors: Sequence[Sensor] | None
    """What was said to observe executions, if anything was."""
    array: SensorArray
    """What has observed the recordings, and will observe executions."""
    taught_by: frozenset[str] | None = None
    """Fingerprints of the demonstrations that taught the primitive, as long as that is known."""

    def tasks_or_own(self) -> Sequence[Task]:
        """What was said, or what an execution knows that is told nothing: its own start, goal and duration as learned."""
        return own_tasks(self.primitive, self.recordings) if self.tasks is None else self.tasks


@dataclass(frozen=True, slots=True, eq=False)
class Library:
    """Primitives by label; one alone has the label that it was given, or none."""

    members: Mapping[str, Member]

    @classmethod
    def of(
        cls,
        learned: Primitive | Learned | Mapping[str, Primitive | Learned],
        demonstrations: Recordings | Mapping[str, Recordings],
        dt: float | None,
        tasks: Sequence[Task] | Mapping[str, Sequence[Task]] | None,
        sensors: Sequence[Sensor] | None,
    ) -> "Library":
        """From what `FailureDetector.fit` is given."""
        primitives = learned if isinstance(learned, Mapping) else {"": learned}
        recordings = _by_label(demonstrations, primitives, "demonstrations")
        asked = _by_label(tasks, primitives, "tasks") if tasks is not None else dict.fromkeys(primitives)
        members = {}
        for label, item in primitives.items():
            primitive = _primitive_of(item)
            chosen = as_demonstrations(recordings[label], primitive.dt if dt is None else dt)
            given = asked[label]
            taught_by = getattr(item, "taught_by_", None)
            checked = None if given is None else check_tasks(given, chosen)
            members[label] = Member(primitive, chosen, checked, sensors, SensorArray(primitive, sensors), taught_by)
        return cls(members)

    @property
    def arrays(self) -> dict[str, SensorArray]:
        """What observes each primitive, by its identity."""
        return {member.primitive.identity: member.array for member in self.members.values()}

    def check_taught(self, taught: bool) -> None:
        """Refuse recordings that should have taught the primitive and did not, or the other way round, as far as is known."""
        for label, member in self.members.items():
            if member.taught_by is None:
                continue
            known = [recording.fingerprint in member.taught_by for recording in member.recordings]
            if taught and not all(known):
                raise InputError(
                    "the demonstrations that taught the primitive",
                    f"{known.count(False)} others{f' of {label!r}' if label else ''}",
                    'To calibrate on others, use calibration="held_out".',
                )
            if not taught and any(known):
                raise InputError(
                    "demonstrations that did not teach the primitive",
                    f"{known.count(True)} that did{f' of {label!r}' if label else ''}",
                    'To calibrate on those that did, use calibration="leave_one_out".',
                )


def own_tasks(primitive: Primitive, recordings: Sequence[Demonstration]) -> list[Task]:
    """The task of an execution that is told nothing but where it starts."""
    return [task_of_recording(primitive, recording, duration=primitive.duration) for recording in recordings]


def _primitive_of(learned: Primitive | Learned) -> Primitive:
    primitive = learned if isinstance(learned, Primitive) else getattr(learned, "primitive_", None)
    if not isinstance(primitive, Primitive):
        raise NotFittedError("a learned primitive", f"{learned!r:.100}", "Call fit(demonstrations) first.")
    return primitive


def _by_label(values: Any, library: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """Values given for one primitive or by label, by label."""
    if set(library) == {""} and not isinstance(values, Mapping):
        return {"": values}
    if not isinstance(values, Mapping) or not set(library) <= set(values):
        given = sorted(values) if isinstance(values, Mapping) else type(values).__name__
        raise InputError(f"{name} by label for each of {sorted(library)}", str(given))
    return values
