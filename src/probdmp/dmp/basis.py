"""The basis functions of the forcing term.

    psi_i(x) = exp(-h_i (x - c_i)^2),    phi_i(x) = psi_i(x) x / sum_j psi_j(x)

Centres lie at evenly spaced times; h_i = 1 / (c_{i+1} - c_i)^2, so that neighbours cross at exp(-1/4), about three
quarters of their height. Source: Meier & Schaal 2016, equation 1 and below.
"""

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp.phase import phases_at

__all__ = ["basis_centers", "basis_features", "basis_widths"]


def basis_centers(n_basis: int) -> FloatArray:
    """c, (N,) array of phases from 1 down to 0.01, evenly spaced in time."""
    return phases_at(np.linspace(0.0, 1.0, n_basis), 1.0)


def basis_widths(centers: FloatArray) -> FloatArray:
    """h, (N,) array; the last width is repeated. A single basis function is constant, whatever its width."""
    if len(centers) == 1:
        return np.ones(1)
    widths = 1 / np.diff(centers) ** 2
    return np.append(widths, widths[-1])


def basis_features(phases: FloatArray, n_basis: int) -> FloatArray:
    """phi, the regressors of the forcing term.

    Parameters
    ----------
    phases : x, array of any shape.
    n_basis : N, how many basis functions.

    Returns
    -------
    (*phases.shape, N) array; each row sums to x.
    """
    centers = basis_centers(n_basis)
    exponents = -basis_widths(centers) * (phases[..., None] - centers) ** 2
    # Far beyond the end every psi underflows; their ratio does not, once the largest is factored out.
    psi = np.exp(exponents - exponents.max(axis=-1, keepdims=True))
    return psi * (phases / psi.sum(axis=-1))[..., None]
