"""A model that scores tables of executions."""

import hashlib
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from probdmp.checks import SECONDS, IntArray
from probdmp.detection import FailureDetector
from probdmp.dmp import Primitive
from probdmp.errors import DataFileError, InputError, InputTypeError, ModelFileError, ProbDMPError
from probdmp.execution import ChannelSensor, ExecutionBatch, SensorArray, score_batch
from probdmp.fleet.blocks import alike, tasks_of
from probdmp.fleet.scores import Scores
from probdmp.io import ExecutionTable, decode_model
from probdmp.io.parquet_layout import DURATION, ParquetLayout
from probdmp.io.recordings import listing

__all__ = ["Scorer"]

FAR = 100.0
"""How many times longer or shorter than learned a movement may be; further away its times are in another unit."""


class Scorer:
    """The primitives and the detector of a model file.

    Parameters
    ----------
    payload : the bytes of the file.
    name : of the file, for messages.
    threads : that score executions at the same time.

    Raises
    ------
    ModelFileError
        If it is damaged, or has no detector.
    """

    def __init__(self, payload: bytes, name: str, threads: int = 1) -> None:
        self._each: Callable[..., Iterator[None]] = map if threads == 1 else ThreadPoolExecutor(threads).map
        contents = decode_model(payload, name)
        if contents.detector is None:
            hint = "Learn it with probdmp fit, which saves one, or give save() a fitted FailureDetector."
            raise ModelFileError(f"a failure detector in {name!r}", "a model without one", hint)
        try:
            self.detector = FailureDetector.from_state(contents.detector, contents.primitives)
        except (InputError, InputTypeError) as error:
            raise ModelFileError(
                f"{error.expected} in {name}", error.got, "Fit the detector and save the model again."
            ) from error
        self.digest = hashlib.sha256(payload).hexdigest()
        self.primitives: Mapping[str, Primitive] = contents.primitives
        self._labels = list(contents.primitives)
        self._arrays = [SensorArray(primitive, self.detector.sensors_) for primitive in contents.primitives.values()]

    def columns(self, layout: ParquetLayout, name: str) -> tuple[str, ...]:
        """What of a file is needed.

        Parameters
        ----------
        name : of the file, for messages.

        Raises
        ------
        DataFileError
            If nothing in it can be an execution of any primitive, or it is in other units.
        """
        lacking = [self._lacking(i, layout.columns) for i in range(len(self._labels))]
        if all(lacking):
            known = ", ".join(layout.columns) or "none"
            raise DataFileError(f"columns {', '.join(self._needed(0))} of numbers in {name}", known, "They go by name.")
        if layout.label is None and len(self._labels) > 1:
            expected = f"a column 'primitive' in {name}, with one of {sorted(self._labels)} for each execution"
            raise DataFileError(expected, "none", "Without it, a model of one primitive is needed.")
        for primitive in self.primitives.values():
            other = {layout.units.get(column, primitive.units) for column in primitive.names} - {primitive.units}
            if other and primitive.units:
                raise DataFileError(
                    f"positions in {primitive.units}, as learned, in {name}", other.pop(), "Convert them first."
                )
        wanted = [output for array in self._arrays for output in (*array.outputs, *array.dof_names)]
        return tuple(column for column in dict.fromkeys(wanted) if column in layout.columns)

    def score(self, table: ExecutionTable) -> Any:
        """Scores, an Arrow table with a row for each execution."""
        return self.begin(table)()

    def begin(self, table: ExecutionTable) -> Callable[[], Any]:
        """The same, begun where there are threads for it; what is returned waits for them, or does the work."""
        owners = self._owners(table)
        self._check(table, owners)
        scores = Scores(table)
        blocks = list(alike(table, np.where(table.usable, owners, -1)))

        def score(which: IntArray) -> None:  # writes what is about its own executions, and nothing else
            self._score(table, which, int(owners[which[0]]), scores)

        begun = self._each(score, blocks)

        def ended() -> Any:
            list(begun)
            names = np.array([*table.labels, None], dtype=object)[table.codes]
            known = np.array([*self._labels, None], dtype=object)[owners]
            return scores.as_table(np.where(owners >= 0, known, names))

        return ended

    def _score(self, table: ExecutionTable, which: IntArray, owner: int, scores: Scores) -> None:
        """A block; where it is refused, the executions that are to blame get the reason, the others their scores."""
        primitive, array = self.primitives[self._labels[owner]], self._arrays[owner]
        try:
            values = table.measured(which, array.outputs)
            batch = ExecutionBatch(values, tasks_of(table, which, primitive), float(table.steps[which[0]]))
            scores.put(which, self.detector.judge(primitive, batch), score_batch(primitive, batch, array))
        except (ProbDMPError, ArithmeticError, np.linalg.LinAlgError) as error:
            if len(which) == 1:
                table.problems[which] = " ".join(str(error).split())
                return
            for half in np.array_split(which, 2):
                self._score(table, half, owner, scores)

    def _owners(self, table: ExecutionTable) -> IntArray:
        """(N,) array: which primitive each execution is of; -1 where there is none. One that is alone need not be named."""
        alone = len(self._labels) == 1
        places = {label: i for i, label in enumerate(self._labels)}
        default = 0 if alone else -1
        found = [default if alone and "" in (label, *places) else places.get(label, -1) for label in table.labels]
        owners = np.array([*found, default], dtype=np.int64)[table.codes]
        table.refuse(owners < 0, f"Expected one of {listing(map(repr, self._labels))} as primitive, got none of these.")
        return owners

    def _check(self, table: ExecutionTable, owners: IntArray) -> None:
        """Refuse executions that lack columns of their primitive, or whose times cannot be right."""
        for i in range(len(self._labels)):
            if lacking := self._lacking(i, table.columns):
                table.refuse(
                    owners == i, f"Expected columns {', '.join(self._needed(i))}, got none named {', '.join(lacking)}."
                )
        shortest, longest = SECONDS
        told = table.told.get(DURATION)
        if told is not None:
            wrong = (told < shortest) | (told > longest)
            table.refuse(wrong, f"Expected duration from {shortest:g} to {longest:g} seconds, got something else.")
        learned = np.array([primitive.duration for primitive in self.primitives.values()])[owners]
        times = (np.diff(table.offsets) - 1) * table.steps / learned
        hint = "A time in milliseconds? Divide it by 1000."
        text = f"Expected a movement at most {FAR:g} times as long as learned, and at least one {FAR:g}th, got another. {hint}"
        table.refuse((times > FAR) | (times < 1 / FAR), text)

    def _needed(self, owner: int) -> tuple[str, ...]:
        """Columns that executions must have; channels that were learned may be missing."""
        sensors = [sensor for sensor in self._arrays[owner].sensors if not isinstance(sensor, ChannelSensor)]
        return tuple(output for sensor in sensors for output in sensor.outputs)

    def _lacking(self, owner: int, columns: Any) -> list[str]:
        return [output for output in self._needed(owner) if output not in columns]
