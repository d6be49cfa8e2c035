"""Linear systems that move on top of a Gaussian that stands still, tick by tick, by a kernel.

The same as `probdmp.gaussian.augmented`, but each of the G groups of states has W of the z for itself. What is asked of a group
then takes W columns of z, not all G W; only what is known of z, its covariance, is of all of them, and of it one triangle.

    s_g[t] = path_g[t] + designs_g[t] z_g + d_g[t],    o_g[t] = C_g s_g[t] + v_g[t],  v_g ~ N(0, R_g)
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.gaussian import kernels
from probdmp.gaussian.augmented import Deviation
from probdmp.gaussian.coupling import block_diagonal
from probdmp.gaussian.filtering import AffineObservation
from probdmp.gaussian.static import Belief, linear_moments

__all__ = ["AugmentedState", "AugmentedTick", "Look", "Moves", "augmented_tick", "no_observations", "states_now"]


class Look(NamedTuple):
    """The states at one time as functions of z, but for their deviations."""

    path: FloatArray
    """(G, n) array."""
    designs: FloatArray
    """(G, n, W) array."""


class AugmentedState(NamedTuple):
    """What is known before an observation."""

    belief: Belief
    """Of z, (G W); of the covariance the lower triangle, whatever stands above."""
    deviation: Deviation
    """Given z; its loading is (G, n, W)."""


class Moves(NamedTuple):
    """How deviations go on."""

    transition: FloatArray
    """A, (G, n, n) array."""
    driven: FloatArray
    """Q, (G, n, n) array."""


class AugmentedTick(NamedTuple):
    """What an observation has shown, Q = G S outputs of all groups, and the states at the next tick."""

    n_fused: int
    """Outputs that were seen and believed."""
    states: FloatArray
    """(G, n) array."""
    state_covariances: FloatArray
    """(G n / 3, 3, 3) array: of the covariance the blocks along the diagonal."""
    innovations: FloatArray
    """(Q,) array; NaN where not seen."""
    innovation_covariance: FloatArray
    """(Q, Q) array, whether seen or not."""
    log_likelihoods: FloatArray
    """(Q,) array, nats; see `probdmp.gaussian.density.log_density_shares`."""
    fused: IntArray
    """(Q,) array: 1 for what was seen and believed."""
    gains: FloatArray
    """Of z, (Q, G W) array; empty unless asked for."""
    deviation_gains: FloatArray
    """K of the deviations given z, (G, n, S) array."""


BLOCK = 3
"""States of which a covariance is wanted together."""


def no_observations(belief: Belief, look: Look) -> AugmentedState:
    """Before the first observation: nothing deviates yet."""
    *shape, n = look.path.shape
    deviation = Deviation(np.zeros((*shape, n)), np.zeros(look.designs.shape), np.zeros((*shape, n, n)))
    return AugmentedState(belief, deviation)


def augmented_tick(
    state: AugmentedState, now: Look, ahead: Look, moves: Moves, observed: AffineObservation, with_gains: bool = False
) -> tuple[AugmentedState, AugmentedTick]:
    """Take one observation into account, and go on to the next tick.

    Parameters
    ----------
    now, ahead : at this tick, and at the next.
    observed : values (G, S), NaN where nothing was measured, C (G, S, n), R (G, S, S), and what is believed of them.
    with_gains : whether gains of z are wanted.

    Raises
    ------
    ValueError
        If the innovations have no positive definite covariance.
    """
    (values, sensors, noise, believed), ((mean, covariance), deviation) = observed, state
    (n_groups, size), r = values.shape, len(mean)
    q, n_states, empty = n_groups * size, now.path.shape[1], np.empty
    trusted = _all(values.shape) if believed is True else np.asarray(believed, dtype=np.int64)
    belief_then = Belief(empty(r), empty((r, r)))
    deviation_then = Deviation(empty(now.path.shape), empty(now.designs.shape), empty(deviation.covariance.shape))
    found = (
        empty(now.path.shape),
        empty((n_groups * n_states // BLOCK, BLOCK, BLOCK)),
        empty(q),
        empty((q, q)),
        empty(q),
        empty(q, dtype=np.int64),
        empty((q if with_gains else 0, r)),
        empty((n_groups, n_states, size)),
    )
    n_fused = kernels.augmented_step(
        values, trusted, *now, *ahead, sensors, noise, *moves, mean, covariance, *deviation,
        *belief_then, *deviation_then, *found,
    )  # fmt: skip
    return AugmentedState(belief_then, deviation_then), AugmentedTick(n_fused, *found)


@lru_cache(maxsize=32)
def _all(shape: tuple[int, ...]) -> IntArray:
    ones = np.ones(shape, dtype=np.int64)
    ones.flags.writeable = False
    return ones


def states_now(state: AugmentedState, look: Look) -> tuple[FloatArray, FloatArray]:
    """Mean (G n) and covariance (G n, G n) of all states before an observation."""
    (mean, covariance), deviation = state
    designs = block_diagonal(look.designs + deviation.loading)
    lower = np.tril(covariance)
    means, covariances = linear_moments(Belief(mean, lower + np.tril(lower, -1).T), designs)
    return (look.path + deviation.offset).ravel() + means, covariances + block_diagonal(deviation.covariance)
