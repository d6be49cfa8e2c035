"""Executions that sensors observe, for tests of laws: movements of every kind, readings drawn from them, comparisons."""

import numpy as np
from strategies import make_joint_primitive, make_primitive, state_scales

from probdmp.dmp import task_for
from probdmp.execution import NonlinearSensor, recording_of_readings, sample_states, smooth_recording, track_recording

STEPS, DT = 12, 0.08
KINDS = ("independent", "joint", "felt")
"""Weights that are redrawn at every step, weights that stay, and these with a sensor channel that was learned with them."""
NAN = np.nan


def movement(kind, seed, n_dof=2):
    """A random primitive, and a task that tells part of what it does."""
    rng = np.random.default_rng(seed)
    changes = {"duration": DT * (STEPS - 1), "phase_step": 1 / (STEPS - 1), "observation_variances": np.full(n_dof, 1e-3)}
    if kind == "independent":
        p = make_primitive(rng, n_dof, 5, **changes)
    else:
        p = make_joint_primitive(rng, n_dof, 3, ("force",) if kind == "felt" else (), **changes)
    start = np.where(rng.random(n_dof) < 0.5, NAN, p.start + 0.1)
    return p, task_for(p, start, p.goal + 0.1 if rng.random() < 0.5 else None)


def readings(p, task, array, rng, missing=0.0, periods=()):
    """(T, O) readings of one execution drawn from the model.

    missing : share of single outputs that were not measured.
    periods : of each sensor, in samples; it measures nothing in between.
    """
    values = array.draw(sample_states(p, task, DT, 1, rng).reshape(1, STEPS, -1), rng)[0]
    values[rng.random(values.shape) < missing] = NAN
    for part, period in zip(array.slices.values(), periods, strict=False):
        values[np.arange(STEPS) % period != period // 2, part] = NAN
    return values


def recorded(array, values):
    return recording_of_readings(array, {name: values[:, part] for name, part in array.slices.items()}, DT)


def tracked(p, task, array, values):
    return track_recording(p, task, recorded(array, values), array)


def smoothed(p, task, array, values):
    return smooth_recording(p, task, recorded(array, values), array)


def difference(one, other, p):
    """Largest, of means and covariances of two trajectories, in standard deviations of the movement as planned."""
    unit = state_scales(p, DT).reshape(-1, 3)
    means = np.abs(one.means - other.means) / (unit + np.abs(one.means))
    covariances = np.abs(one.covariances - other.covariances) / (unit[:, :, None] * unit[:, None, :])
    felt = [
        np.abs(getattr(c, k) - getattr(other.channels[n], k)).max() for n, c in one.channels.items() for k in ("means", "stds")
    ]
    return max(means.max(), covariances.max(), *felt, 0.0)


def nonlinear(sensor, linearization, jacobian=False):
    """A linear sensor as a function of all states; the arguments are (D,) arrays of one quantity each."""
    order = np.arange(sensor.matrix.shape[1]).reshape(-1, 3).T.ravel()  # acceleration of all, then velocity, then position
    matrix = sensor.matrix[:, order]
    return NonlinearSensor(
        sensor.name,
        lambda a, v, p: matrix @ np.concatenate([a, v, p]),
        sensor.covariance,
        (lambda a, v, p: matrix) if jacobian else None,
        ("acceleration", "velocity", "position"),
        linearization,
        sensor.outputs,
        sensor.gate,
    )
