"""`probdmp smooth`: a recorded execution in hindsight."""

from probdmp.cli.options import (
    Duration,
    ExecutionFile,
    Goal,
    Index,
    Json,
    Label,
    ModelFile,
    OutputArrays,
    SampleStep,
    Sensors,
    Start,
    StartVelocity,
    TaskOptions,
    check_output,
)
from probdmp.cli.output import print_json, print_line
from probdmp.cli.recordings import read_sensed
from probdmp.cli.summaries import name_text
from probdmp.cli.trajectories import save_arrays, trajectory_arrays, trajectory_table

__all__ = ["smooth"]


def smooth(
    model: ModelFile,
    execution: ExecutionFile,
    index: Index = 0,
    label: Label = None,
    start: Start = None,
    goal: Goal = None,
    duration: Duration = None,
    start_velocity: StartVelocity = None,
    dt: SampleStep = None,
    sensors: Sensors = None,
    output: OutputArrays = None,
    as_json: Json = False,
) -> None:
    """Reconstruct a recorded execution in hindsight.

    The state at each time given the whole recording, before and after.

    In JSON and in the file: times (T), means and stds (T, D), in data units and seconds, and those of learned channels (T).
    Missing samples are filled in.
    """
    check_output(output, ".npz")
    from probdmp.estimator import PrimitiveLibrary

    name, primitive, recording, seen_by = read_sensed(execution, PrimitiveLibrary.load(model), label, index, dt, sensors)
    task = TaskOptions(start, goal, duration, start_velocity).arguments(primitive.primitive_)
    smoothed = primitive.smooth(recording, sensors=seen_by, **task)
    arrays = {"label": name, "index": index, **trajectory_arrays(smoothed)}
    if output is not None:
        save_arrays(output, arrays)
    if as_json:
        print_json(arrays)
    else:
        print_line(f"Recording {index}, smoothed as {name_text(name)}: {recording.duration:.3f} s", style="bold")
        trajectory_table(smoothed)
