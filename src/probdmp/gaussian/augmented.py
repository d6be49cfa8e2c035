"""Linear systems that move on top of a Gaussian that stands still.

    z ~ N(m, P);    d_i[t] = A d_i[t-1] + e_i[t],  d_i[0] = 0,  e_i ~ N(0, Q_i)
    o_i[t] = G_i[t] z + c d_i[t] + v_i[t],  v_i ~ N(0, R_i)                  for each of the sensors i, independent but for z

Given z, every d_i has a Kalman filter of its own, with a gain K that does not depend on z. So its mean is affine in z,

    d_i | z, o  ~  N(a + L z, V),    predict:  a <- A a,  L <- A L,  V <- A V A^T + Q

and an innovation, (o - c a) - (G + c L) z, is an observation of z with variance S = c V c^T + R that owes nothing to those
before it: z is conditioned as in `probdmp.gaussian.static`, with all innovation covariances and likelihoods. Then

    update:  a <- a + K (o - c a),    L <- L - K (G + c L),    V <- (I - K c) V (I - K c)^T + K R K^T

Source: Rosenberg, Random coefficient models, Annals of Economic and Social Measurement 2 (1973); de Jong, The diffuse Kalman
filter, Annals of Statistics 19 (1991).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.gaussian.static import Belief, StaticUpdate, observe

__all__ = ["AugmentedUpdate", "Deviation", "no_deviation", "observe_deviation", "predict_deviation", "smooth_deviations"]


class Deviation(NamedTuple):
    """The states d as functions of z: d = offset + loading z + N(0, covariance)."""

    offset: FloatArray
    """a, (*batch, O, n)."""
    loading: FloatArray
    """L, (*batch, O, n, r)."""
    covariance: FloatArray
    """V, (*batch, O, n, n)."""


class AugmentedUpdate(NamedTuple):
    """What is known after an observation, and what the smoother needs of it."""

    seen: StaticUpdate
    """What it said of z; innovations and their covariance are those of the observation given the past."""
    deviation: Deviation
    scores: FloatArray
    """c^T S^-1 (o - c a, G + c L), (*batch, O, n, 1 + r); 0 where not seen."""
    informations: FloatArray
    """c^T S^-1 c, (*batch, O, n, n)."""
    retentions: FloatArray
    """I - K c, (*batch, O, n, n)."""


def no_deviation(batch: tuple[int, ...], n_states: int, size: int) -> Deviation:
    """d = 0, known exactly.

    Parameters
    ----------
    batch : (*batch, O).
    size : r.
    """
    return Deviation(np.zeros((*batch, n_states)), np.zeros((*batch, n_states, size)), np.zeros((*batch, n_states, n_states)))


def predict_deviation(deviation: Deviation, transition: FloatArray, noise: FloatArray) -> Deviation:
    """One step ahead.

    Parameters
    ----------
    transition : A, (*batch, O, n, n); batch axes may be of length 1.
    noise : Q, (*batch, O, n, n).
    """
    return Deviation(
        np.matmul(transition, deviation.offset[..., None])[..., 0],
        transition @ deviation.loading,
        transition @ deviation.covariance @ transition.mT + noise,
    )


def observe_deviation(
    belief: Belief, deviation: Deviation, observation: FloatArray, design: FloatArray, sensor: int, variances: FloatArray
) -> AugmentedUpdate:
    """Take one observation into account.

    Parameters
    ----------
    observation : o, (*batch, O), less what is known of it; NaN marks a sensor that was not seen.
    design : G, (*batch, O, r).
    sensor : which of the states d is measured: c is a unit vector.
    variances : R, (*batch, O), > 0.
    """
    offset, loading, covariance = deviation
    errors, designs = observation - offset[..., sensor], design + loading[..., sensor, :]
    spread = covariance[..., sensor]
    total = spread[..., sensor] + variances
    weight = np.where(np.isnan(observation), 0.0, 1 / total)
    gain = spread * weight[..., None]
    unit = np.eye(offset.shape[-1])[sensor]
    retention = np.eye(offset.shape[-1]) - gain[..., :, None] * unit
    both = np.concatenate([np.where(np.isnan(errors), 0.0, errors)[..., None], designs], axis=-1)
    updated = retention @ covariance @ retention.mT + gain[..., :, None] * gain[..., None, :] * variances[..., None, None]
    return AugmentedUpdate(
        observe(belief, errors, designs, total),
        Deviation(offset + gain * both[..., :1], loading - gain[..., :, None] * designs[..., None, :], updated),
        unit[:, None] * (weight[..., None] * both)[..., None, :],
        weight[..., None, None] * np.outer(unit, unit),
        retention,
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
