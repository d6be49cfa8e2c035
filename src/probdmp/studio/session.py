"""What one page has taught, chosen and imported; it outlives the connection."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration
from probdmp.detection import FailureDetector
from probdmp.errors import InputError, UnknownLabelError
from probdmp.estimator import ProbabilisticDMP
from probdmp.studio.limits import IMPORTED, MOST_LABELS, MOST_SAMPLES, MOST_STROKES
from probdmp.studio.origins import DRAWN, Origin
from probdmp.studio.outbox import Outbox
from probdmp.studio.settings import Settings

__all__ = ["Movement", "Session", "TaskWish"]


@dataclass(slots=True, eq=False)
class Movement:
    """A label: its demonstrations and what was learned from them."""

    strokes: list[Demonstration] = field(default_factory=list)
    origin: Origin = DRAWN
    learned: ProbabilisticDMP | None = None
    before: ProbabilisticDMP | None = None
    """What was known before the last change, if anything."""
    version: int = 0
    """Goes up with every change of the demonstrations: what was learned from others is of no use."""
    given_detector: FailureDetector | None = None
    """That came with the movement, from a file."""
    seconds: float | None = None
    """From the last stroke to the band."""


@dataclass(frozen=True, slots=True, eq=False)
class TaskWish:
    """What the page asks of executions; None: as learned."""

    start: FloatArray | None = None
    goal: FloatArray | None = None
    via: tuple[tuple[float, FloatArray], ...] = ()
    """(phase from 0 to 1, position) each."""
    duration: float | None = None

    @property
    def arguments(self) -> dict[str, Any]:
        """Of rollout and execute."""
        return {"start": self.start, "goal": self.goal, "duration": self.duration}


class Session:
    """Everything that belongs to one page.

    Parameters
    ----------
    name : 128 random bits that only the page knows.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.movements: dict[str, Movement] = {}
        self.selected: str | None = None
        self.settings = Settings()
        self.task = TaskWish()
        self.imported: list[Demonstration] = []
        """Recorded executions to be replayed."""
        self.detectors: dict[str, FailureDetector] = {}
        self.calibration_problem = ""
        """Why there are no detectors, if calibrating failed."""
        self.calibration_note = ""
        """What detectors cannot do that they usually can, and what helps."""
        self.outbox: Outbox | None = None
        """Of the page, while it is connected."""

    def send(self, message: dict[str, Any], key: str | None = None) -> None:
        """To the page, if it is connected."""
        if self.outbox is not None:
            self.outbox.send(message, key)

    def movement(self, label: str) -> Movement:
        """The one with a label.

        Raises
        ------
        UnknownLabelError
            If there is none.
        """
        if label not in self.movements:
            known = ", ".join(map(repr, self.movements)) or "none so far"
            raise UnknownLabelError(f"a label of this session: {known}", repr(label), "Draw it first.")
        return self.movements[label]

    def learned(self, label: str | None) -> tuple[str, ProbabilisticDMP]:
        """A label and its learned movement; of the selected label unless given.

        Raises
        ------
        InputError
            If nothing was learned yet.
        """
        chosen = self.selected if label is None else label
        learned = None if chosen is None else self.movement(chosen).learned
        if chosen is None or learned is None:
            raise InputError("a movement that was learned", "none so far", "Draw it, or choose an example.")
        return chosen, learned

    @property
    def library(self) -> dict[str, ProbabilisticDMP]:
        """All that was learned, by label."""
        return {label: m.learned for label, m in self.movements.items() if m.learned is not None}

    def add_label(self, label: str) -> Movement:
        """The movement with this label, new if there was none."""
        if label == IMPORTED:
            raise InputError(f"a label other than {IMPORTED!r}, which stands for executions from files", repr(label))
        if label not in self.movements:
            if len(self.movements) >= MOST_LABELS:
                raise InputError(f"at most {MOST_LABELS} labels", "one more", "Delete some first.")
            self.movements[label] = Movement()
        return self.movements[label]

    def add_strokes(self, label: str, strokes: list[Demonstration], origin: Origin | None = None) -> None:
        """Further demonstrations of a label, which is selected; drawn on the canvas as it is shown there, unless they say."""
        self._check_room(strokes)
        held = len(self.movements[label].strokes) if label in self.movements else 0
        if held + len(strokes) > MOST_STROKES:
            hint = "Delete some, or write what you have to a file and use probdmp fit."
            raise InputError(f"at most {MOST_STROKES} demonstrations of a label", f"{held + len(strokes)}", hint)
        joined = self.origin_with(label, origin)
        movement = self.add_label(label)
        movement.origin = joined
        movement.strokes.extend(map(movement.origin.of, strokes))
        movement.version += 1
        self.select(label)

    def origin_with(self, label: str, origin: Origin | None) -> Origin:
        """Of a label when recordings join it; None: they are drawn where it is shown.

        Raises
        ------
        InputError
            If they cannot.
        """
        movement = self.movements.get(label, Movement())
        if origin is None:
            return movement.origin
        is_new = not movement.strokes and movement.learned is None
        return origin if is_new else movement.origin.joined(origin, label)

    def select(self, label: str) -> None:
        """Speak of another movement from now on, executed as learned."""
        self.movement(label)
        if label != self.selected:
            self.selected, self.task = label, TaskWish()

    def task_of(self, label: str) -> TaskWish:
        """What the page asks of executions of a label: nothing but of the selected one."""
        return self.task if label == self.selected else TaskWish()

    def add_imported(self, executions: list[Demonstration]) -> None:
        """Recorded executions to be replayed."""
        self._check_room(executions)
        if len(self.imported) + len(executions) > MOST_STROKES:
            raise InputError(f"at most {MOST_STROKES} executions to replay", f"{len(self.imported) + len(executions)}")
        self.imported.extend(executions)

    def add_movements(
        self, library: Mapping[str, ProbabilisticDMP], detector: FailureDetector | None, origins: Mapping[str, Origin]
    ) -> None:
        """Movements from a file, without their demonstrations, by label."""
        taken = [label for label in library if label in self.movements and self.movements[label].strokes]
        if taken:
            raise InputError("a model whose labels are not taken", ", ".join(map(repr, taken)), "Rename yours first.")
        for label, learned in library.items():
            movement = self.add_label(label)
            movement.learned, movement.before, movement.given_detector = learned, None, detector
            movement.origin = origins[label]
            self.select(label)

    def recording(self, label: str, index: int) -> tuple[str | None, Demonstration]:
        """A stroke of a label, or an execution from a file, and the label of the movement that it is one of."""
        if label != IMPORTED:
            return label, self.movement(label).strokes[index]
        recording = self.imported[index]
        return (recording.label if recording.label in self.movements else self.selected), recording

    def n_recordings(self, label: str) -> int:
        """How many there are to choose from."""
        return len(self.imported) if label == IMPORTED else len(self.movement(label).strokes)

    def rename(self, label: str, name: str) -> None:
        """Give a movement another label."""
        self.movement(label)
        if name in self.movements or name == IMPORTED:
            raise InputError("a label that is not taken", repr(name), "Delete the other one first.")
        self.movements = {name if key == label else key: m for key, m in self.movements.items()}
        self.selected = name if self.selected == label else self.selected

    def delete(self, label: str) -> None:
        """Forget a movement."""
        self.movement(label)
        del self.movements[label]
        self.detectors.pop(label, None)
        if self.selected == label:
            self.selected, self.task = next(iter(self.movements), None), TaskWish()

    def all_strokes(self) -> Mapping[str, list[Demonstration]]:
        """Demonstrations by label, of labels that have any."""
        return {label: m.strokes for label, m in self.movements.items() if m.strokes}

    def _check_room(self, added: list[Demonstration]) -> None:
        kept = [*self.imported, *(stroke for m in self.movements.values() for stroke in m.strokes)]
        total = sum(d.n_samples for d in [*kept, *added])
        if total > MOST_SAMPLES:
            hint = "Delete some, or use the command line: probdmp fit takes files of any size."
            raise InputError(f"at most {MOST_SAMPLES} samples in a session", f"{total}", hint)
