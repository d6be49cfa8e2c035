"""Which primitive of a library fits an execution better than the one it should be."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.path_model import path_model
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.point_densities import densities_of_points
from probdmp.detection.profile import ExecutionProfile
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
    """(R, M, D, M, D) array."""
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
        return cls(
            np.stack([model.means for model in models]),
            np.stack([model.covariance for model in models]),
            np.stack([model.noise_variances for model in models]),
            np.stack([p.ranges for p in primitives]),
            np.array([p.duration for p in primitives]),
        )

    def log_densities(self, times: FloatArray, displacements: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Of n executions at P points, but for a constant; and mean squares. (R, n) arrays.

        Parameters
        ----------
        times, displacements : (n, P) and (n, P, D) arrays, seconds and data units.
        """
        paths = np.arange(len(self.durations))[:, None, None]
        phases = np.clip(np.rint(TICKS * times / self.durations[paths]).astype(np.int64), 0, TICKS)
        residuals = displacements / self.ranges[:, None, None] - self.means[paths, phases]
        aside = np.zeros(phases.shape)
        densities, squares = densities_of_points(self.covariances, self.noise_variances, phases, aside, residuals)
        return densities - times.shape[1] * np.log(self.ranges).sum(axis=1)[:, None], squares.mean(axis=(2, 3))


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

    def better(self, own: Primitive, times: Sequence[FloatArray], displacements: Sequence[FloatArray]) -> list[str]:
        """Of n executions the label of the likeliest primitive if it is clearly likelier than the own one, else nothing.

        Parameters
        ----------
        times : n (T,) arrays, seconds.
        displacements : n (T, D) arrays, data units; rows with NaN are left out.
        """
        found = [""] * len(times)
        rivals = [label for label, p in self._primitives.items() if p.names == own.names]
        if len(rivals) < 2:
            return found
        if own.names not in self._candidates:
            self._candidates[own.names] = Candidates.of([self._primitives[label] for label in rivals], self._profiles)
        seen = [np.flatnonzero(~np.isnan(moved).any(axis=1))[::-COMPARED_EVERY][::-1] for moved in displacements]
        for n_points in {len(rows) for rows in seen} - {0, 1}:
            some = [k for k, rows in enumerate(seen) if len(rows) == n_points]
            densities, mean_squares = self._candidates[own.names].log_densities(
                np.stack([times[k][seen[k]] for k in some]), np.stack([displacements[k][seen[k]] for k in some])
            )
            best, alike = np.argmax(densities, axis=0), np.arange(len(some))
            clearly = densities[best, alike] > densities[rivals.index(self._label(own))] + MARGIN
            for i in np.flatnonzero(clearly & (mean_squares[best, alike] < PLAUSIBLE)).tolist():
                found[some[i]] = rivals[best[i]]
        return found

    def _label(self, own: Primitive) -> str:
        found = [label for label, primitive in self._primitives.items() if primitive is own]
        return found[0] if found else self._labels[own.identity]  # which takes its time
