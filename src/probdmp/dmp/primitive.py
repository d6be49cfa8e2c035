"""The learned movement primitive: the paper's theta = {mu_w, Sigma_w, alpha, beta, R} and what it needs to run."""

from dataclasses import dataclass, fields, replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, check_count, check_positive, check_seconds, frozen, shape_text
from probdmp.dmp.channels import ChannelVariation, Signals
from probdmp.dmp.configuration import Configuration
from probdmp.dmp.task import Task
from probdmp.dmp.variation import Variation, check_semidefinite
from probdmp.errors import InputError, InputTypeError

__all__ = ["Primitive", "task_for"]

SCALING_GUARD = 0.2
"""A degree of freedom whose mean displacement is less than this fraction of its range is not scaled."""


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
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
    """beta, (D,) array, 1 / data units squared: precision of the forcing term around what the weights say."""
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
    variation: Variation | None = None
    """How the demonstrations differ from each other; None with pooled weights, which say nothing of it."""
    channels: ChannelVariation | None = None
    """Sensor channels that vary with the movement; None if none were learned."""

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
            check_semidefinite(getattr(self, name), name)
        for name in ("duration", "dt", "phase_step"):
            check = check_positive if name == "phase_step" else check_seconds
            object.__setattr__(self, name, check(getattr(self, name), name))
        object.__setattr__(self, "n_demonstrations", check_count(self.n_demonstrations, "n_demonstrations"))
        if not all(isinstance(text, str) for text in (*self.names, self.units)):
            raise InputTypeError("names and units as text", f"{self.names!r}, {self.units!r}")
        if d < 1 or len(set(self.names)) < d:
            raise InputError("at least one name, all different", repr(self.names))
        object.__setattr__(self, "names", tuple(self.names))
        if self.variation is not None and self.variation.means.shape != (d, n + 2):
            raise InputError(f"variation of shape {shape_text((d, n + 2))}", shape_text(self.variation.means.shape))
        self._check_channels()

    def _check_channels(self) -> None:
        channels, n = self.channels, self.configuration.n_basis
        if channels is None:
            return
        if self.variation is None or self.configuration.weight_uncertainty != "joint":
            raise InputError(
                'weight_model="hierarchical" and weight_uncertainty="joint" with channels',
                "other weights",
                "A forcing term that is redrawn at every step says nothing about the channels.",
            )
        if not set(channels.names).isdisjoint(self.names):
            raise InputError("channels named otherwise than the degrees of freedom", repr(channels.names))
        shape = (len(channels.names) * (n + 3), self.variation.means.size)
        if channels.cross_covariance.shape != shape:
            raise InputError(
                f"channels with a cross covariance of shape {shape_text(shape)}", shape_text(channels.cross_covariance.shape)
            )
        cross = channels.cross_covariance
        check_semidefinite(np.block([[self.variation.covariance, cross.T], [cross, channels.covariance]]), "channels")

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
    def channel_names(self) -> tuple[str, ...]:
        """(F) names of the channels; empty if none were learned."""
        return () if self.channels is None else self.channels.names

    @property
    def signals(self) -> Signals:
        """Degrees of freedom and channels together."""
        residuals = None if self.variation is None else self.variation.residual_variances
        own = Signals(self.names, self.ranges, self.observation_variances, self.forcing_precisions, residuals)
        if self.channels is None:
            return own
        names = (*self.names, *self.channels.names)
        both = [np.concatenate([getattr(own, name), getattr(self.channels, name)]) for name in Signals._fields[1:]]
        return Signals(names, *both)

    def with_signal_noise(self, observation_variances: FloatArray, forcing_precisions: FloatArray) -> "Primitive":
        """The primitive with another R and beta, (S,) arrays."""
        d, channels = self.n_dof, self.channels
        if channels is not None:
            channels = replace(
                channels, observation_variances=observation_variances[d:], forcing_precisions=forcing_precisions[d:]
            )
        return replace(
            self,
            observation_variances=observation_variances[:d],
            forcing_precisions=forcing_precisions[:d],
            channels=channels,
        )

    @property
    def identity(self) -> str:
        """SHA-256 of everything that determines what the primitive does; a detector knows its primitive by it."""
        if self not in _IDENTITIES:
            _IDENTITIES[self] = _identity_of(self)
        return _IDENTITIES[self]

    def starts(self, task: Task) -> FloatArray:
        """p0, (*batch, D) array: where a task starts, as far as it is known; the mean start elsewhere."""
        return np.where(np.isnan(task.start), self.start, task.start)

    def goals(self, task: Task) -> FloatArray:
        """g, (*batch, D) array: where a task ends, as far as it is told; the mean goal elsewhere."""
        return np.where(np.isnan(task.goal), self.goal, task.goal)

    def amplitudes(self, task: Task) -> FloatArray:
        """s, (*batch, D) array: by how much a task scales the forcing term."""
        scaled = np.array(self.scaled)
        reference = np.where(scaled, self.goal_displacements, 1.0)
        return np.where(scaled, (self.goals(task) - self.starts(task)) / reference, 1.0)


_IDENTITIES: WeakKeyDictionary[Primitive, str] = WeakKeyDictionary()
"""Of primitives that are in use: detectors ask for it with every execution."""


def _identity_of(primitive: Primitive) -> str:
    import hashlib  # loads OpenSSL

    digest = hashlib.sha256()
    for field in fields(primitive):
        value = getattr(primitive, field.name)
        parts = value.arrays().values() if isinstance(value, Variation | ChannelVariation) else (value,)
        for part in (*parts, *(value.names if isinstance(value, ChannelVariation) else ())):
            digest.update(part.tobytes() if isinstance(part, np.ndarray) else repr(part).encode())
    return digest.hexdigest()


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
    start : (D,) array, data units. Where it is NaN it is uncertain, as those of the demonstrations were.
    goal : (D,) array, data units. Not given it is NaN in the task, not told: see `Primitive.goals`; with joint weights it has
        its learned spread.
    duration : seconds.
    start_velocity : (D,) array, data units per second; uncertain likewise where it is NaN, or not given.
    """
    shape, hint = (primitive.n_dof,), f"One number for each of {', '.join(primitive.names)}."
    return Task(
        check_array(primitive.start if start is None else start, "start", shape, missing=True, hint=hint),
        np.full(shape, np.nan) if goal is None else check_array(goal, "goal", shape, hint=hint),
        np.asarray(primitive.duration if duration is None else check_seconds(duration, "duration")),
        None if start_velocity is None else check_array(start_velocity, "start_velocity", shape, missing=True, hint=hint),
    )
