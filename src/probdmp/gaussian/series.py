"""Many recordings of one system: what does not depend on the data is computed once.

Gains, innovation variances and normalising constants follow from the model and from which observations are missing, not from
what was observed. A recording is then filtered by a linear recursion for its deviation from the path that is expected without
observations, with F[t] = A (I - K[t] c) and g[t] = A K[t]:

    y = o - path,    e[t] = y[t] - c d[t],    d[t+1] = F[t] d[t] + g[t] y[t]

and smoothed by one backwards, rho[t] = c e[t] / S[t] + F[t]^T rho[t+1], d[t] + P[t] rho[t], P the covariance before the update.
Recordings lie row by row in memory, (N, T, D), and are not copied.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import LARGEST_MAGNITUDE, FloatArray, IntArray, check_array, check_count, is_plain
from probdmp.errors import InputError
from probdmp.gaussian import kernels
from probdmp.gaussian.density import LOG_2PI
from probdmp.gaussian.model import GaussianSequence, LinearGaussianModel
from probdmp.gaussian.scalar_systems import ScalarSystems, filter_scalar_systems, is_scalar, scalar_systems

__all__ = ["SharedGains", "score_series", "shared_gains", "shifted_paths", "smooth_series"]

MOST_THREADS = 1024
FEW = 8


class SharedGains(NamedTuple):
    """Everything about the recordings of a system of D degrees of freedom that does not depend on what they show."""

    systems: ScalarSystems
    path_states: FloatArray
    """The states expected without observations, (T, D, n) array."""
    path: FloatArray
    """The observations expected then, (T, D) array."""
    closed_loop: FloatArray
    """F, (T, D, n, n) array."""
    feedback: FloatArray
    """g, (T, D, n) array."""
    precisions: FloatArray
    """1 / S, (T, D) array."""
    predicted_covariances: FloatArray
    """P, (T, D, n, n) array: of the state before each update."""
    covariances: FloatArray
    """(T, D, n, n) array: of the state after each update."""
    normalisation: FloatArray
    """(D,) array, nats: the part of the log-likelihood that the data have no part in."""
    recursion: tuple[FloatArray, ...]
    """F, g, c and 1 / S of those states that observations depend on, now or later."""
    constant: float
    """Nats: its sum."""


def shared_gains(model: LinearGaussianModel) -> SharedGains:
    """The gains of complete recordings.

    Parameters
    ----------
    model : with the batch axis (D,), or none.

    Raises
    ------
    InputError
        If a number of the model is not finite or R not positive, or there is more than one input or sensor for each system.
    """
    model.check()
    if not is_scalar(model) or len(model.batch_shape) > 1:
        raise InputError(
            f"a model with one input, one sensor, at most {kernels.MOST_STATES} states, and one batch axis",
            f"one with {model.input_matrix.shape[-1]} inputs, {model.observation_matrix.shape[-2]} sensors, "
            f"{model.transition.shape[-1]} states, batch {model.batch_shape}",
            "filter_sequence takes any model.",
        )
    systems = scalar_systems(model)
    n_times, n_dof = model.n_steps, len(systems.noise)
    unseen = filter_scalar_systems(systems, np.full((n_times, n_dof), np.nan))
    seen = filter_scalar_systems(systems, np.zeros((n_times, n_dof)))
    a, b, c = systems.transition, systems.input_vector, systems.sensor
    predicted = np.empty_like(seen.covariances)
    predicted[0] = systems.initial_covariance
    drawn = systems.input_variances[..., None, None] * b[:, :, None] * b[:, None, :]
    predicted[1:] = a @ seen.covariances[:-1] @ a.mT + drawn
    feedback = np.matmul(a, seen.gains[..., None])[..., 0]
    closed_loop, precisions = a - feedback[..., :, None] * c[:, None, :], 1 / seen.variances
    kept = np.flatnonzero(np.any(a != 0, axis=(0, 1)) | np.any(c != 0, axis=0))
    normalisation = -0.5 * np.sum(np.log(seen.variances) + LOG_2PI, axis=0)
    return SharedGains(
        systems,
        unseen.means,
        np.sum(c * unseen.means, axis=-1),
        closed_loop,
        feedback,
        precisions,
        predicted,
        seen.covariances,
        normalisation,
        (*map(np.ascontiguousarray, (closed_loop[..., kept[:, None], kept], feedback[..., kept], c[:, kept])), precisions),
        float(normalisation.sum()),
    )


def score_series(
    gains: SharedGains, observations: FloatArray, n_threads: int = 1, paths: FloatArray | None = None
) -> FloatArray:
    """Total log-likelihood of each recording, (N,) array, nats.

    Parameters
    ----------
    observations : (N, T, D) array; NaN marks what was not seen, and that recording gets gains of its own.
    n_threads : threads that share the work.
    paths : (N, T, D) array, what is expected of each without observations; that of the model unless given.
    """
    observed, expected = _checked(gains, observations, paths)
    n_series, _, n_dof = observed.shape
    squares = np.empty((n_series, n_dof))
    if n_series == 0:
        return np.zeros(0)

    if n_threads == 1:  # a single short series takes less time than to ask for threads
        kernels.squared_innovations(*gains.recursion, observed, expected, squares)
    else:

        def score(part: slice) -> None:
            own = expected if len(expected) == 1 else expected[part]
            kernels.squared_innovations(*gains.recursion, observed[part], own, squares[part])

        kernels.in_threads(score, n_series, check_count(n_threads, "n_threads", most=MOST_THREADS))
    if n_series * n_dof <= FEW:  # numbers of which each takes less time than a call
        sums = [sum(of_each) for of_each in squares.tolist()]
        if sum(sums) < LARGEST_MAGNITUDE:  # no NaN among them, and no infinity
            return np.array([gains.constant - 0.5 * some for some in sums])
    total = np.add.reduce(squares, axis=1)
    if np.maximum.reduce(total) < LARGEST_MAGNITUDE:
        return gains.constant - 0.5 * total
    incomplete = np.argwhere(~(squares < LARGEST_MAGNITUDE))
    check_array(observed[incomplete[:, 0]], "observations", ("N", *gains.path.shape), missing=True)
    scores = gains.normalisation - 0.5 * squares
    scores[tuple(incomplete.T)] = _scores_of_own(gains, observed, expected, incomplete)
    return np.asarray(scores.sum(axis=1))


def shifted_paths(gains: SharedGains, initial_means: FloatArray, first_inputs: FloatArray) -> FloatArray:
    """Expected of recordings that begin elsewhere, or whose inputs differ by a constant: (N, T, D) array.

    Parameters
    ----------
    initial_means : (N, D, n) array.
    first_inputs : mean input of the first step, (N, D) array.
    """
    systems, path = gains.systems, gains.path
    a, b = systems.transition, systems.input_vector
    forward, driven = systems.sensor, np.zeros(len(a))  # c A^t, and c (A^0 + … + A^(t-1)) b
    responses = np.empty((len(path), len(a), a.shape[-1] + 1))
    for response in responses:
        response[:, :-1], response[:, -1] = forward, driven
        driven = driven + np.sum(forward * b, axis=-1)
        forward = np.matmul(forward[:, None], a)[:, 0]
    used = np.argmax(np.abs(b), axis=-1)[:, None]
    first = np.take_along_axis(systems.drifts[0] / np.where(b == 0, 1.0, b), used, axis=-1)[:, 0]
    shifts = np.concatenate([initial_means - systems.initial_mean, (first_inputs - first)[..., None]], axis=-1)
    return path + np.ascontiguousarray(np.moveaxis(np.matmul(shifts.swapaxes(0, 1), responses.transpose(1, 2, 0)), 0, -1))


def smooth_series(gains: SharedGains, observations: FloatArray, n_threads: int = 1) -> GaussianSequence:
    """The states given all of each recording: means (N, T, D, n), and covariances (T, D, n, n) that all have in common.

    Parameters
    ----------
    observations : (N, T, D) array, complete.

    Raises
    ------
    InputError
        If an observation is missing: the covariances are then those of one recording alone; see `smooth_sequence`.
    """
    observed, expected = _checked(gains, observations, None)
    if not np.isfinite(observed.sum()):  # one pass, and no array of its own
        raise InputError("complete recordings", "missing observations", "smooth_sequence smooths those, one by one.")
    sensor, states = gains.systems.sensor, gains.path_states
    smoothed = np.empty((len(observed), *states.shape))
    shared = (gains.closed_loop, gains.feedback, sensor, gains.precisions)

    def smooth(part: slice) -> None:
        kernels.smoothed_states(*shared, observed[part], expected, gains.predicted_covariances, states, smoothed[part])

    kernels.in_threads(smooth, len(observed), check_count(n_threads, "n_threads", most=MOST_THREADS))
    information = np.zeros(gains.covariances.shape[1:])
    covariances = np.empty_like(gains.covariances)
    told = sensor[:, :, None] * sensor[:, None, :]
    for t in range(len(covariances) - 1, -1, -1):
        information = told * gains.precisions[t, :, None, None] + gains.closed_loop[t].mT @ information @ gains.closed_loop[t]
        p = gains.predicted_covariances[t]
        smooth_covariance = p - p @ information @ p
        covariances[t] = (smooth_covariance + smooth_covariance.mT) / 2
    return GaussianSequence(smoothed, covariances)


def _checked(gains: SharedGains, observations: FloatArray, paths: FloatArray | None) -> tuple[FloatArray, FloatArray]:
    shape, hint = ("N", *gains.path.shape), "Recordings, then times, then degrees of freedom."
    observed = observations
    if not is_plain(observed) or observed.shape[1:] != gains.path.shape:
        observed = check_array(observations, "observations", shape, missing=True, hint=hint)
    if paths is None:
        return observed, gains.path[None]
    return observed, check_array(paths, "paths", observed.shape)


def _scores_of_own(gains: SharedGains, observed: FloatArray, expected: FloatArray, which: IntArray) -> FloatArray:
    """Log-likelihoods of single degrees of freedom (k, 2) of recordings in which something is missing, (k,) array."""
    series, dof = which.T
    deviations = observed[series, :, dof] - expected[series if len(expected) > 1 else 0, :, dof]
    systems, n_inputs = gains.systems, len(gains.systems.drifts)
    own = ScalarSystems(
        systems.transition[dof],
        systems.input_vector[dof],
        np.zeros((n_inputs, len(dof), systems.sensor.shape[1])),
        np.ascontiguousarray(systems.input_variances[:, dof]),
        systems.sensor[dof],
        systems.noise[dof],
        np.zeros_like(systems.initial_mean[dof]),
        systems.initial_covariance[dof],
    )
    return np.asarray(filter_scalar_systems(own, deviations.T).log_likelihoods.sum(axis=0))
