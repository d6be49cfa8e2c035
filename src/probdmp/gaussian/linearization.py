"""A nonlinear function of a Gaussian as a linear one with noise: what extended and unscented filters do.

    h(s) ~ value + matrix (s - m) + e,   e ~ N(0, residual),   s ~ N(m, V)

`linearize_extended` takes the tangent at the mean. `linearize_unscented` fits the line to h at points that have the mean and
covariance of s, and calls what they leave over noise; a Kalman update with this line is the unscented update. Both are exact
for linear h.

Sources: Jazwinski, Stochastic Processes and Filtering Theory (1970), section 8.3; Julier & Uhlmann, Unscented filtering and
nonlinear estimation, Proc. IEEE 92 (2004); Garcia-Fernandez et al., Posterior linearization filter, IEEE Trans. Signal
Processing 63 (2015), for the line.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray

__all__ = ["Linearization", "linearize_extended", "linearize_unscented", "wrapped"]

DIFFERENCE = float(np.finfo(np.float64).eps ** (1 / 3))
"""Step of central differences, relative to the scale of the argument: there rounding and curvature cost equally much."""
RESOLUTION = 1e-13
"""Directions with less of the largest variance than this are taken as known."""


class Linearization(NamedTuple):
    """A line through h, and how far h strays from it."""

    value: FloatArray
    """Of h on average, (O,)."""
    matrix: FloatArray
    """(O, n)."""
    residual: FloatArray
    """(O, O), positive semi-definite."""


def wrapped(differences: FloatArray, period: float | None) -> FloatArray:
    """Differences of quantities that come round again after a period, such as angles, in its half around zero."""
    return differences if period is None else differences - period * np.round(differences / period)


def linearize_extended(
    function: Callable[[FloatArray], FloatArray],
    jacobian: Callable[[FloatArray], FloatArray] | None,
    mean: FloatArray,
    scales: FloatArray,
    period: float | None = None,
) -> Linearization:
    """The tangent at the mean.

    Parameters
    ----------
    function : h, (n,) to (O,).
    jacobian : (n,) to (O, n); by central differences unless given.
    mean : m, (n,).
    scales : (n,), > 0: how large each argument usually is, for the step of differences.
    period : after which h comes round again.
    """
    value = function(mean)
    if jacobian is not None:
        matrix = jacobian(mean)
    else:
        steps = DIFFERENCE * np.maximum(np.abs(mean), scales)
        shifted = [(mean + step, mean - step) for step in np.diag(steps)]
        # What was added is not quite what was meant; it is divided by what it was.
        columns = [
            wrapped(function(ahead) - function(behind), period) / (ahead - behind)[j]
            for j, (ahead, behind) in enumerate(shifted)
        ]
        matrix = np.stack(columns, axis=-1)
    return Linearization(value, matrix, np.zeros((len(value), len(value))))


def linearize_unscented(
    function: Callable[[FloatArray], FloatArray], mean: FloatArray, covariance: FloatArray, period: float | None = None
) -> Linearization:
    """The line that fits best where the state is believed to be.

    Parameters
    ----------
    covariance : V, (n, n), perhaps of deficient rank.
    """
    stds = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    units = np.where(stds > 0, stds, 1.0)
    eigenvalues, vectors = np.linalg.eigh(covariance / units / units[:, None])
    kept = eigenvalues > RESOLUTION * max(float(eigenvalues[-1]), np.finfo(np.float64).tiny)
    roots, axes, rank = np.sqrt(eigenvalues[kept]), vectors[:, kept], int(kept.sum())
    centre = function(mean)
    if rank == 0:
        return Linearization(centre, np.zeros((len(centre), len(mean))), np.zeros((len(centre), len(centre))))
    # Three standard variances away as for a Gaussian of one dimension, further where more of them need non-negative weights.
    spread = np.sqrt(max(3.0, float(rank)))
    offsets = spread * (units[:, None] * axes * roots).T
    above, below = (
        np.stack([wrapped(function(mean + sign * offset) - centre, period) for offset in offsets]) for sign in (1, -1)
    )
    weight = 1 / (2 * spread**2)
    shift = weight * (above + below).sum(axis=0)
    slopes = (above - below) / (2 * spread)  # E[xi (h - value)^T], s = m + L xi
    deviations = np.concatenate([above, below]) - shift
    total = weight * deviations.T @ deviations + (1 - 2 * rank * weight) * np.outer(shift, shift)
    residual = total - slopes.T @ slopes
    eigen, basis = np.linalg.eigh((residual + residual.T) / 2)
    inverse = (axes / roots).T / units  # of L, where V has anything
    return Linearization(centre + shift, slopes.T @ inverse, basis * np.maximum(eigen, 0.0) @ basis.T)
