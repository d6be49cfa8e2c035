"""What a commanded value does to a movement whose parameters vary together.

The demonstrations end somewhere, and how they get there depends on where: knowing the end tells something about the whole
movement. A commanded goal that differs from the expected end by delta can be used in two ways, and in both the end is known
from then on:

    "condition"    delta is an observation: the movement changes as the demonstrations say that it does
    "attractor"    the goal of the spring-damper system moves by delta: all of the movement is drawn to it, as in any DMP

The demonstrations know nothing of goals far from theirs, and linear extrapolation of what they say would deform the movement.
`"blend"` conditions on as much of delta as they could have shown and leaves the rest to the attractor:

    inside = delta / (1 + (|delta| / REACH)^4)^(1/4)

|delta| is the Mahalanobis length of delta per degree of freedom: at one standard deviation less than 1 % is left to the
attractor, far outside all but REACH standard deviations.
"""

import numpy as np

from probdmp.checks import FloatArray

__all__ = ["REACH", "conditioned_part"]

REACH = 3.0
"""Standard deviations of the demonstrations that are trusted."""


def conditioned_part(delta: FloatArray, covariance: FloatArray, handling: str) -> FloatArray:
    """As much of a deviation as is conditioned on.

    Parameters
    ----------
    delta : (*batch, D) array; 0 where nothing was commanded.
    covariance : (*batch, D, D) array, of what was expected.
    handling : `"blend"`, `"condition"` or `"attractor"`.
    """
    if handling == "condition":
        return delta
    if handling == "attractor":
        return np.zeros_like(delta)
    squared = np.einsum("...i,...ij,...j->...", delta, np.linalg.inv(covariance), delta)[..., None]
    count = np.maximum(np.sum(delta != 0, axis=-1, keepdims=True), 1)
    return np.asarray(delta / np.sqrt(np.sqrt(1 + (squared / count / REACH**2) ** 2)))
