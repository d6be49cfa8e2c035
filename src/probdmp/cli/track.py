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
    Sensors,
    Start,
    StartVelocity,
    TaskOptions,
    check_output,
)
from probdmp.cli.output import print_json, print_line
from probdmp.cli.recordings import read_sensed
from probdmp.cli.summaries import name_text
from probdmp.cli.trajectories import save_arrays, sensor_table, trajectory_arrays, trajectory_table

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
    sensors: Sensors = None,
    output: OutputArrays = None,
    as_json: Json = False,
) -> None:
    """Follow a recorded execution with the Kalman filter.

    The state at each time given what was seen until then.

    In JSON and in the file, beside times, means, stds and learned channels: log_likelihoods (T), nats, contributions to them
    (T, O) by output of the sensors, innovations (T, O), measured minus predicted, and their variances; of each sensor
    test_ratios (T), above 1 beyond its gate, and how many readings were fused, rejected or missing. Missing samples are
    predicted.
    """
    check_output(output, ".npz")
    from probdmp.estimator import PrimitiveLibrary

    name, primitive, recording, seen_by = read_sensed(execution, PrimitiveLibrary.load(model), label, index, dt, sensors)
    task = TaskOptions(start, goal, duration, start_velocity).arguments(primitive.primitive_)
    tracked = primitive.track(recording, sensors=seen_by, **task)
    arrays = {"label": name, "index": index, **trajectory_arrays(tracked)}
    total = float(tracked.log_likelihoods.sum())
    if output is not None:
        save_arrays(output, arrays)
    if as_json:
        print_json(arrays | {"log_likelihood": total})
        return
    print_line(f"Recording {index}, tracked as {name_text(name)}: {recording.duration:.3f} s", style="bold")
    # Where other sensors were asked for, it does not matter whether positions are complete.
    complete = f"{_complete(recording)} of {recording.n_samples} samples complete, " if seen_by is None else ""
    print_line(f"{complete}log-likelihood {total:.1f} nats")
    sensor_table(tracked)
    trajectory_table(tracked)


def _complete(recording: "Demonstration") -> int:
    """Samples without a missing number."""
    import numpy as np

    return int(np.isfinite(recording.positions).all(axis=1).sum())
