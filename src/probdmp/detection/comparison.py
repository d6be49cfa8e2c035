"""Which primitive of a library fits an execution better than the one it should be."""

from collections.abc import Mapping
from math import lgamma, log, pi

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.evidence import DEGREES_OF_FREEDOM
from probdmp.detection.path_model import PathModel, path_model
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.profile import ExecutionProfile
from probdmp.dmp import Primitive

__all__ = ["Candidate", "Comparison"]

COMPARED_EVERY = 4
"""Ticks between the points that are compared; those between say little more."""
MARGIN = 3.0
"""Nats by which another primitive has to be likelier."""
PLAUSIBLE = 2.0
"""Mean squared deviation up to which an execution may be one of another primitive."""


class Candidate:
    """A primitive that an execution may be.

    Parameters
    ----------
    model : the Gaussian over its paths, no goal told.
    ranges : (D,) array, data units.
    duration : mean duration, seconds.
    """

    def __init__(self, model: PathModel, ranges: FloatArray, duration: float) -> None:
        self._model, self._ranges, self._duration = model, ranges, duration

    def log_density(self, times: FloatArray, displacements: FloatArray) -> tuple[float, float]:
        """Of displacements (n, D) in data units at times (n,) in seconds, of a multivariate t, nats; and their mean square."""
        phases = np.clip(np.rint(TICKS * times / self._duration).astype(int), 0, TICKS)
        size = displacements.size
        residuals = (displacements / self._ranges - self._model.means[phases]).ravel()
        covariance = self._model.covariance[phases][:, :, phases].reshape(size, size)
        factor = np.linalg.cholesky(covariance + np.diag(np.tile(self._model.noise_variances, len(times))))
        square = float(np.sum(np.linalg.solve(factor, residuals) ** 2))
        nu = DEGREES_OF_FREEDOM
        scale = float(np.log(np.diag(factor)).sum() + len(times) * np.log(self._ranges).sum())
        shape = lgamma((nu + size) / 2) - lgamma(nu / 2) - size / 2 * log(nu * pi)
        return shape - scale - (nu + size) / 2 * float(np.log1p(square / nu)), square / size


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
        self._candidates: dict[str, Candidate] = {}

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
        fits = {label: self._candidate(label).log_density(times[seen], displacements[seen]) for label in rivals}
        best = max(fits, key=lambda label: fits[label][0])
        clearly = fits[best][0] > fits[self._labels[own.identity]][0] + MARGIN
        return best if clearly and fits[best][1] < PLAUSIBLE else ""

    def _candidate(self, label: str) -> Candidate:
        if label not in self._candidates:
            primitive = self._primitives[label]
            model = path_model(primitive, self._profiles[primitive.identity], knows_goal=False).of_movement()
            self._candidates[label] = Candidate(model, primitive.ranges, primitive.duration)
        return self._candidates[label]
