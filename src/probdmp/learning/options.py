"""How to learn, and how well it went."""

from collections.abc import Sequence
from dataclasses import dataclass

from probdmp.checks import FloatArray, check_choice, check_fraction, check_names, freeze_arrays
from probdmp.errors import InputError
from probdmp.learning.observation_noise import ObservationNoise

__all__ = ["FitReport", "LearningOptions"]

WEIGHT_MODELS = ("pooled", "hierarchical")


@dataclass(frozen=True, slots=True)
class LearningOptions:
    """How to learn, beside what to learn (`probdmp.dmp.Configuration`)."""

    weight_model: str = "pooled"
    """`"pooled"`: one set of weights behind all demonstrations, found by Bayesian regression (the paper);
    `"hierarchical"`: every demonstration has its own, drawn from a Gaussian that is learned."""
    smoothing: float = 0.05
    """Window of the Savitzky-Golay filter as a fraction of a demonstration; see `probdmp.demonstrations.smoothing`."""
    channels: Sequence[str] = ()
    """Names of sensor channels of the demonstrations to learn with the movement; this needs joint, hierarchical weights."""

    def __post_init__(self) -> None:
        check_choice(self.weight_model, "weight_model", WEIGHT_MODELS)
        object.__setattr__(self, "smoothing", check_fraction(self.smoothing, "smoothing", most=0.5))
        object.__setattr__(self, "channels", tuple(check_names(self.channels, "channels")))
        if self.channels and self.weight_model != "hierarchical":
            hint = "Pooled weights do not know how demonstrations vary, so there is nothing for channels to vary with."
            raise InputError('weight_model="hierarchical" with channels', repr(self.weight_model), hint)


@dataclass(frozen=True, slots=True, eq=False)
class FitReport:
    """How well the primitive says what it was shown."""

    reproduction_errors: FloatArray
    """(K, D) array: root mean square of demonstration minus rollout of the same task, as a fraction of the range."""
    observation_noise: ObservationNoise | None
    """The EM iterations behind R; None with joint weights, whose R comes from `probdmp.learning.residual_noise`."""

    def __post_init__(self) -> None:
        freeze_arrays(self)
