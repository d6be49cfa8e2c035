"""`probdmp plot`: pictures of data, models, executions and evaluations."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from probdmp.cli.exit_codes import UsageError, usage
from probdmp.cli.options import (
    Columns,
    Duration,
    Goal,
    Index,
    Json,
    Label,
    Start,
    StartVelocity,
    TaskOptions,
    check_output,
    names_of,
)
from probdmp.cli.output import print_json, print_line
from probdmp.cli.pictures import KINDS, Picture, PictureRequest, picture_of

__all__ = ["plot"]

FORMATS = (".svg", ".png", ".pdf")
VIEWERS = (".mcap", ".rrd")
"""Suffixes of files that viewers of time series draw themselves: Foxglove, Rerun."""
OVER_TIME = [name for name, kind in KINDS.items() if kind.over_time]
WHAT_HELP = "One of: " + ", ".join(f"{name} ({kind.files})" for name, kind in KINDS.items()) + "."


def plot(
    what: Annotated[str, typer.Argument(metavar="WHAT", help=WHAT_HELP, show_default=False)],
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Demonstrations, a model, or an evaluation as JSON.", show_default=False)
    ],
    execution: Annotated[
        Path | None, typer.Argument(metavar="EXECUTION", help="Recorded executions, for smoothing and monitor.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="PICTURE",
            help="Ends in .svg, .png or .pdf; or in .mcap or .rrd, for Foxglove and Rerun. Default: FILE-WHAT.svg, here.",
        ),
    ] = None,
    label: Label = None,
    index: Index = 0,
    start: Start = None,
    goal: Goal = None,
    duration: Duration = None,
    start_velocity: StartVelocity = None,
    columns: Columns = None,
    dof: Annotated[
        str | None, typer.Option("--dof", metavar="X,Y", help="Which two degrees of freedom make a path. Default: the first.")
    ] = None,
    onset: Annotated[
        float | None, typer.Option("--onset", metavar="S", help="Of monitor: when the fault began, seconds, if it is known.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Draw a picture.

    demonstrations: paths, and positions over time. basis: the phase and the basis functions. forcing: the forcing term with its
    bands. rollout: position, velocity and acceleration with their bands. path: two degrees of freedom in the tube of their
    covariance. smoothing: an execution as filtered and in hindsight. monitor: an execution with its log-likelihood, test ratio,
    threshold and verdict. operating: what an evaluation detects at which price, and how soon. onset: detection by when the
    failure begins, and latencies.

    Lines differ in more than colour, so pictures can be printed in black and white. Needs the extra: pip install
    'probdmp[plot]'.

    rollout, smoothing and monitor also go to Foxglove, -o x.mcap, and Rerun, -o x.rrd, with bands of 2 standard deviations and
    the verdict as a log message. These need the extras probdmp[foxglove] and probdmp[rerun], and no matplotlib.
    """
    if what not in KINDS:
        raise UsageError(f"WHAT to be one of {', '.join(KINDS)}", repr(what))
    given = {"--label": label, "--index": index or None, "--start": start, "--goal": goal, "--duration": duration}
    given |= {"--start-velocity": start_velocity, "--columns": columns, "--dof": dof, "--onset": onset}
    _check_fits(what, execution, given)
    path = Path(f"{file.stem}-{what}.svg") if output is None else output
    check_output(path, *FORMATS, *VIEWERS)
    _require(path, what)
    task = TaskOptions(start, goal, duration, start_velocity)
    request = PictureRequest(file, execution, label, index, task, names_of(columns), names_of(dof), onset)
    picture = picture_of(what, request)
    with usage():
        _save(path, picture)
    if as_json:
        print_json({"written": str(path)})
    else:
        print_line(f"Wrote {path}")


def _require(path: Path, what: str) -> None:
    """Refuse what no viewer can show, or what cannot be written without a library, before the work is done."""
    if path.suffix in VIEWERS and what not in OVER_TIME:
        hint = "Give it a name that ends in .svg."
        raise UsageError(f"one of {', '.join(OVER_TIME)} for a {path.suffix} file", what, hint)
    if path.suffix == ".mcap":
        from probdmp.plotting.foxglove import require_foxglove

        require_foxglove()
    elif path.suffix == ".rrd":
        from probdmp.plotting.rerun import require_rerun

        require_rerun()
    else:
        from probdmp.plotting.style import require_matplotlib

        require_matplotlib()


def _save(path: Path, picture: Picture) -> None:
    if path.suffix not in VIEWERS:
        from probdmp.plotting.panels import save_panels

        save_panels(path, picture.panels, picture.columns, picture.heading)
        return
    assert picture.timelines is not None, "checked"
    timelines = replace(picture.timelines, heading=picture.heading)
    if path.suffix == ".mcap":
        from probdmp.plotting.foxglove import write_mcap

        write_mcap(path, timelines)
    else:
        from probdmp.plotting.rerun import write_rrd

        write_rrd(path, timelines)


def _check_fits(what: str, execution: Path | None, given: Mapping[str, object]) -> None:
    """Refuse what a picture has no use for."""
    kind = KINDS[what]
    if kind.needs_execution and execution is None:
        raise UsageError(f"recorded executions after the model: probdmp plot {what} MODEL EXECUTION", "none")
    if not kind.needs_execution and execution is not None:
        raise UsageError(f"one file: probdmp plot {what} FILE", f"{str(execution)!r} too")
    useless = [option for option, value in given.items() if value is not None and option not in kind.options]
    if useless:
        raise UsageError(f"of {what} only {', '.join(kind.options) or 'none of these options'}", ", ".join(useless))
