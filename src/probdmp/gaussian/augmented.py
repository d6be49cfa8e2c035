"""Linear systems that move on top of a Gaussian that stands still.

    z ~ N(m, P);    d_g[t] = A d_g[t-1] + e_g[t],  d_g[0] = 0,  e_g ~ N(0, Q_g)
    o_g[t] = G_g[t] z + C_g d_g[t] + v_g[t],  v_g ~ N(0, R_g)            for each of the groups g, independent but for z

Given z, every d_g has a Kalman filter of its own, with a gain K that does not depend on z. So its mean is affine in z,

    d_g | z, o  ~  N(a + L z, V),    predict:  a <- A a,  L <- A L,  V <- A V A^T + Q

and an innovation, (o - C a) - (G + C L) z, is an observation of z with covariance S = C V C^T + R that owes nothing to those
before it: z is conditioned as in `probdmp.gaussian.static`, with all innovation covariances and likelihoods. Then

    update:  a <- a + K (o - C a),    L <- L - K (G + C L),    V <- (I - K C) V (I - K C)^T + K R K^T

Source: Rosenberg, Random coefficient models, Annals of Economic and Social Measurement 2 (1973); de Jong, The diffuse Kalman
filter, Annals of Statistics 19 (1991).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from probdmp.checks import BoolArray, FloatArray
from probdmp.gaussian.coupling import block_diagonal
from probdmp.gaussian.density import invert_covariance
from probdmp.gaussian.static import Belief, StaticUpdate, observe

__all__ = ["AugmentedUpdate", "Deviation", "no_deviation", "observe_deviation", "predict_deviation", "smooth_deviations"]


class Deviation(NamedTuple):
    """The states d as functions of z: d = offset + loading z + N(0, covariance)."""

    offset: FloatArray
    """a, (*batch, G, n)."""
    loading: FloatArray
    """L, (*batch, G, n, r)."""
    covariance: FloatArray
    """V, (*batch, G, n, n)."""


class AugmentedUpdate(NamedTuple):
    """What is known after an observation, and what the smoother needs of it."""

    seen: StaticUpdate
    """What it said of z; innovations (*batch, G S) and their covariance are those of the observation given the past."""
    deviation: Deviation
    scores: FloatArray
    """C^T S^-1 (o - C a, G + C L), (*batch, G, n, 1 + r); 0 where not seen."""
    informations: FloatArray
    """C^T S^-1 C, (*batch, G, n, n)."""
    retentions: FloatArray
    """I - K C, (*batch, G, n, n)."""
    gains: FloatArray
    """K, (*batch, G, n, S); 0 where not seen."""


def no_deviation(batch: tuple[int, ...], n_states: int, size: int) -> Deviation:
    """d = 0, known exactly.

    Parameters
    ----------
    batch : (*batch, G).
    size : r.
    """
    return Deviation(np.zeros((*batch, n_states)), np.zeros((*batch, n_states, size)), np.zeros((*batch, n_states, n_states)))


def predict_deviation(deviation: Deviation, transition: FloatArray, noise: FloatArray) -> Deviation:
    """One step ahead.

    Parameters
    ----------
    transition : A, (*batch, G, n, n); batch axes may be of length 1.
    noise : Q, (*batch, G, n, n).
    """
    return Deviation(
        np.matmul(transition, deviation.offset[..., None])[..., 0],
        transition @ deviation.loading,
        transition @ deviation.covariance @ transition.mT + noise,
    )


def observe_deviation(
    belief: Belief,
    deviation: Deviation,
    observation: FloatArray,
    design: FloatArray,
    sensors: FloatArray,
    noise: FloatArray,
    believed: BoolArray | bool = True,
) -> AugmentedUpdate:
    """Take one observation into account.

    Parameters
    ----------
    observation : o, (*batch, G, S), less what is known of it; NaN marks a sensor that was not seen.
    design : G, (*batch, G, S, r).
    sensors : C, (*batch, G, S, n); batch axes may be of length 1.
    noise : R, (*batch, G, S, S), positive definite; likewise.
    believed : (*batch, G, S): see `probdmp.gaussian.static.observe`.
    """
    offset, loading, covariance = deviation
    (n_groups, size), n_states = observation.shape[-2:], offset.shape[-1]
    seen = ~np.isnan(observation) & believed
    errors = observation - np.matmul(sensors, offset[..., None])[..., 0]
    designs = design + sensors @ loading
    total = sensors @ covariance @ sensors.mT + noise
    # A sensor that was not seen has a unit variance and no weight.
    known = np.where(seen[..., :, None] & seen[..., None, :], total, np.eye(size))
    weighted = np.where(seen[..., None], sensors, 0.0).mT @ invert_covariance(known)[0]  # C^T S^-1
    gain = covariance @ weighted
    retention = np.eye(n_states) - gain @ sensors
    both = np.concatenate([np.where(seen, errors, 0.0)[..., None], designs], axis=-1)
    moved = gain @ both
    updated = retention @ covariance @ retention.mT + gain @ noise @ gain.mT
    flat = (*observation.shape[:-2], n_groups * size)
    independent = block_diagonal(np.broadcast_to(total, (*observation.shape, size)))
    return AugmentedUpdate(
        observe(belief, errors.reshape(flat), designs.reshape(*flat, -1), independent, seen.reshape(flat)),
        Deviation(offset + moved[..., 0], loading - moved[..., 1:], updated),
        weighted @ both,
        weighted @ sensors,
        retention,
        gain,
    )


def smooth_deviations(updates: Sequence[AugmentedUpdate], transition: FloatArray) -> list[Deviation]:
    """d at each time given z and all observations, before and after; see `probdmp.gaussian.smoothing`."""
    first = updates[0].deviation
    score, information = np.zeros_like(updates[0].scores), np.zeros_like(first.covariance)
    smoothed = []
    for update in reversed(updates):
        (offset, loading, covariance), kept = update.deviation, update.retentions
        drawn, correction = covariance @ score, covariance @ information @ covariance
        smoothed.append(Deviation(offset + drawn[..., 0], loading - drawn[..., 1:], covariance - correction))
        score = transition.mT @ (update.scores + kept.mT @ score)
        information = transition.mT @ (update.informations + kept.mT @ information @ kept) @ transition
    return smoothed[::-1]
