"""dynamax: the filter and smoother for one series, compiled by JAX and mapped over the series.

`vmap` maps over observations alone, so covariances and gains are computed once for all series, as they are here. Entry t of its
time-varying parameters belongs to the transition from t - 1 to t, and entry 0 to none.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from dynamax.linear_gaussian_ssm import lgssm_filter, lgssm_smoother
from dynamax.linear_gaussian_ssm.inference import (
    ParamsLGSSM,
    ParamsLGSSMDynamics,
    ParamsLGSSMEmissions,
    ParamsLGSSMInitial,
)

from peers.system import Score, Smooth, System
from probdmp.checks import FloatArray

__all__ = ["score_call", "smooth_call"]

DIFFERS = "adds 1e-9 to the diagonal of what it inverts (`psd_solve`), in whatever units the data are; "
"""Why its numbers are not quite those of others."""

jax.config.update("jax_enable_x64", True)


def score_call(system: System, observations: FloatArray) -> Score:
    """Observations (N, T); one series is not mapped."""
    parameters, seen = _parameters(system), jnp.asarray(observations[..., None])

    def log_likelihood(series: Any) -> Any:
        return lgssm_filter(parameters, series).marginal_loglik

    if len(observations) == 1:
        one, only = jax.jit(log_likelihood), seen[0]
        return lambda: np.atleast_1d(one(only))
    every = jax.jit(jax.vmap(log_likelihood))
    return lambda: np.asarray(every(seen))


def smooth_call(system: System, observations: FloatArray) -> Smooth:
    """Observations (N, T)."""
    parameters, seen = _parameters(system), jnp.asarray(observations[..., None])

    def moments(series: Any) -> Any:
        smoothed = lgssm_smoother(parameters, series)
        return smoothed.smoothed_means, smoothed.smoothed_covariances

    # Covariances do not depend on the data, so they come out once for all series.
    every = jax.jit(jax.vmap(moments, out_axes=(0, None)))

    def smooth() -> tuple[FloatArray, FloatArray]:
        means, covariances = every(seen)
        return np.asarray(means), np.asarray(covariances)

    return smooth


def _parameters(system: System) -> Any:
    n = len(system.transition)
    return ParamsLGSSM(
        ParamsLGSSMInitial(jnp.asarray(system.initial_mean), jnp.asarray(system.initial_covariance)),
        ParamsLGSSMDynamics(
            weights=jnp.asarray(system.transition),
            bias=jnp.asarray(np.concatenate([np.zeros((1, n)), system.drifts])),
            input_weights=jnp.zeros((n, 0)),
            cov=jnp.asarray(np.concatenate([np.zeros((1, n, n)), system.process_covariances])),
        ),
        ParamsLGSSMEmissions(
            weights=jnp.asarray(system.observation_row[None]),
            bias=jnp.zeros(1),
            input_weights=jnp.zeros((1, 0)),
            cov=jnp.asarray([[system.observation_variance]]),
        ),
    )
