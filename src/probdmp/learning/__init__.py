"""From demonstrations to a primitive: forcing targets, Bayesian regression, observation noise by EM."""

from typing import TYPE_CHECKING

from probdmp.loading import loaded_when_used

if TYPE_CHECKING:
    from probdmp.learning.fit import fit_primitive
    from probdmp.learning.imported_weights import ForcingWeights, primitive_from_weights
    from probdmp.learning.observation_noise import ObservationNoise, estimate_observation_noise
    from probdmp.learning.options import FitReport, LearningOptions
    from probdmp.learning.varied_weights import left_out_primitives

__all__ = [
    "FitReport",
    "ForcingWeights",
    "LearningOptions",
    "ObservationNoise",
    "estimate_observation_noise",
    "fit_primitive",
    "left_out_primitives",
    "primitive_from_weights",
]

__getattr__, __dir__ = loaded_when_used(
    __name__,
    {
        "fit": ("fit_primitive",),
        "imported_weights": ("ForcingWeights", "primitive_from_weights"),
        "observation_noise": ("ObservationNoise", "estimate_observation_noise"),
        "options": ("FitReport", "LearningOptions"),
        "varied_weights": ("left_out_primitives",),
    },
)
