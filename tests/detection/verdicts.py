"""Verdicts compared, and executions run online."""

from dataclasses import fields, replace

import numpy as np
import pytest

from probdmp.dmp import task_for
from probdmp.execution import OnlineExecution, SensorArray, readings_of

NUMBERS = ("time", "phase", "test_ratio")


def assert_same(one, other, rtol=1e-6, factor=1.0):
    """All fields; `factor`: how much later the other may be in seconds."""
    for field in fields(one):
        first, second = getattr(one, field.name), getattr(other, field.name)
        if field.name == "contributions":
            np.testing.assert_allclose(second, first, rtol=rtol, atol=rtol)
        elif field.name in NUMBERS:
            expected = first * factor if field.name == "time" else first
            assert second == pytest.approx(expected, rel=rtol, abs=1e-9), field.name
        else:
            assert second == first, field.name


def task_of(primitive, recording, told):
    """What an execution is told: its start and, if so asked, its goal and duration; both from the recording."""
    seen = [column[~np.isnan(column)] for column in recording.positions.T]
    start = recording.positions[0]
    if not told:
        return task_for(primitive, start)
    goal = np.array([column[-1] if len(column) else np.nan for column in seen])
    return task_for(primitive, start, goal, recording.duration)


def run_online(primitive, task, recording, detector):
    """The execution after its last tick, and all its steps; observed by what the detector was fitted with."""
    array = SensorArray(primitive, detector.sensors_)
    execution = OnlineExecution(primitive, task, recording.dt, detector, sensors=array)
    return execution, [execution.step(row) for row in readings_of(array, recording)]


def transformed(recordings, factors=1.0, offsets=0.0, slower=1.0, order=None):
    """In other units, elsewhere, at another pace, with degrees of freedom in another order."""
    moved = []
    for d in recordings:
        positions, names = d.positions * factors + offsets, d.names
        if order is not None:
            positions, names = positions[:, order], tuple(d.names[i] for i in order)
        moved.append(replace(d, positions=positions, dt=d.dt * slower, names=names))
    return moved
