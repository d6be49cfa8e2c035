"""One set of weights behind all demonstrations: the paper's model of a movement."""

from collections.abc import Sequence

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive, Task
from probdmp.dmp.responses import held_features
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
    features = [held_features(configuration, 1 / len(f), len(f)) for f in targets]
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
