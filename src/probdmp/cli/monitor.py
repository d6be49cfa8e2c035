"""`probdmp monitor`: is an execution still the movement that was taught?"""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from shlex import join
from typing import TYPE_CHECKING, Annotated

import typer

from probdmp.cli.detector_summaries import calibration_text, detector_summary, verdict_summary
from probdmp.cli.exit_codes import FAILURE_DETECTED, UsageError, usage
from probdmp.cli.options import READ, Goal, Json, Label, ModelFile, Start, StartVelocity, TaskOptions, names_of
from probdmp.cli.output import print_json, print_line
from probdmp.cli.recordings import primitive_of, read_executions
from probdmp.cli.sensor_file import read_sensor_file
from probdmp.cli.stream import StreamOptions, monitor_stream
from probdmp.cli.summaries import name_text
from probdmp.errors import ModelFileError

if TYPE_CHECKING:
    from probdmp.demonstrations import Demonstration
    from probdmp.detection import FailureDetector, Verdict
    from probdmp.estimator import PrimitiveLibrary

__all__ = ["monitor"]


def monitor(
    model: ModelFile,
    executions: Annotated[
        list[str],
        typer.Argument(metavar="EXECUTION…|-", help=f"Recorded executions ({READ}), or - for JSON lines.", show_default=False),
    ],
    label: Label = None,
    start: Start = None,
    goal: Goal = None,
    duration: Annotated[float | None, typer.Option(metavar="S", help="Seconds. Default: as learned.")] = None,
    start_velocity: StartVelocity = None,
    dt: Annotated[
        float | None,
        typer.Option(
            metavar="S",
            help="Seconds between ticks of JSON lines, by default as learned; in files as --dt of fit.",
        ),
    ] = None,
    on_alarm: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="With JSON lines, after an alarm: continue (the default), or hold: rest where the movement should then be.",
        ),
    ] = None,
    sensors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml", help="What observes executions; it must be what the detector was calibrated with, the default."
        ),
    ] = None,
    feedback: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="With JSON lines: sensors that modulate the command, such as position, or none. Default: all of them.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Judge executions; exit code 4 if one has failed.

    For files, a verdict on each recording. With - in their place, one execution as it happens: a JSON object per line and
    tick on standard input, and one on standard output with the state to reach at the next tick.

    In: {"position": [1.5, null], "sensors": {"pen_force": 3.1}, "time": 0.01} in data units and seconds. null: not measured;
    position, sensors, which are by name, or time may be left out.

    First, perhaps: {"task": {"start": [0, 0], "goal": [1, 2], "duration": 1.2, "dt": 0.01, "label": "a"}}, any of these.
    Unless given, the start is the first position and the rest is as learned.

    Out: time, position, velocity, acceleration, log_likelihood (nats), test_ratio (above 1: alarm), failed; kind and cause
    of the failure and a primitive that fits better, null until there is one; is_stale, has_sensor_fault.
    """
    from probdmp.estimator import PrimitiveLibrary, load_detector
    from probdmp.execution import SensorArray

    library, detector = PrimitiveLibrary.load(model), load_detector(model)
    if detector is None:
        hint = "Learn it with probdmp fit, which saves one, or give save() a fitted FailureDetector."
        raise ModelFileError(f"a failure detector in {str(model)!r}", "a model without one", hint)
    if sensors is not None:
        _check_sensors(sensors, library, detector)
    task = TaskOptions(start, goal, duration, start_velocity)
    if "-" in executions:
        if len(executions) > 1:
            raise UsageError("- alone, for JSON lines on standard input", join(executions), "Judge files in another call.")
        failed = monitor_stream(library, detector, _stream_options(label, task, dt, on_alarm, feedback))
    elif (on_alarm, feedback) != (None, None):
        option = "--on-alarm" if feedback is None else "--feedback"
        raise UsageError(f"{option} with JSON lines only", f"it with {join(executions)}", "Nothing commands what is recorded.")
    else:
        outputs = SensorArray(next(iter(library.values())).primitive_, detector.sensors_).outputs
        recordings = read_executions([*map(Path, executions)], library, label, dt, outputs)
        failed = _monitor_recordings(recordings, library, detector, task, as_json)
    raise typer.Exit(FAILURE_DETECTED if failed else 0)


def _stream_options(
    label: str | None, task: TaskOptions, dt: float | None, on_alarm: str | None, feedback: str | None
) -> StreamOptions:
    from probdmp.checks import check_choice, check_seconds
    from probdmp.execution.online import ALARM_REACTIONS

    with usage():
        dt = None if dt is None else check_seconds(dt, "--dt")
        on_alarm = check_choice(on_alarm or "continue", "--on-alarm", ALARM_REACTIONS)
    modulating = () if feedback == "none" else names_of(feedback)
    return StreamOptions(label, task, dt, on_alarm, None if modulating is None else tuple(modulating))


def _check_sensors(path: Path, library: "PrimitiveLibrary", detector: "FailureDetector") -> None:
    """Refuse sensors other than those that the detector was calibrated with: what is normal depends on them."""
    from probdmp.execution import SensorArray, sensors_as_plain

    file = read_sensor_file(path)
    for primitive in (learned.primitive_ for learned in library.values()):
        given, own = (SensorArray(primitive, s).sensors for s in (file.sensors_for(primitive), detector.sensors_))
        if sensors_as_plain(given) != sensors_as_plain(own):
            shown = [", ".join(f"{s.name!r} ({', '.join(s.outputs)})" for s in sensors) for sensors in (own, given)]
            hint = "Calibrate it with these: probdmp fit --sensors. Noise and gates have to be the same too."
            raise UsageError(f"the sensors that the detector was calibrated with, {shown[0]}", f"{shown[1]} in {path}", hint)


def _monitor_recordings(
    found: Sequence[tuple[Path, "Demonstration"]],
    library: "PrimitiveLibrary",
    detector: "FailureDetector",
    task: TaskOptions,
    as_json: bool,
) -> bool:
    """Judge recordings and print the verdicts; whether any failed."""
    from probdmp.dmp import task_for

    recordings = [recording for _, recording in found]
    asked, facts = [], []
    for recording in recordings:
        primitive = primitive_of(library, recording)[1].primitive_
        given = task.arguments(primitive)
        given["start"] = recording.positions[0] if given["start"] is None else given["start"]
        asked.append(task_for(primitive, **given))
        facts.append(detector.calibration_for(primitive, asked[-1]))
    verdicts = detector.verdicts(recordings, tasks=asked)
    which = _places(found)
    if as_json:
        executions = [
            {"file": str(path), "label": label, "index": index, **verdict_summary(verdict, its)}
            for (path, label, index), verdict, its in zip(which, verdicts, facts, strict=True)
        ]
        count = sum(verdict.failed for verdict in verdicts)
        print_json({"executions": executions, "failed": count, "detector": detector_summary(detector)})
    else:
        _print_verdicts(which, verdicts)
        for text in {calibration_text(its): None for its in facts if its is not None}:
            print_line(text, style="dim")
    return any(verdict.failed for verdict in verdicts)


def _places(found: Sequence[tuple[Path, "Demonstration"]]) -> list[tuple[Path, str, int]]:
    """File, label, and place among those of the file, from 0, of each recording."""
    seen: Counter[Path] = Counter()
    places = []
    for path, recording in found:
        places.append((path, recording.label, seen[path]))
        seen[path] += 1
    return places


def _print_verdicts(which: Sequence[tuple[Path, str, int]], verdicts: "Sequence[Verdict]") -> None:
    """One line for each, with its file if there are several, the failed ones in red, and a count."""
    several = len({path for path, _, _ in which}) > 1
    rows = [[*([str(path)] if several else []), name_text(label), str(index)] for path, label, index in which]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row, verdict in zip(rows, verdicts, strict=True):
        *texts, index = (f"{text:<{width}}" for text, width in zip(row, widths, strict=True))
        print_line(f"{' '.join(texts)} {index.strip():>{widths[-1]}}  {verdict}", style="red" if verdict.failed else "")
    n_failed = sum(verdict.failed for verdict in verdicts)
    print_line(f"{n_failed} of {len(verdicts)} executions failed.", style="bold")
