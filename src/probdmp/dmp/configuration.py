"""What is chosen, not learned, about a movement primitive."""

from dataclasses import dataclass

from probdmp.checks import check_choice, check_count, check_positive
from probdmp.dmp.transformation_system import DISCRETIZATIONS
from probdmp.errors import InputError

__all__ = ["COUPLINGS", "FORCING_NOISES", "GOAL_HANDLINGS", "PUBLISHED", "SCALINGS", "WEIGHT_UNCERTAINTIES", "Configuration"]

SCALINGS = ("none", "paper")
FORCING_NOISES = ("posterior", "predictive")
WEIGHT_UNCERTAINTIES = ("independent", "joint")
COUPLINGS = ("auto", "full", "none")
GOAL_HANDLINGS = ("blend", "condition", "attractor")

STIFFEST = (1e-3, 1e4)
"""Least and largest alpha_z."""


@dataclass(frozen=True, slots=True)
class Configuration:
    """The choices behind a primitive that are not learned."""

    n_basis: int = 30
    """N, basis functions per degree of freedom."""
    alpha_z: float = 25.0
    """Spring constant of the transformation system, dimensionless; beta_z = alpha_z / 4 damps it critically."""
    discretization: str = "exact"
    """`"exact"` (zero-order hold) or `"semi_implicit_euler"` (the paper)."""
    scaling: str = "none"
    """`"none"`: the forcing term keeps its learned size; `"paper"`: it grows with (g - p0) / mean (g - p0)."""
    forcing_noise: str = "predictive"
    """`"posterior"`: the weights alone are uncertain; `"predictive"`: the forcing term also has white noise, 1 / beta."""
    weight_uncertainty: str = "independent"
    """`"independent"`: the forcing term is redrawn at every step (the paper);
    `"joint"`: the weights are constant and unknown."""
    goal_handling: str = "blend"
    """What a commanded goal does when the weights are `"joint"`; see `probdmp.dmp.goal_handling`."""
    coupling: str = "full"
    """Whether the degrees of freedom of an execution, and its channels, are learned to vary together: `"full"`, `"none"`, or
    `"auto"`, whichever makes demonstrations likelier given the others. Pooled weights never do."""

    @property
    def stiffness(self) -> float:
        """alpha_z beta_z, by which the distance to the goal accelerates the movement, in units of the duration."""
        return self.alpha_z**2 / 4

    def __post_init__(self) -> None:
        object.__setattr__(self, "n_basis", check_count(self.n_basis, "n_basis", most=1000))
        object.__setattr__(self, "alpha_z", check_positive(self.alpha_z, "alpha_z"))
        if not STIFFEST[0] <= self.alpha_z <= STIFFEST[1]:
            raise InputError(f"alpha_z from {STIFFEST[0]:g} to {STIFFEST[1]:g}", repr(self.alpha_z), "25 is usual.")
        check_choice(self.discretization, "discretization", DISCRETIZATIONS)
        check_choice(self.scaling, "scaling", SCALINGS)
        check_choice(self.forcing_noise, "forcing_noise", FORCING_NOISES)
        check_choice(self.weight_uncertainty, "weight_uncertainty", WEIGHT_UNCERTAINTIES)
        check_choice(self.goal_handling, "goal_handling", GOAL_HANDLINGS)
        check_choice(self.coupling, "coupling", COUPLINGS)
        if (self.scaling, self.weight_uncertainty) == ("paper", "joint"):
            raise InputError(
                'scaling="none" with weight_uncertainty="joint"',
                'scaling="paper"',
                "Scaled by an unknown goal, the movement is not linear in what is unknown. "
                'Use weight_model="pooled" and weight_uncertainty="independent", or ProbabilisticDMP.as_published().',
            )


PUBLISHED = Configuration(discretization="semi_implicit_euler", scaling="paper")
"""The paper's choices; docs/paper.md says which it leaves open."""
