"""What recordings say, in hindsight, about what each sensor should have measured."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration
from probdmp.dmp import Primitive, Task, stack_tasks
from probdmp.execution.inference import INFERENCES
from probdmp.execution.readings import stack_readings
from probdmp.execution.sensor_array import SensorArray

__all__ = ["SmoothedOutputs", "smoothed_outputs"]


class SmoothedOutputs(NamedTuple):
    """Of N recordings at T times, given all of each."""

    log_likelihood: float
    """Of all of them, nats."""
    readings: FloatArray
    """(T, N, O) array, units of the outputs; NaN where nothing was measured."""
    residuals: FloatArray
    """(T, N, O) array: measured minus what is believed in hindsight."""
    spreads: FloatArray
    """(T, N, O, O) array: covariance of what is believed, without sensor noise."""


def smoothed_outputs(
    primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration], array: SensorArray
) -> SmoothedOutputs:
    """Smooth recordings.

    A start that was told is where the first reading was: this says nothing about the sensors, and is left out.
    """
    observed, dts = stack_readings(array, recordings), np.array([r.dt for r in recordings])
    told = [not np.isnan(task.start).all() for task in tasks]
    observed[0, told] = np.nan
    inference = INFERENCES[primitive.configuration.weight_uncertainty]
    executions = inference.prepare(primitive, stack_tasks(tasks), dts, len(observed))
    log_likelihood, means, covariances = inference.smooth_all(executions, observed, array)
    values, matrix, noise = array.lines(observed, means, covariances)
    residuals = values - np.matmul(matrix, means[..., None])[..., 0]
    # What a line leaves over of a nonlinear sensor is not known better in hindsight.
    spreads = matrix @ covariances @ matrix.mT + (noise - array.covariance)
    return SmoothedOutputs(log_likelihood, observed, residuals, spreads)
