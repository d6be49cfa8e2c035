"""One tick of what moves on top of a Gaussian that stands still, in NumPy: the twin of `augmented_step` in `_kernels.c`."""

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.gaussian.augmented import Deviation, observe_deviation, predict_deviation
from probdmp.gaussian.coupling import block_diagonal
from probdmp.gaussian.static import Belief

__all__ = ["augmented_step"]


def augmented_step(
    observation: FloatArray,
    believed: IntArray,
    path: FloatArray,
    designs: FloatArray,
    next_path: FloatArray,
    next_designs: FloatArray,
    sensors: FloatArray,
    noise: FloatArray,
    transition: FloatArray,
    driven: FloatArray,
    mean: FloatArray,
    covariance: FloatArray,
    offset: FloatArray,
    loading: FloatArray,
    spread: FloatArray,
    next_mean: FloatArray,
    next_covariance: FloatArray,
    next_offset: FloatArray,
    next_loading: FloatArray,
    next_spread: FloatArray,
    states: FloatArray,
    state_covariances: FloatArray,
    innovations: FloatArray,
    innovation_covariance: FloatArray,
    log_likelihoods: FloatArray,
    fused: IntArray,
    gains: FloatArray,
    deviation_gains: FloatArray,
) -> int:
    """Update with what was observed, then predict, for G groups of n states and S outputs, each of which has W of the z.

    Parameters
    ----------
    observation, believed : (G, S) arrays; NaN was not seen, and what is not believed (0) counts as little.
    path, designs, next_path, next_designs : (G, n) and (G, n, W) arrays: states are path + designs z + deviation, now and next.
    sensors, noise : C (G, S, n) and R (G, S, S).
    transition, driven : A and Q of the deviations, (G, n, n) arrays.
    mean, covariance : of z, (G W) and (G W, G W); of the covariance the lower triangle, here and where it is written.
    offset, loading, spread : of the deviations given z, (G, n), (G, n, W) and (G, n, n) arrays.
    next_mean, next_covariance, next_offset, next_loading, next_spread : written, the same at the next tick.
    states, state_covariances : written, of the next tick, (G, n), and (G n / b, b, b) blocks along the diagonal.
    innovations, innovation_covariance : written, (G S) and (G S, G S) arrays.
    log_likelihoods, fused : written, (G S) arrays.
    gains : written, of z, (G S, G W), or (0, G W) where nobody asks.
    deviation_gains : written, of the deviations given z at this tick, (G, n, S).

    Returns
    -------
    How many outputs were seen and believed.
    """
    (n_groups, n_states, width), n_latent = designs.shape, len(mean)

    def of_all(blocks: FloatArray) -> FloatArray:
        return block_diagonal(blocks).reshape(*blocks.shape[:-1], n_latent)

    lower = np.tril(covariance)
    belief = Belief(mean, lower + np.tril(lower, -1).T)
    known = np.matmul(sensors, path[..., None])[..., 0]
    deviation = Deviation(offset, of_all(loading), spread)
    update = observe_deviation(
        belief, deviation, observation - known, sensors @ of_all(designs), sensors, noise, believed.astype(np.bool_)
    )
    seen, ahead = update.seen, predict_deviation(update.deviation, transition, driven)
    own, every = np.arange(n_groups), ahead.loading.reshape(n_groups, n_states, n_groups, width)
    next_mean[:], next_covariance[:] = seen.belief
    next_offset[:], next_loading[:], next_spread[:] = ahead.offset, every[own, :, own], ahead.covariance
    innovations[:], innovation_covariance[:] = seen.innovation, seen.innovation_covariance
    log_likelihoods[:], fused[:], deviation_gains[:] = seen.log_likelihoods, seen.fused, update.gains
    if len(gains):
        gains[:] = (seen.gain @ seen.whitening).T
    rows = of_all(next_designs) + ahead.loading
    states[:] = next_path + ahead.offset + rows @ next_mean
    blocks = rows.reshape(-1, state_covariances.shape[-1], n_latent)
    shown = blocks @ next_covariance @ blocks.mT
    n_blocks, b = len(blocks) // n_groups, blocks.shape[1]
    left = ahead.covariance.reshape(n_groups, n_blocks, b, n_blocks, b)[:, np.arange(n_blocks), :, np.arange(n_blocks)]
    state_covariances[:] = (shown + shown.mT) / 2 + left.swapaxes(0, 1).reshape(-1, b, b)
    return int(seen.fused.sum())
