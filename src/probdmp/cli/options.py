"""Options that several verbs share: their names, help and meaning."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from probdmp.cli.exit_codes import UsageError, usage

if TYPE_CHECKING:
    from probdmp.dmp import Primitive

__all__ = [
    "Columns",
    "Duration",
    "ExecutionFile",
    "Force",
    "Goal",
    "Index",
    "Jobs",
    "Json",
    "Label",
    "ModelFile",
    "OutputArrays",
    "OutputRecordings",
    "RecordingFiles",
    "SampleStep",
    "Seed",
    "Sensors",
    "Start",
    "StartVelocity",
    "TaskOptions",
    "Topic",
    "Trim",
    "check_output",
    "check_recordings_output",
    "names_of",
]

POINT = "X,Y,…"
READ = ".npz, .csv, .parquet, .mat, .bag, .db3, .mcap, or a folder with meta/info.json or metadata.yaml"
"""What recordings are read from, as in `io.formats`, which takes long to load."""
WRITTEN = ".npz, .csv, .parquet, .mcap"
"""What they are written to."""

ModelFile = Annotated[Path, typer.Argument(metavar="MODEL", help="Model file made by probdmp fit.", show_default=False)]
ExecutionFile = Annotated[Path, typer.Argument(metavar="EXECUTION", help=f"Recorded executions ({READ}).", show_default=False)]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document, missing numbers as null.")]
Jobs = Annotated[int, typer.Option("--jobs", min=1, metavar="N", help="Processes; 1 is this one.")]
Label = Annotated[
    str | None, typer.Option("--label", metavar="LABEL", help="Which primitive, and the recordings with its label.")
]
Index = Annotated[int, typer.Option("--index", min=0, metavar="I", help="Which recording, from 0; with --label, of those.")]
RecordingFiles = Annotated[list[Path], typer.Argument(metavar="FILE…", help=f"Recordings ({READ}).", show_default=False)]
Columns = Annotated[
    str | None,
    typer.Option("--columns", metavar="NAMES", help="Columns that are positions, such as x,y. Default: x, y, z and q…."),
]
SampleStep = Annotated[
    float | None,
    typer.Option("--dt", metavar="S", help="Seconds between samples, for files without times; others are resampled to it."),
]
Topic = Annotated[
    str | None,
    typer.Option("--topic", metavar="NAME", help="Topic of a robot's recording. Default: the only one with a movement."),
]
Trim = Annotated[bool, typer.Option("--trim", help="Cut what stands still before and after each movement.")]
Sensors = Annotated[
    Path | None,
    typer.Option(
        "--sensors", metavar="FILE.toml", help="What observes executions. Default: positions and what channels were learned."
    ),
]
Seed = Annotated[int, typer.Option("--seed", min=0, metavar="N", help="Decides all that is random.")]

Start = Annotated[
    str | None,
    typer.Option("--start", metavar=POINT, help="Start position, data units. Default: a recording's own, or as learned."),
]
Goal = Annotated[str | None, typer.Option("--goal", metavar=POINT, help="Goal position, data units. Default: as learned.")]
Duration = Annotated[
    float | None, typer.Option("--duration", metavar="S", help="Seconds. Default: a recording's own, or as learned.")
]
StartVelocity = Annotated[
    str | None,
    typer.Option("--start-velocity", metavar=POINT, help="Velocity at the start, data units per second. Default: as learned."),
]
OutputArrays = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="FILE.npz", help="Write times, means and stds as arrays (T, D) to this file."),
]

Force = Annotated[bool, typer.Option("--force", help="Replace the output file if it exists.")]
OutputRecordings = Annotated[
    Path, typer.Option("--output", "-o", metavar="FILE", help=f"Recordings to write ({WRITTEN}).", show_default=False)
]


@dataclass(frozen=True, slots=True)
class TaskOptions:
    """What the command line says about a task; None: as learned, or the recording's own."""

    start: str | None
    goal: str | None
    duration: float | None
    start_velocity: str | None

    def arguments(self, primitive: "Primitive") -> dict[str, Any]:
        """Keyword arguments for rollout, track, smooth and execute, checked against the primitive.

        Raises
        ------
        UsageError
            If they are no numbers, or do not fit.
        """
        from probdmp.dmp import task_for

        given: dict[str, Any] = {
            "start": _numbers(self.start, "--start"),
            "goal": _numbers(self.goal, "--goal"),
            "duration": self.duration,
            "start_velocity": _numbers(self.start_velocity, "--start-velocity"),
        }
        with usage():
            task_for(primitive, **given)
        return given


def names_of(text: str | None) -> Sequence[str] | None:
    """Names from a list with commas."""
    return None if text is None else [name.strip() for name in text.split(",")]


def check_recordings_output(path: Path, force: bool) -> None:
    """Whether recordings can be written there; none that exist are replaced unless that is asked for."""
    from probdmp.io.formats import FORMATS

    check_output(path, *(suffix for suffix, known in FORMATS.items() if known.write is not None))
    if path.exists() and not force:
        raise UsageError("an output file that does not exist yet", repr(str(path)), "Use --force to replace it.")


def check_output(path: Path | None, *suffixes: str) -> None:
    """Refuse a place that cannot be written before the work is done, not after.

    Raises
    ------
    UsageError
        If the suffix is another or the folder does not exist.
    """
    if path is None:
        return
    if path.suffix not in suffixes:
        raise UsageError(f"an output file that ends in {' or '.join(suffixes)}", repr(str(path)))
    if not path.parent.is_dir():
        raise UsageError("an output file in a folder that exists", repr(str(path)), f"Make it first: mkdir -p {path.parent}")


def _numbers(text: str | None, option: str) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(number) for number in text.split(",")]
    except ValueError as error:
        raise UsageError(f"{option} as numbers with commas between, such as 1.5,-2", repr(text)) from error
