"""The Kalman filter: one prediction, one update, and the loop over them.

    predict:  m- = A m + B u,   V- = A V A^T + Q
    update:   e = o - C m-,  S = C V- C^T + R,  K = V- C^T S^-1,
              m = m- + K e,  V = (I - K C) V- (I - K C)^T + K R K^T           (Joseph form)
    likelihood of a step: ln N(o; C m-, S), the density of the PREDICTION, never of the update

The same `predict` and `update` serve the recorded and the online case; a rollout is the loop with nothing observed. Where C and
R depend on where the state is believed to be, as those of a linearised sensor do, a function says what they are at each step.
Source: Meier & Schaal 2016, Algorithms 1 and 2; Bishop, Pattern Recognition and Machine Learning, section 13.3.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from probdmp.checks import BoolArray, FloatArray
from probdmp.gaussian.density import gaussian_log_density, invert_covariance
from probdmp.gaussian.model import GaussianSequence, LinearGaussianModel
from probdmp.gaussian.scalar_systems import filter_scalar_systems, is_scalar, scalar_systems

__all__ = ["AffineObservation", "FilteredSequence", "Update", "filter_sequence", "predict", "update"]


class AffineObservation(NamedTuple):
    """What was seen, as a linear function of the state with noise."""

    values: FloatArray
    """o, (*batch, O); NaN where nothing was seen."""
    matrix: FloatArray
    """C, (*batch, O, n)."""
    covariance: FloatArray
    """R, (*batch, O, O), positive definite."""
    believed: BoolArray | bool = True
    """(*batch, O): what is not is compared with what was expected, and then treated as if it had not been seen."""


Look = Callable[[FloatArray, FloatArray, FloatArray], AffineObservation]
"""From the predicted mean and covariance of the state, and the raw observation, to what that says of the state."""


class Update(NamedTuple):
    """The state after one observation, and what the observation said."""

    mean: FloatArray
    """m, (*batch, n)."""
    covariance: FloatArray
    """V, (*batch, n, n)."""
    innovation: FloatArray
    """e, (*batch, O); NaN where not seen."""
    innovation_covariance: FloatArray
    """S, (*batch, O, O), whether seen or not."""
    fused: BoolArray
    """(*batch, O): what was seen and believed."""
    gain: FloatArray
    """K, (*batch, n, O); 0 for what was not fused."""
    log_likelihood: FloatArray
    """ln N(o; C m-, S) over what was seen and believed, (*batch); 0 where nothing was."""


class FilteredSequence(NamedTuple):
    """What the filter says about a recording."""

    filtered: GaussianSequence
    """The state given the observations up to and including each time."""
    innovations: FloatArray
    """(T, *batch, O) array; NaN where not seen."""
    innovation_covariances: FloatArray
    """(T, *batch, O, O) array."""
    fused: BoolArray
    """(T, *batch, O) array: what was seen and believed."""
    log_likelihoods: FloatArray
    """(T, *batch) array, nats: density of what was seen at each time given the past."""
    gains: FloatArray
    """K, (T, *batch, n, O) array; 0 for what was not fused."""
    matrices: FloatArray
    """C, (T, *batch, O, n) array."""


def predict(
    mean: FloatArray, covariance: FloatArray, transition: FloatArray, drift: FloatArray, process_covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """One step ahead without an observation.

    Parameters
    ----------
    mean, covariance : (*batch, n) and (*batch, n, n) arrays, the state at t-1.
    transition : A, (*batch, n, n).
    drift : B u[t-1], (*batch, n).
    process_covariance : Q[t-1], (*batch, n, n).

    Returns
    -------
    Mean and covariance of the state at t.
    """
    # Alg. 1, lines 3-4; Alg. 2, lines 3-4
    return np.matmul(transition, mean[..., None])[..., 0] + drift, transition @ covariance @ transition.mT + process_covariance


def update(mean: FloatArray, covariance: FloatArray, observation: AffineObservation) -> Update:
    """Take one observation into account; for the sake of what was not seen, or is not believed, nothing changes.

    Parameters
    ----------
    mean, covariance : (*batch, n) and (*batch, n, n) arrays, the predicted state.
    """
    values, c, r, believed = observation
    seen = ~np.isnan(values) & believed
    innovation = values - np.matmul(c, mean[..., None])[..., 0]
    s = innovation_covariance = c @ covariance @ c.mT + r  # Alg. 2, line 5
    if not seen.all():
        # A sensor that was not seen gets a zero row in C and a unit variance: no gain, no density.
        both, identity = seen[..., :, None] & seen[..., None, :], np.eye(seen.shape[-1])
        c, r, s = np.where(seen[..., None], c, 0.0), np.where(both, r, identity), np.where(both, s, identity)
    precision, log_determinant = invert_covariance(s)
    residual = np.where(seen, innovation, 0.0)
    weighted = c.mT @ precision
    gain = covariance @ weighted  # Alg. 2, line 6: K = V C^T S^-1
    retention = np.eye(mean.shape[-1]) - gain @ c
    updated = retention @ covariance @ retention.mT + gain @ r @ gain.mT  # Alg. 2, line 8, in Joseph form
    return Update(
        mean + np.matmul(gain, residual[..., None])[..., 0],  # Alg. 2, line 7
        (updated + updated.mT) / 2,
        innovation,
        innovation_covariance,
        seen,
        gain,
        gaussian_log_density(residual, precision, log_determinant, np.sum(seen, axis=-1).astype(np.float64)),
    )


def filter_sequence(
    model: LinearGaussianModel, observations: FloatArray | None = None, look: Look | None = None
) -> FilteredSequence:
    """Kalman filter over a recording; without observations, a rollout with its uncertainty.

    Parameters
    ----------
    observations : (T, *batch, O) array; NaN marks what was not seen. None: nothing was seen at all.
    look : what an observation says of the state; unless given, what C and R of the model say. With it the innovations of
        `FilteredSequence` are those of what it returns.

    Raises
    ------
    InputError
        If the model is not finite, R not positive definite, or the shape of `observations` does not fit.
    """
    model.check()
    observed = model.check_observations(observations)
    if look is None and is_scalar(model):
        return _filter_scalar(model, observed)
    return _filter_any(model, observed, look)


def _filter_scalar(model: LinearGaussianModel, observed: FloatArray) -> FilteredSequence:
    """Systems with one input and one sensor, by the kernels."""
    batch, n = model.batch_shape, model.transition.shape[-1]
    found = filter_scalar_systems(scalar_systems(model), observed.reshape(len(observed), -1))
    shape = (len(observed), *batch)
    return FilteredSequence(
        GaussianSequence(found.means.reshape(*shape, n), found.covariances.reshape(*shape, n, n)),
        found.innovations.reshape(*shape, 1),
        found.variances.reshape(*shape, 1, 1),
        ~np.isnan(observed),
        found.log_likelihoods.reshape(shape),
        found.gains.reshape(*shape, n, 1),
        np.broadcast_to(model.observation_matrix, (*shape, 1, n)),
    )


def _filter_any(model: LinearGaussianModel, observed: FloatArray, look: Look | None) -> FilteredSequence:
    batch, n_states = model.batch_shape, model.transition.shape[-1]
    drifts, process_covariances = model.drifts(), model.process_covariances()
    mean = np.broadcast_to(model.initial_mean, (*batch, n_states))
    covariance = np.broadcast_to(model.initial_covariance, (*batch, n_states, n_states))
    steps, matrices = [], []
    for t in range(model.n_steps):
        if t > 0:  # u[t-1] drives s[t-1] to s[t]
            mean, covariance = predict(mean, covariance, model.transition, drifts[t - 1], process_covariances[t - 1])
        seen = AffineObservation(observed[t], model.observation_matrix, model.observation_covariance)
        if look is not None:
            seen = look(mean, covariance, observed[t])
        step = update(mean, covariance, seen)
        mean, covariance = step.mean, step.covariance
        steps.append(step)
        matrices.append(np.broadcast_to(seen.matrix, (*batch, *seen.matrix.shape[-2:])))
    stacked = Update(*(np.stack(column) for column in zip(*steps, strict=True)))
    return FilteredSequence(
        GaussianSequence(stacked.mean, stacked.covariance),
        stacked.innovation,
        stacked.innovation_covariance,
        stacked.fused,
        stacked.log_likelihood,
        stacked.gain,
        np.stack(matrices),
    )
