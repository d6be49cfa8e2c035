"""The monitor as a filter: JSON lines with what is measured in, JSON lines with what to do out."""

import itertools
import json
import math
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, BinaryIO, NoReturn

from probdmp.cli.exit_codes import UsageError
from probdmp.cli.options import TaskOptions
from probdmp.cli.output import json_line
from probdmp.cli.recordings import choose_primitive
from probdmp.errors import DataFileError, InputError, InputTypeError

if TYPE_CHECKING:
    from probdmp.detection import FailureDetector
    from probdmp.estimator import PrimitiveLibrary, ProbabilisticDMP
    from probdmp.execution import OnlineExecution

__all__ = ["StreamOptions", "monitor_stream"]

LONGEST_LINE = 100_000
"""Bytes."""
HINT = 'A tick looks like {"position": [1.5, null], "time": 0.01}, with one number or null for each degree of freedom.'
TASK_KEYS = {"start", "goal", "duration", "dt", "label", "start_velocity"}


@dataclass(frozen=True, slots=True)
class StreamOptions:
    """What the command line says; a task in the stream overrides it."""

    label: str | None
    task: TaskOptions
    dt: float | None
    on_alarm: str


def monitor_stream(library: "PrimitiveLibrary", detector: "FailureDetector", options: StreamOptions) -> bool:
    """Execute along standard input, one line out for each tick; whether the execution failed.

    Raises
    ------
    DataFileError
        If a line is malformed or does not fit the model, or there is no tick.
    """
    prepared: tuple[ProbabilisticDMP, dict[str, Any]] | None = None
    execution: OnlineExecution | None = None
    for number, item in _objects(sys.stdin.buffer):
        with _line(number):
            if prepared is None:
                asked = item.get("task", {})
                prepared = _prepare(library, options, asked)
                if "task" in item:
                    continue
            position, time = _tick(item)
            if execution is None:
                execution = _begin(*prepared, position, detector, options.on_alarm)
            step = execution.step(position, time)
        answer = {name: getattr(step, name) for name in ("time", "position", "velocity", "acceleration")}
        answer |= {"log_likelihood": step.log_likelihood, "test_ratio": step.test_ratio, "failed": execution.failed}
        sys.stdout.write(json_line(answer | _reason(execution)))
        sys.stdout.flush()
    if execution is None:
        raise DataFileError("at least one tick on standard input", "none", HINT)
    return execution.failed


def _reason(execution: "OnlineExecution") -> dict[str, Any]:
    """What is said of a failure, None as long as there is none; it may change while the execution goes on."""
    from probdmp.detection import Verdict

    verdict = execution.verdict
    assert isinstance(verdict, Verdict), "a FailureDetector is watching"
    reason = {name: getattr(verdict, name) or None for name in ("kind", "cause", "better")}
    return {**reason, "is_stale": verdict.is_stale, "has_sensor_fault": verdict.has_sensor_fault}


def _prepare(
    library: "PrimitiveLibrary", options: StreamOptions, asked: Mapping[str, Any]
) -> tuple["ProbabilisticDMP", dict[str, Any]]:
    """The primitive and the checked arguments of `execute`, before anything has moved."""
    from probdmp.checks import check_seconds
    from probdmp.dmp import task_for

    if not isinstance(asked, dict) or not asked.keys() <= TASK_KEYS:
        raise InputError(f"a task with some of {', '.join(sorted(TASK_KEYS))}", repr(asked))
    try:
        _, learned = choose_primitive(library, asked.get("label", options.label))
    except UsageError as error:
        if "label" in asked:
            raise InputError(error.expected, error.got) from error
        raise
    arguments = options.task.arguments(learned.primitive_)
    arguments |= {key: value for key, value in asked.items() if key not in ("label", "dt") and value is not None}
    task_for(learned.primitive_, **arguments)
    dt = asked.get("dt", options.dt)
    return learned, {**arguments, "dt": None if dt is None else check_seconds(dt, "dt")}


def _begin(
    learned: "ProbabilisticDMP",
    arguments: Mapping[str, Any],
    position: list[float] | None,
    detector: "FailureDetector",
    on_alarm: str,
) -> "OnlineExecution":
    """The execution; it starts where it is first seen, as far as it is."""
    from probdmp.checks import check_array

    start = arguments["start"]
    if start is None and position is not None:
        start = check_array(position, "position", (learned.primitive_.n_dof,), missing=True, hint=HINT)
    return learned.execute(**{**arguments, "start": start}, detector=detector, on_alarm=on_alarm)


def _tick(item: Mapping[str, Any]) -> tuple[list[float] | None, float | None]:
    """Position and time of a tick."""
    from probdmp.checks import check_array

    if "position" not in item or not item.keys() <= {"position", "time"}:
        raise InputError('a tick with "position" and perhaps "time"', f"{sorted(item)}", HINT)
    position, time = item["position"], item.get("time")
    if position is not None:
        if not isinstance(position, list) or any(isinstance(entry, bool) for entry in position):
            raise InputTypeError("position as a list of numbers or null", f"{position!r:.60}", HINT)
        position = [math.nan if entry is None else entry for entry in position]
        check_array(position, "position", ("D",), missing=True, hint=HINT)
    return position, None if time is None else float(check_array(time, "time", ()))


def _objects(stream: BinaryIO) -> Iterator[tuple[int, dict[str, Any]]]:
    """The JSON objects of a stream and the numbers of their lines, from 1; blank lines are passed over."""
    for number in itertools.count(1):
        line = stream.readline(LONGEST_LINE + 1)
        if not line:
            return
        with _line(number):
            if len(line) > LONGEST_LINE:
                raise InputError(f"at most {LONGEST_LINE} bytes", "more", HINT)
            if line.isspace():
                continue
            try:
                item = json.loads(line, parse_constant=_refuse)
            except (ValueError, RecursionError) as error:
                raise InputError("a JSON object", f"{line[:60].decode(errors='replace')!r} ({error})", HINT) from error
            if not isinstance(item, dict):
                raise InputError("a JSON object", f"{item!r:.60}", HINT)
        yield number, item


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is not JSON, use null")


@contextmanager
def _line(number: int) -> Iterator[None]:
    """Say which line is at fault."""
    try:
        yield
    except (InputError, InputTypeError) as error:
        raise DataFileError(f"{error.expected} on line {number}", error.got, error.hint) from error
