"""Which primitive of a library fits an execution better than the one it should be."""

from collections.abc import Mapping, Sequence
from math import lgamma, log, pi
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.evidence import DEGREES_OF_FREEDOM
from probdmp.detection.path_model import path_model
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.profile import ExecutionProfile
from probdmp.detection.windows import whitened
from probdmp.dmp import Primitive

__all__ = ["Candidates", "Comparison"]

COMPARED_EVERY = 4
"""Ticks between the points that are compared; those between say little more."""
MARGIN = 3.0
"""Nats by which another primitive has to be likelier."""
PLAUSIBLE = 2.0
"""Mean squared deviation up to which an execution may be one of another primitive."""


class Candidates(NamedTuple):
    """R primitives that an execution may be one of, no goal told."""

    means: FloatArray
    """(R, M, D) array, fractions of the range."""
    covariances: FloatArray
    """(R, M D, M D) array."""
    noise_variances: FloatArray
    """(R, D) array."""
    ranges: FloatArray
    """(R, D) array, data units."""
    durations: FloatArray
    """(R,) array: mean durations, seconds."""

    @classmethod
    def of(cls, primitives: Sequence[Primitive], profiles: Mapping[str, ExecutionProfile]) -> "Candidates":
        """Of primitives with profiles by their identity."""
        models = [path_model(p, profiles[p.identity], knows_goal=False).of_movement() for p in primitives]
        size = models[0].means.size
        return cls(
            np.stack([model.means for model in models]),
            np.stack([model.covariance.reshape(size, size) for model in models]),
            np.stack([model.noise_variances for model in models]),
            np.stack([p.ranges for p in primitives]),
            np.array([p.duration for p in primitives]),
        )

    def log_densities(self, times: FloatArray, displacements: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Of displacements (n, D) in data units at times (n,), seconds, of a multivariate t; and mean squares. (R,) arrays."""
        (n, d), r = displacements.shape, np.arange(len(self.durations))[:, None]
        phases = np.clip(np.rint(TICKS * times / self.durations[:, None]).astype(int), 0, TICKS)
        residuals = (displacements / self.ranges[:, None] - self.means[r, phases]).reshape(len(r), n * d)
        rows = (phases[..., None] * d + np.arange(d)).reshape(len(r), n * d)
        places = (r[..., None] * self.covariances.shape[1] + rows[:, :, None]) * self.covariances.shape[1] + rows[:, None, :]
        covariances = self.covariances.ravel().take(places)
        covariances[:, np.arange(n * d), np.arange(n * d)] += np.tile(self.noise_variances, n)
        white, logarithms = whitened(covariances, residuals)
        squares, nu, size = (white**2).sum(axis=1), DEGREES_OF_FREEDOM, n * d
        scales = logarithms.sum(axis=1) + n * np.log(self.ranges).sum(axis=1)
        shape = lgamma((nu + size) / 2) - lgamma(nu / 2) - size / 2 * log(nu * pi)
        return shape - scales - (nu + size) / 2 * np.log1p(squares / nu), squares / size


class Comparison:
    """The primitives of a library as candidates for what an execution may be.

    Parameters
    ----------
    primitives : by label.
    profiles : by identity of the primitive.
    """

    def __init__(self, primitives: Mapping[str, Primitive], profiles: Mapping[str, ExecutionProfile]) -> None:
        self._labels = {primitive.identity: label for label, primitive in primitives.items()}
        self._primitives, self._profiles = primitives, profiles
        self._candidates: dict[tuple[str, ...], Candidates] = {}

    def better(self, own: Primitive, times: FloatArray, displacements: FloatArray) -> str:
        """Label of the likeliest primitive if it is clearly likelier than the own one, else nothing.

        Parameters
        ----------
        times : (T,) array, seconds.
        displacements : (T, D) array, data units; rows with NaN are left out.
        """
        seen = np.flatnonzero(~np.isnan(displacements).any(axis=1))[::-COMPARED_EVERY][::-1]
        rivals = [label for label, p in self._primitives.items() if p.names == own.names]
        if len(seen) < 2 or len(rivals) < 2:
            return ""
        if own.names not in self._candidates:
            self._candidates[own.names] = Candidates.of([self._primitives[label] for label in rivals], self._profiles)
        densities, mean_squares = self._candidates[own.names].log_densities(times[seen], displacements[seen])
        best = int(np.argmax(densities))
        clearly = densities[best] > densities[rivals.index(self._label(own))] + MARGIN
        return rivals[best] if clearly and mean_squares[best] < PLAUSIBLE else ""

    def _label(self, own: Primitive) -> str:
        found = [label for label, primitive in self._primitives.items() if primitive is own]
        return found[0] if found else self._labels[own.identity]  # which takes its time
