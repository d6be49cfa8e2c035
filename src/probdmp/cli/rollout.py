"""`probdmp rollout`: a movement as planned, with its uncertainty."""

from typing import Annotated

import typer

from probdmp.cli.exit_codes import usage
from probdmp.cli.options import (
    Duration,
    Goal,
    Json,
    Label,
    ModelFile,
    OutputArrays,
    Start,
    StartVelocity,
    TaskOptions,
    check_output,
)
from probdmp.cli.output import print_json, print_line
from probdmp.cli.recordings import choose_primitive
from probdmp.cli.summaries import name_text
from probdmp.cli.trajectories import save_arrays, trajectory_arrays, trajectory_table

__all__ = ["rollout"]


def rollout(
    model: ModelFile,
    label: Label = None,
    start: Start = None,
    goal: Goal = None,
    duration: Duration = None,
    dt: Annotated[float | None, typer.Option(metavar="S", help="Seconds between states. Default: as learned.")] = None,
    start_velocity: StartVelocity = None,
    output: OutputArrays = None,
    as_json: Json = False,
) -> None:
    """Plan a movement: its mean and its uncertainty.

    In JSON and in the file: times (T), positions, velocities and accelerations (T, D) and their standard deviations (T, D),
    in data units and seconds; means and stds (T) of learned channels.
    """
    check_output(output, ".npz")
    from probdmp.estimator import PrimitiveLibrary

    name, primitive = choose_primitive(PrimitiveLibrary.load(model), label)
    task = TaskOptions(start, goal, duration, start_velocity).arguments(primitive.primitive_)
    with usage():
        planned = primitive.rollout(dt=dt, **task)
    arrays = {"label": name, **trajectory_arrays(planned)}
    if output is not None:
        save_arrays(output, arrays)
    if as_json:
        print_json(arrays)
    else:
        print_line(f"Rollout of {name_text(name)}: {planned.times[-1]:.3f} s in {len(planned.times)} states.", style="bold")
        trajectory_table(planned)
