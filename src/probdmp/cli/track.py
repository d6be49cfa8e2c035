"""`probdmp track`: the Kalman filter over a recorded execution."""

from typing import TYPE_CHECKING

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
    Start,
    StartVelocity,
    TaskOptions,
    check_output,
)
from probdmp.cli.output import print_json, print_line
from probdmp.cli.recordings import read_recording
from probdmp.cli.summaries import name_text
from probdmp.cli.trajectories import save_arrays, trajectory_arrays, trajectory_table

if TYPE_CHECKING:
    from probdmp.demonstrations import Demonstration

__all__ = ["track"]


def track(
    model: ModelFile,
    execution: ExecutionFile,
    index: Index = 0,
    label: Label = None,
    start: Start = None,
    goal: Goal = None,
    duration: Duration = None,
    start_velocity: StartVelocity = None,
    dt: SampleStep = None,
    output: OutputArrays = None,
    as_json: Json = False,
) -> None:
    """Follow a recorded execution with the Kalman filter.

    The state at each time given what was seen until then.

    In JSON and in the file, beside times, means and stds: log_likelihoods (T), nats, contributions to them (T, D),
    innovations (T, D), measured minus predicted in data units, and their variances. Missing samples are predicted.
    """
    check_output(output, ".npz")
    from probdmp.estimator import PrimitiveLibrary

    name, primitive, recording = read_recording(execution, PrimitiveLibrary.load(model), label, index, dt)
    tracked = primitive.track(recording, **TaskOptions(start, goal, duration, start_velocity).arguments(primitive.primitive_))
    arrays = {"label": name, "index": index, **trajectory_arrays(tracked)}
    total = float(tracked.log_likelihoods.sum())
    if output is not None:
        save_arrays(output, arrays)
    if as_json:
        print_json(arrays | {"log_likelihood": total})
        return
    print_line(f"Recording {index}, tracked as {name_text(name)}: {recording.duration:.3f} s", style="bold")
    print_line(f"{_complete(recording)} of {recording.n_samples} samples complete, log-likelihood {total:.1f} nats")
    trajectory_table(tracked)


def _complete(recording: "Demonstration") -> int:
    """Samples without a missing number."""
    import numpy as np

    return int(np.isfinite(recording.positions).all(axis=1).sum())
