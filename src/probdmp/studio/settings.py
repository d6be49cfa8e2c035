"""What a page chooses about learning and monitoring."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Self

from probdmp.checks import check_choice, check_count
from probdmp.dmp.transformation_system import DISCRETIZATIONS
from probdmp.errors import InputError, InputTypeError
from probdmp.estimator import ProbabilisticDMP
from probdmp.learning.options import WEIGHT_MODELS
from probdmp.studio.fields import number_of

__all__ = ["CHOICES", "PRESSURE", "Settings"]

PRESSURE = "pressure"
"""The sensor channel of a pen that feels how hard it is pressed."""
N_BASIS = (3, 60)
ALPHA = (0.001, 0.5)
VARIANTS = ("default", "as_published")
CHOICES: dict[str, list[Any]] = {
    "weight_model": sorted(WEIGHT_MODELS),
    "discretization": sorted(DISCRETIZATIONS),
    "variant": list(VARIANTS),
    "n_basis": list(N_BASIS),
    "alpha": list(ALPHA),
}
"""What each setting may be; of numbers the least and the largest."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings of a session."""

    n_basis: int = 30
    weight_model: str = "hierarchical"
    discretization: str = "exact"
    variant: str = "default"
    """`"as_published"`: the paper's configuration, whatever the other choices but n_basis."""
    use_pressure: bool = False
    """Whether pressure is learned with the movement."""
    alpha: float = 0.01
    """Share of normal executions that may be called failed."""

    def changed(self, message: Mapping[str, Any]) -> Self:
        """With what a message says, checked."""
        wanted: dict[str, Any] = {}
        if "n_basis" in message:
            wanted["n_basis"] = check_count(message["n_basis"], "n_basis", *N_BASIS)
        for name in ("weight_model", "discretization", "variant"):
            if name in message:
                wanted[name] = check_choice(message[name], name, CHOICES[name])
        if "use_pressure" in message:
            if not isinstance(message["use_pressure"], bool):
                raise InputTypeError("use_pressure as true or false", f"{message['use_pressure']!r:.100}")
            wanted["use_pressure"] = message["use_pressure"]
        if "alpha" in message:
            wanted["alpha"] = number_of(message, "alpha", *ALPHA)
        if not wanted:
            raise InputError(f"one of {', '.join(asdict(self))}", f"{sorted(message)!r:.200}")
        settings = replace(self, **wanted)
        if settings.use_pressure and (settings.variant == "as_published" or settings.weight_model != "hierarchical"):
            hint = "Pooled weights do not know how demonstrations vary, so there is nothing for the pressure to vary with."
            raise InputError("hierarchical weights of the default variant to learn the pressure", "others", hint)
        return settings

    @property
    def parameters(self) -> dict[str, Any]:
        """Of ProbabilisticDMP, other than by default."""
        if self.variant == "as_published":
            return ProbabilisticDMP.as_published(self.n_basis).get_params()
        given = {"n_basis": self.n_basis, "weight_model": self.weight_model, "discretization": self.discretization}
        return given | ({"channels": (PRESSURE,)} if self.use_pressure else {})

    def learns_like(self, other: Self) -> bool:
        """Whether the same is learned; alpha is about monitoring alone."""
        return replace(self, alpha=other.alpha) == other

    def as_dict(self) -> dict[str, Any]:
        """By name."""
        return asdict(self)
