"""The learned movement primitive: the paper's theta = {mu_w, Sigma_w, alpha, beta, R} and what it needs to run."""

import hashlib
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, check_choice, check_count, check_positive, check_seconds, frozen
from probdmp.dmp.task import Task
from probdmp.dmp.transformation_system import DISCRETIZATIONS
from probdmp.errors import InputError, InputTypeError

__all__ = ["FORCING_NOISES", "PUBLISHED", "SCALINGS", "Configuration", "Primitive", "task_for"]

SCALINGS = ("none", "paper")
FORCING_NOISES = ("posterior", "predictive")

STIFFEST = (1e-3, 1e4)
"""Least and largest alpha_z."""

SCALING_GUARD = 0.2
"""A degree of freedom whose mean displacement is less than this fraction of its range is not scaled."""


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
    """`"posterior"`: the variance of the mean forcing term; `"predictive"`: with the regression noise 1 / beta."""

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


PUBLISHED = Configuration(discretization="semi_implicit_euler", scaling="paper")
"""The paper's choices; docs/paper.md says which it leaves open."""


@dataclass(frozen=True, slots=True, eq=False)
class Primitive:
    """A learned movement. D degrees of freedom, N basis functions; all arrays are read-only.

    Raises
    ------
    InputError, InputTypeError
        If shapes disagree, a number is not finite, or a variance is negative.
    """

    configuration: Configuration
    weight_means: FloatArray
    """mu_w, (D, N) array, data units."""
    weight_covariances: FloatArray
    """Sigma_w, (D, N, N) array, data units squared, positive semi-definite."""
    weight_precisions: FloatArray
    """alpha, (D,) array: prior precision of the weights, 1 / data units squared."""
    forcing_precisions: FloatArray
    """beta, (D,) array: precision of the forcing targets around their mean, 1 / data units squared."""
    observation_variances: FloatArray
    """R, (D,) array: variance of the position sensors, data units squared, > 0."""
    goal_displacements: FloatArray
    """Delta g, (D,) array: mean of g - p0 over the demonstrations, data units."""
    ranges: FloatArray
    """(D,) array: mean extent of the demonstrations, data units, > 0. Standardised positions are divided by it."""
    start: FloatArray
    """(D,) array: mean start of the demonstrations, data units."""
    goal: FloatArray
    """(D,) array: mean goal of the demonstrations, data units."""
    start_velocities: FloatArray
    """v0, (D,) array in phase units: T_d p'(0), data units, so that a slower execution starts slower."""
    start_covariances: FloatArray
    """Q_0, (D, 2, 2) array over (T_d p'(0), p(0)) between demonstrations, data units squared; what a task gives is known."""
    duration: float
    """Mean duration of the demonstrations, seconds."""
    dt: float
    """Mean time between the samples of the demonstrations, seconds."""
    phase_step: float
    """Mean dt / duration of the demonstrations: the step to which the variance of the forcing term belongs."""
    n_demonstrations: int
    """K."""
    names: tuple[str, ...]
    """(D) names of the degrees of freedom."""
    units: str = ""
    """Unit of the positions, free text."""

    def __post_init__(self) -> None:
        d, n = len(self.names), self.configuration.n_basis
        shapes: dict[str, tuple[int, ...]] = {"weight_means": (d, n), "weight_covariances": (d, n, n)}
        for field in fields(self):
            if field.type is FloatArray:
                shape = (d, 2, 2) if field.name == "start_covariances" else shapes.get(field.name, (d,))
                object.__setattr__(self, field.name, frozen(check_array(getattr(self, field.name), field.name, shape)))
        for name in ("weight_precisions", "forcing_precisions", "observation_variances", "ranges"):
            if np.any(getattr(self, name) <= 0):
                raise InputError(f"{name} > 0", f"{getattr(self, name).min():g}")
        for name in ("weight_covariances", "start_covariances"):
            _check_semidefinite(getattr(self, name), name)
        for name in ("duration", "dt", "phase_step"):
            check = check_positive if name == "phase_step" else check_seconds
            object.__setattr__(self, name, check(getattr(self, name), name))
        object.__setattr__(self, "n_demonstrations", check_count(self.n_demonstrations, "n_demonstrations"))
        if not all(isinstance(text, str) for text in (*self.names, self.units)):
            raise InputTypeError("names and units as text", f"{self.names!r}, {self.units!r}")
        if d < 1 or len(set(self.names)) < d:
            raise InputError("at least one name, all different", repr(self.names))
        object.__setattr__(self, "names", tuple(self.names))

    @property
    def n_dof(self) -> int:
        """D."""
        return len(self.names)

    @property
    def scaled(self) -> tuple[bool, ...]:
        """(D) whether the forcing term of a degree of freedom grows with the distance to the goal.

        False for all with `scaling="none"`; with `"paper"`, False where the demonstrations hardly move from start to goal.
        """
        large = np.abs(self.goal_displacements) >= SCALING_GUARD * self.ranges
        return tuple(bool(x) for x in large & (self.configuration.scaling == "paper"))

    @property
    def identity(self) -> str:
        """SHA-256 of everything that determines what the primitive does; a detector knows its primitive by it."""
        digest = hashlib.sha256()
        for field in fields(self):
            value = getattr(self, field.name)
            digest.update(value.tobytes() if isinstance(value, np.ndarray) else repr(value).encode())
        return digest.hexdigest()

    def starts(self, task: Task) -> FloatArray:
        """p0, (*batch, D) array: where a task starts, as far as it is known; the mean start elsewhere."""
        return np.where(np.isnan(task.start), self.start, task.start)

    def amplitudes(self, task: Task) -> FloatArray:
        """s, (*batch, D) array: by how much a task scales the forcing term."""
        scaled = np.array(self.scaled)
        reference = np.where(scaled, self.goal_displacements, 1.0)
        return np.where(scaled, (task.goal - self.starts(task)) / reference, 1.0)


def task_for(
    primitive: Primitive,
    start: ArrayLike | None = None,
    goal: ArrayLike | None = None,
    duration: float | None = None,
    start_velocity: ArrayLike | None = None,
) -> Task:
    """A single task for a primitive; what is not given is as learned.

    Parameters
    ----------
    start, goal : (D,) arrays, data units. Where the start is NaN it is uncertain, as those of the demonstrations were.
    duration : seconds.
    start_velocity : (D,) array, data units per second; uncertain likewise where it is NaN, or not given.
    """
    shape, hint = (primitive.n_dof,), f"One number for each of {', '.join(primitive.names)}."
    return Task(
        check_array(primitive.start if start is None else start, "start", shape, missing=True, hint=hint),
        check_array(primitive.goal if goal is None else goal, "goal", shape, hint=hint),
        np.asarray(primitive.duration if duration is None else check_seconds(duration, "duration")),
        None if start_velocity is None else check_array(start_velocity, "start_velocity", shape, missing=True, hint=hint),
    )


def _check_semidefinite(covariances: FloatArray, name: str) -> None:
    slack = 1e-9 * np.max(np.abs(covariances), axis=(-2, -1), initial=0.0)
    asymmetry = np.max(np.abs(covariances - covariances.mT), axis=(-2, -1), initial=0.0)
    if np.any(asymmetry > slack) or np.any(np.linalg.eigvalsh(covariances)[:, 0] < -slack):
        raise InputError(f"{name} symmetric and positive semi-definite", "one that is not", "Was it edited by hand?")
