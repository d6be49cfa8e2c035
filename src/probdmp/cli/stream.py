"""The monitor as a filter: JSON lines with what is measured in, JSON lines with what to do out."""

import itertools
import json
import math
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, BinaryIO, NoReturn

from probdmp.cli.exit_codes import UsageError, usage
from probdmp.cli.options import TaskOptions
from probdmp.cli.output import json_line
from probdmp.cli.recordings import choose_primitive
from probdmp.errors import DataFileError, InputError, InputTypeError

if TYPE_CHECKING:
    from probdmp.checks import FloatArray
    from probdmp.detection import FailureDetector
    from probdmp.estimator import PrimitiveLibrary, ProbabilisticDMP
    from probdmp.execution import OnlineExecution, SensorArray

__all__ = ["StreamOptions", "monitor_stream"]

LONGEST_LINE = 100_000
"""Bytes."""
HINT = (
    'A tick looks like {"position": [1.5, null], "time": 0.01}, with one number or null for each degree of freedom; '
    'other sensors go by name: "sensors": {"pen_force": 3.1}.'
)
TASK_KEYS = {"start", "goal", "duration", "dt", "label", "start_velocity"}


@dataclass(frozen=True, slots=True)
class StreamOptions:
    """What the command line says; a task in the stream overrides it."""

    label: str | None
    task: TaskOptions
    dt: float | None
    on_alarm: str
    feedback: tuple[str, ...] | None = None
    """Names of the sensors that modulate the command; None: all."""


@dataclass(frozen=True, slots=True)
class _Prepared:
    """What is known before anything has moved."""

    learned: "ProbabilisticDMP"
    arguments: Mapping[str, Any]
    """Of its `execute`, checked."""
    array: "SensorArray"
    """The sensors that the detector was calibrated with."""


def monitor_stream(library: "PrimitiveLibrary", detector: "FailureDetector", options: StreamOptions) -> bool:
    """Execute along standard input, one line out for each tick; whether the execution failed.

    Raises
    ------
    DataFileError
        If a line is malformed or does not fit the model, or there is no tick.
    """
    prepared: _Prepared | None = None
    execution: OnlineExecution | None = None
    for number, item in _objects(sys.stdin.buffer):
        with _line(number):
            if prepared is None:
                asked = item.get("task", {})
                prepared = _prepare(library, detector, options, asked)
                if "task" in item:
                    continue
            readings, time = _tick(item, prepared.array)
            if execution is None:
                execution = _begin(prepared, readings, detector)
            step = execution.step(readings, time)
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
    library: "PrimitiveLibrary", detector: "FailureDetector", options: StreamOptions, asked: Mapping[str, Any]
) -> _Prepared:
    """What is asked for, by a task in the stream or by options."""
    from probdmp.checks import check_seconds
    from probdmp.dmp import task_for
    from probdmp.execution import SensorArray

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
    arguments |= {"dt": None if dt is None else check_seconds(dt, "dt")}
    array = SensorArray(learned.primitive_, detector.sensors_)
    if options.feedback is not None:
        with usage():
            array.chosen(options.feedback)
    return _Prepared(learned, {**arguments, "on_alarm": options.on_alarm, "feedback": options.feedback}, array)


def _begin(prepared: _Prepared, readings: Mapping[str, "FloatArray"], detector: "FailureDetector") -> "OnlineExecution":
    """The execution; it starts where it is first seen, as far as it is."""
    from probdmp.execution.readings import observation_of

    array, start = prepared.array, prepared.arguments["start"]
    if start is None:
        seen = dict(zip(array.outputs, observation_of(array, readings).tolist(), strict=True))
        start = [seen.get(name, math.nan) for name in array.dof_names]
    return prepared.learned.execute(**{**prepared.arguments, "start": start}, detector=detector)


def _tick(item: Mapping[str, Any], array: "SensorArray") -> tuple[dict[str, "FloatArray"], float | None]:
    """Readings of a tick by name of their sensors, and its time."""
    from probdmp.checks import check_array

    if not item.keys() & {"position", "sensors"} or not item.keys() <= {"position", "sensors", "time"}:
        raise InputError('a tick with "position" or "sensors", and perhaps "time"', f"{sorted(item)}", HINT)
    readings, time = item.get("sensors", {}), item.get("time")
    if not isinstance(readings, dict):
        raise InputTypeError('"sensors" as an object with a reading for each name', f"{readings!r:.60}", HINT)
    if "position" in item:
        if "position" in readings:
            raise InputError('the reading of "position" once', "twice", 'Leave it out of "sensors".')
        readings = {"position": item["position"], **readings}
    for name in readings:
        if name not in array.names:
            raise InputError(f"readings of the sensors {', '.join(map(repr, array.names))}", f"one of {name!r:.60}", HINT)
    return {name: _reading(value, name, array) for name, value in readings.items()}, (
        None if time is None else float(check_array(time, "time", ()))
    )


def _reading(value: Any, name: str, array: "SensorArray") -> "FloatArray":
    """What a sensor has measured, (outputs,) array: a list of numbers and null; one alone stands for a list of it."""
    from probdmp.checks import check_array

    part = array.slices[name]
    shape = (part.stop - part.start,)
    if value is None:
        return check_array([math.nan] * shape[0], name, shape, missing=True)
    values = [value] if shape == (1,) and not isinstance(value, list) else value
    if not isinstance(values, list) or any(isinstance(entry, bool) for entry in values):
        raise InputTypeError(f"{name} as a list of numbers or null", f"{value!r:.60}", HINT)
    return check_array([math.nan if entry is None else entry for entry in values], name, shape, missing=True, hint=HINT)


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
