"""One set of weights behind all demonstrations: the paper's model of a movement."""

from collections.abc import Sequence

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Configuration, Primitive, Task
from probdmp.dmp.basis import basis_features
from probdmp.dmp.phase import phases_at
from probdmp.dmp.transformation_system import DISCRETIZATIONS
from probdmp.learning.weight_regression import WeightPosterior, regress_weights

__all__ = ["pooled_weights"]

RESOLUTION = 1e-9
"""What counts as no movement, as a fraction of the range."""


def pooled_weights(primitive: Primitive, tasks: Task, targets: Sequence[FloatArray]) -> list[WeightPosterior]:
    """One regression per degree of freedom over all demonstrations at once, the regressors scaled by the amplitude s.

    Parameters
    ----------
    primitive : the primitive to be, for its configuration, ranges and amplitude scaling.
    tasks : what the K demonstrations carried out.
    targets : K arrays (T_k - 1, D) of s f, data units.
    """
    configuration = primitive.configuration
    features = [_held_features(configuration, len(f)) for f in targets]
    amplitudes = primitive.amplitudes(tasks)
    resolutions = RESOLUTION * configuration.stiffness * primitive.ranges
    return [
        regress_weights(
            np.concatenate([s * phi for s, phi in zip(amplitudes[:, d], features, strict=True)]),
            np.concatenate([f[:, d] for f in targets]),
            float(resolutions[d]),
        )
        for d in range(primitive.n_dof)
    ]


def _held_features(configuration: Configuration, n_transitions: int) -> FloatArray:
    """What the basis functions hold over each step of a whole movement, (n_transitions, N) array."""
    scheme = DISCRETIZATIONS[configuration.discretization]
    starts = np.arange(n_transitions, dtype=np.float64)

    def held(starts: FloatArray, stencil: tuple[tuple[float, float], ...]) -> FloatArray:
        values = [w * basis_features(phases_at(starts + at, n_transitions), configuration.n_basis) for at, w in stencil]
        return np.sum(values, axis=0)

    return np.concatenate([held(starts[:1], scheme.first_stencil), held(starts[1:], scheme.forcing_stencil)])
