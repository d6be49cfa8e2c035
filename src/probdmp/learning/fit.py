"""Learning a primitive, the steps in order."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from probdmp.checks import LARGEST_MAGNITUDE, FloatArray, check_choice, check_fraction
from probdmp.demonstrations import Demonstration, noise_stds, smooth_path, stack_positions
from probdmp.dmp import Configuration, Primitive, Task, demonstrated_tasks, linear_gaussian_model
from probdmp.dmp.basis import basis_features
from probdmp.dmp.phase import phases_at
from probdmp.dmp.transformation_system import DISCRETIZATIONS
from probdmp.errors import InputError
from probdmp.gaussian import filter_sequence
from probdmp.learning.forcing_targets import forcing_targets, scheme_velocities
from probdmp.learning.observation_noise import ObservationNoise, estimate_observation_noise
from probdmp.learning.weight_regression import WeightPosterior, regress_weights

__all__ = ["FitReport", "LearningOptions", "fit_primitive"]

WEIGHT_MODELS = ("pooled",)
OBSERVATION_NOISE_FLOOR = 1e-12
"""Least R, as a fraction of the squared range."""


@dataclass(frozen=True, slots=True)
class LearningOptions:
    """How to learn, beside what to learn (`Configuration`)."""

    weight_model: str = "pooled"
    """`"pooled"`: one set of weights behind all demonstrations, found by Bayesian regression (the paper)."""
    smoothing: float = 0.05
    """Window of the Savitzky-Golay filter as a fraction of a demonstration; see `probdmp.demonstrations.smoothing`."""

    def __post_init__(self) -> None:
        check_choice(self.weight_model, "weight_model", WEIGHT_MODELS)
        object.__setattr__(self, "smoothing", check_fraction(self.smoothing, "smoothing", most=0.5))


@dataclass(frozen=True, slots=True, eq=False)
class FitReport:
    """How well the primitive says what it was shown."""

    reproduction_errors: FloatArray
    """(K, D) array: root mean square of demonstration minus rollout of the same task, as a fraction of the range."""
    observation_noise: ObservationNoise
    """The EM iterations behind R."""


def fit_primitive(
    demonstrations: Sequence[Demonstration], configuration: Configuration, options: LearningOptions
) -> tuple[Primitive, FitReport]:
    """Learn a primitive from K demonstrations, each with its own start, goal, duration and length."""
    tasks, ranges = demonstrated_tasks(demonstrations), mean_ranges(demonstrations)
    dts = np.array([d.dt for d in demonstrations])
    paths = [smooth_path(d, options.smoothing) for d in demonstrations]
    velocities = [
        scheme_velocities(path, d.dt, configuration.discretization) for path, d in zip(paths, demonstrations, strict=True)
    ]
    targets = [
        forcing_targets(path.positions, v, goal, dt, configuration)
        for path, v, goal, dt in zip(paths, velocities, tasks.goal, dts, strict=True)
    ]
    start_velocities = np.stack([v[0] for v in velocities]) * tasks.duration[:, None]
    n_dof, n_basis = demonstrations[0].n_dof, configuration.n_basis
    blank = Primitive(
        configuration=configuration,
        weight_means=np.zeros((n_dof, n_basis)),
        weight_covariances=np.zeros((n_dof, n_basis, n_basis)),
        weight_precisions=np.ones(n_dof),
        forcing_precisions=np.ones(n_dof),
        observation_variances=ranges**2,
        goal_displacements=np.mean(tasks.goal - tasks.start, axis=0),
        ranges=ranges,
        start=np.mean(tasks.start, axis=0),
        goal=np.mean(tasks.goal, axis=0),
        start_velocities=np.mean(start_velocities, axis=0),
        start_covariances=_start_covariances(start_velocities),
        duration=float(np.mean(tasks.duration)),
        dt=float(np.mean(dts)),
        phase_step=float(np.mean(dts / tasks.duration)),
        n_demonstrations=len(demonstrations),
        names=demonstrations[0].names,
        units=demonstrations[0].units,
    )
    posteriors = pooled_weights(blank, tasks, targets)
    shaped = replace(
        blank,
        weight_means=np.stack([p.mean for p in posteriors]),
        weight_covariances=np.stack([p.covariance for p in posteriors]),
        weight_precisions=np.array([p.alpha for p in posteriors]),
        forcing_precisions=np.array([p.beta for p in posteriors]),
    )
    observed = stack_positions(demonstrations)
    model = linear_gaussian_model(shaped, tasks, dts, len(observed))
    rollouts = filter_sequence(model).filtered.means[..., 2]
    squared_errors = np.nanmean((observed - rollouts) ** 2, axis=0)
    floor = OBSERVATION_NOISE_FLOOR * ranges**2
    sensor = np.mean([noise_stds(d.positions) ** 2 for d in demonstrations], axis=0)
    noise = estimate_observation_noise(model, observed, (sensor, squared_errors.mean(axis=0)), floor)
    return replace(shaped, observation_variances=noise.variances), FitReport(np.sqrt(squared_errors) / ranges, noise)


def pooled_weights(primitive: Primitive, tasks: Task, targets: Sequence[FloatArray]) -> list[WeightPosterior]:
    """One regression per degree of freedom over all demonstrations at once, the regressors scaled by the amplitude s.

    Parameters
    ----------
    primitive : the primitive to be, for its configuration and its amplitude scaling.
    tasks : what the K demonstrations carried out.
    targets : K arrays (T_k - 1, D) of s f, data units.
    """
    configuration = primitive.configuration
    offset = DISCRETIZATIONS[configuration.discretization].forcing_offset
    phases = [phases_at((np.arange(len(f)) + offset) / len(f), 1.0) for f in targets]
    features = [basis_features(x, configuration.n_basis) for x in phases]
    amplitudes = primitive.amplitudes(tasks)
    return [
        regress_weights(
            np.concatenate([s * phi for s, phi in zip(amplitudes[:, d], features, strict=True)]),
            np.concatenate([f[:, d] for f in targets]),
        )
        for d in range(primitive.n_dof)
    ]


def mean_ranges(demonstrations: Sequence[Demonstration]) -> FloatArray:
    """Mean extent of each degree of freedom over the demonstrations, (D,) array, data units, > 0.

    A degree of freedom that never moves takes the largest range of the others; if none moves, its distance from zero, or 1.
    """
    extents = np.mean([np.nanmax(d.positions, axis=0) - np.nanmin(d.positions, axis=0) for d in demonstrations], axis=0)
    magnitude = float(np.nanmax([np.nanmax(np.abs(d.positions)) for d in demonstrations]))
    largest = float(extents.max())
    still = extents <= 1e-12 * magnitude
    ranges = np.where(still, (magnitude or 1.0) if still.all() else largest, extents)
    if ranges.min() < 1 / LARGEST_MAGNITUDE:
        raise InputError(
            f"movement over at least {1 / LARGEST_MAGNITUDE:g} units", f"a range of {ranges.min():g}", "Rescale the data."
        )
    return np.asarray(ranges)


def _start_covariances(velocities: FloatArray) -> FloatArray:
    """Q_0 from the start velocities of the demonstrations, (K, D) array in phase units; the start position is given."""
    n_demonstrations, n_dof = velocities.shape
    covariances = np.zeros((n_dof, 2, 2))
    if n_demonstrations > 1:
        covariances[:, 0, 0] = np.var(velocities, axis=0, ddof=1)
    return covariances
