"""The noise R of each sensor by expectation maximisation over recorded executions; all else stays fixed.

    E  smooth every recording with the present R: mean m[t] and covariance V[t] of what each sensor measures, given all of it
    M  R = mean over what was measured of (o - C m)(o - C m)^T + C V C^T

The log-likelihood never decreases. Plain EM creeps where a sensor is far more precise than what is expected of the movement;
so the step is lengthened along the geodesic of covariances, R (R^-1 R_M)^eta, as long as the likelihood goes on to rise.
Nonlinear sensors are linearised as the filter does.

Sources: Bishop, Pattern Recognition and Machine Learning, equation 13.115; Salakhutdinov & Roweis, Adaptive overrelaxed bound
optimization methods, ICML 2003; Bhatia, Positive Definite Matrices (2007), chapter 6.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from probdmp.checks import FloatArray, check_choice
from probdmp.demonstrations import Demonstration
from probdmp.dmp import Primitive, Task
from probdmp.errors import InputError
from probdmp.execution.recordings import check_tasks
from probdmp.execution.sensor_array import SensorArray
from probdmp.execution.sensors import Sensor
from probdmp.execution.smoothed_outputs import SmoothedOutputs, smoothed_outputs

__all__ = ["COVARIANCES", "SensorNoise", "estimate_sensor_noise"]

COVARIANCES = ("as_given", "full", "diagonal", "auto")
MOST_ITERATIONS = 60
TOLERANCE = 1e-3
"""Relative change of every variance by an M step below which the iteration stops."""
STEP_GROWTH = 1.5
LEAST_SHARE = 1e-12
"""Least variance, as a fraction of what was measured."""
LEFT_OUT = 3
"""Parts into which recordings are divided, to choose between a diagonal and a full R."""


@dataclass(frozen=True, slots=True, eq=False)
class SensorNoise:
    """What EM found."""

    sensors: tuple[Sensor, ...]
    """The sensors with the noise that was found."""
    log_likelihoods: FloatArray
    """(iterations,) array, nats: of all recordings, at the noise with which each iteration began."""
    converged: bool
    """Whether the last M step would have changed every variance by less than the tolerance."""


def estimate_sensor_noise(
    primitive: Primitive,
    sensors: Sequence[Sensor],
    tasks: Sequence[Task],
    recordings: Sequence[Demonstration],
    covariance: str = "as_given",
) -> SensorNoise:
    """The noise of each sensor.

    Parameters
    ----------
    sensors : with a first guess of their noise; that of channels which are not among them stays as it is. Their gates are left
        open while it is learned, or what they let pass would change with it.
    tasks : what each of the N recordings was asked to do.
    covariance : a name from `COVARIANCES`: what R may be. `"auto"` takes a full one for the sensors that are likelier with it
        on recordings that were left out, each considered by itself.

    Raises
    ------
    InputError
        If an output of a sensor was never measured, or its first guess is infinite.
    """
    check_choice(covariance, "covariance", COVARIANCES)
    check_tasks(tasks, recordings)
    gated = SensorArray(primitive, sensors)
    for sensor in sensors:
        if not np.isfinite(sensor.covariance).all():
            hint = "Guess how noisy it may be: what it measures, unless it says nothing."
            raise InputError(f"a finite first guess of the noise of sensor {sensor.name!r}", "an infinite one", hint)
    array = SensorArray(primitive, [replace(sensor, gate=None) for sensor in gated.sensors])
    shapes = {sensor.name: _is_full(sensor) if covariance == "as_given" else covariance == "full" for sensor in sensors}
    if covariance == "auto":
        shapes = _likelier_shapes(primitive, array, shapes, tasks, recordings)
    found = _maximize(primitive, array, shapes, tasks, recordings)
    with_gates = zip(found.sensors, gated.sensors, strict=True)
    return replace(found, sensors=tuple(replace(learned, gate=sensor.gate) for learned, sensor in with_gates))


def _is_full(sensor: Sensor) -> bool:
    return bool(np.any(sensor.covariance != np.diag(np.diagonal(sensor.covariance))))


def _maximize(
    primitive: Primitive,
    array: SensorArray,
    is_full: dict[str, bool],
    tasks: Sequence[Task],
    recordings: Sequence[Demonstration],
) -> SensorNoise:
    current, safe, best, length, history = array, array, -np.inf, 1.0, list[float]()
    for _ in range(MOST_ITERATIONS):
        outputs = smoothed_outputs(primitive, tasks, recordings, current)
        if outputs.log_likelihood < best - 1e-9 * abs(best):  # the lengthened step went too far: take the plain one
            current, length, best = safe, 1.0, -np.inf if current is safe else best
            continue
        best = outputs.log_likelihood
        history.append(best)
        found = _maximized(current, outputs, is_full)
        safe = _with_noise(primitive, current, found)
        if _is_settled(current, found):
            return SensorNoise(current.sensors, np.array(history), True)
        longer = {name: _further(_noise_of(current, name), noise, length) for name, noise in found.items()}
        current = _with_noise(primitive, current, longer)
        length *= STEP_GROWTH
    return SensorNoise(safe.sensors, np.array(history), False)


def _maximized(array: SensorArray, outputs: SmoothedOutputs, is_full: dict[str, bool]) -> dict[str, FloatArray]:
    """The M step: R of each sensor that is to be learned."""
    found = {}
    for sensor in array.sensors:
        if sensor.name not in is_full:
            continue
        part = array.slices[sensor.name]
        seen = ~np.isnan(outputs.residuals[..., part])
        complete = seen.all(axis=-1)
        if not np.all(np.any(complete if is_full[sensor.name] else seen, axis=(0, 1))):
            wanted = "all of its outputs at once" if is_full[sensor.name] else "each of its outputs"
            raise InputError(f"recordings in which sensor {sensor.name!r} has measured {wanted}", "none")
        errors = np.nan_to_num(outputs.residuals[..., part])
        squares = errors[..., :, None] * errors[..., None, :] + outputs.spreads[..., part, part]
        if is_full[sensor.name]:
            noise = squares[complete].mean(axis=0)
        else:
            variances = np.diagonal(squares, axis1=-2, axis2=-1)
            noise = np.diag(np.sum(variances * seen, axis=(0, 1)) / np.maximum(seen.sum(axis=(0, 1)), 1))
        least = LEAST_SHARE * np.nanmean(outputs.readings[..., part] ** 2)
        found[sensor.name] = (noise + noise.T) / 2 + least * np.eye(sensor.n_outputs)
    return found


def _noise_of(array: SensorArray, name: str) -> FloatArray:
    return next(sensor.covariance for sensor in array.sensors if sensor.name == name)


def _with_noise(primitive: Primitive, array: SensorArray, noise: dict[str, FloatArray]) -> SensorArray:
    return SensorArray(primitive, [replace(s, covariance=noise.get(s.name, s.covariance)) for s in array.sensors])


def _is_settled(array: SensorArray, found: dict[str, FloatArray]) -> bool:
    """Whether what was found is what there was."""
    for name, noise in found.items():
        before, scale = _noise_of(array, name), np.sqrt(np.diagonal(noise))
        if np.any(np.abs(noise - before) > TOLERANCE * np.multiply.outer(scale, scale)):
            return False
    return True


def _further(before: FloatArray, after: FloatArray, length: float) -> FloatArray:
    """From one covariance towards another, `length` times as far: L W^length L^T, before = L L^T, after = L W L^T."""
    factor = np.linalg.cholesky(before)
    inverse = np.linalg.inv(factor)
    eigenvalues, vectors = np.linalg.eigh(inverse @ after @ inverse.T)
    moved = factor @ vectors * np.maximum(eigenvalues, LEAST_SHARE) ** (length / 2)
    return np.asarray(moved @ moved.T)


def _likelier_shapes(
    primitive: Primitive,
    array: SensorArray,
    learned: Iterable[str],
    tasks: Sequence[Task],
    recordings: Sequence[Demonstration],
) -> dict[str, bool]:
    """Which of the sensors to be learned are likelier with a full R, on recordings that did not teach it; with fewer than two,
    none.
    """
    none = dict.fromkeys(learned, False)
    chosen = dict(none)
    parts = [list(range(i, len(recordings), LEFT_OUT)) for i in range(min(LEFT_OUT, len(recordings)))]
    if len(parts) < 2:
        return none

    def likelihood(shapes: dict[str, bool]) -> float:
        total = 0.0
        for part in parts:
            rest = [k for k in range(len(recordings)) if k not in part]
            noise = _maximize(primitive, array, shapes, [tasks[k] for k in rest], [recordings[k] for k in rest])
            taught = SensorArray(primitive, noise.sensors)
            left_out = [tasks[k] for k in part], [recordings[k] for k in part]
            total += smoothed_outputs(primitive, *left_out, taught).log_likelihood
        return total

    diagonal = likelihood(none)
    for sensor in array.sensors:
        if sensor.name in none and sensor.n_outputs > 1:
            chosen[sensor.name] = likelihood(none | {sensor.name: True}) > diagonal
    return chosen
