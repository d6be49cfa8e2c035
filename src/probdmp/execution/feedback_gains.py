"""The gain of the feedback that follows from the covariances: the paper's A K (Meier & Schaal 2016, Algorithm 2).

The command for tick t + 1 is the prediction from what is known at tick t, with the innovation e of tick t in it:

    mu_p[t+1] = A mu_p[t] + B u[t] + A K[t] e[t]

So A K[t] is what a unit innovation adds to the command. It depends on covariances alone, hence not on what is measured, as long
as sensors are linear and every reading is believed. It is read off the filters that execute: what they command after an
innovation less what they command after none. Parameters that stay (joint weights) have no A and K of their own states; what is
commanded answers to an innovation just as linearly, and so it has this gain too.
"""

from copy import copy

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive, Task, step_count
from probdmp.errors import InputError
from probdmp.execution.sensor_array import SensorArray
from probdmp.execution.sensors import NonlinearSensor
from probdmp.execution.step_filters import StepFilter, step_filter

__all__ = ["feedback_gains"]


def feedback_gains(primitive: Primitive, task: Task, dt: float, array: SensorArray | None = None) -> FloatArray:
    """How the state commanded for the next tick answers to a unit innovation of each output, all of them measured at all ticks.

    Parameters
    ----------
    dt : seconds between ticks.
    array : the sensors that modulate the command; positions and learned channels unless given.

    Returns
    -------
    (T - 1, D, 3, O) array, units of acceleration, velocity and position over those of the outputs. Entry t is for the
    innovation of tick t and the command for tick t + 1; at tick 0, a start that was told leaves nothing to learn about it.

    Raises
    ------
    InputError
        If a sensor is nonlinear or has a gate: its gain depends on what is measured.
    """
    sensors = SensorArray(primitive) if array is None else array
    if sensors.is_adaptive:
        hint = "Linearise it where you want to know the gain, or compare the commands of two executions."
        raise InputError("linear sensors without gates, for a gain that does not depend on readings", _adaptive(sensors), hint)
    n_steps = step_count(float(task.duration), dt)
    filtering = step_filter(primitive, task, dt, n_steps, sensors)
    return np.stack([_gain_of_tick(filtering, sensors, primitive.n_dof) for _ in range(n_steps - 1)])


def _gain_of_tick(filtering: StepFilter, array: SensorArray, n_dof: int) -> FloatArray:
    """A K of this tick, (D, 3, O) array; the filter goes on to the next, as if each reading was as expected."""
    looked = copy(filtering).step(np.zeros(len(array.outputs)))
    expected, scales = -looked.innovations, np.sqrt(looked.innovation_variances)
    probes = {output: copy(filtering) for output in np.flatnonzero(~array.silent).tolist()}
    undisturbed = filtering.step(expected).mean[:n_dof]
    gain = np.zeros((*undisturbed.shape, len(array.outputs)))
    for output, probe in probes.items():
        disturbed = expected.copy()
        disturbed[output] += scales[output]
        gain[..., output] = (probe.step(disturbed).mean[:n_dof] - undisturbed) / scales[output]
    return gain


def _adaptive(array: SensorArray) -> str:
    own = [sensor.name for sensor in array.sensors if sensor.gate is not None or isinstance(sensor, NonlinearSensor)]
    return ", ".join(map(repr, own))
