"""The models and recordings that everyone gets, all from built-in movements."""

from dataclasses import fields
from functools import cache

import numpy as np

from probdmp import Demonstration, ProbabilisticDMP, Task, synthetic_arm_movements, synthetic_letters
from probdmp.checks import FloatArray
from probdmp.demonstrations import ARM_MOVEMENTS
from probdmp.dmp import linear_gaussian_model
from probdmp.gaussian import LinearGaussianModel, sample_sequences

__all__ = [
    "N_STEPS",
    "SIMPLE",
    "UNCERTAINTIES",
    "first_systems",
    "learned",
    "model_of",
    "recordings_of",
    "task_of",
]

N_STEPS = 200
"""T, samples of an execution."""
N_DEMONSTRATIONS = 10
UNCERTAINTIES = {"independent": "as in the paper", "joint": "the default"}
"""Of the weights."""
SIMPLE = {"weight_uncertainty": "independent"}
"""Parameters that make a system of three states for each degree of freedom, which other packages can be told."""


def _resampled(demonstration: Demonstration) -> FloatArray:
    """(N_STEPS, D) array: the path at evenly spaced phases."""
    phases, wanted = np.linspace(0, 1, demonstration.n_samples), np.linspace(0, 1, N_STEPS)
    return np.column_stack([np.interp(wanted, phases, column) for column in demonstration.positions.T])


def letter() -> list[Demonstration]:
    """Demonstrations of "a": 2 degrees of freedom, millimetres."""
    written = synthetic_letters(N_DEMONSTRATIONS, letters="a")
    return [Demonstration(_resampled(one), one.duration / (N_STEPS - 1)) for one in written]


def arm() -> list[Demonstration]:
    """Demonstrations of "pour": 7 joints, radians."""
    moved = synthetic_arm_movements(N_DEMONSTRATIONS, movements=("pour",))
    return [Demonstration(_resampled(m.demonstration), m.demonstration.duration / (N_STEPS - 1)) for m in moved]


def body() -> list[Demonstration]:
    """All built-in arm movements at once, as if by one robot: 30 degrees of freedom, in 3 s."""
    moved = [synthetic_arm_movements(N_DEMONSTRATIONS, movements=(name,)) for name in ARM_MOVEMENTS]
    together = [np.column_stack([_resampled(m.demonstration) for m in parts]) for parts in zip(*moved, strict=True)]
    return [Demonstration(positions, 3.0 / (N_STEPS - 1)) for positions in together]


@cache
def learned(movement: str, uncertainty: str = "independent") -> tuple[ProbabilisticDMP, list[Demonstration]]:
    """A primitive and what taught it.

    Parameters
    ----------
    movement : "letter", "arm" or "body".
    uncertainty : of the weights; independent ones belong to the paper's model, joint ones to the default.
    """
    demonstrations = {"letter": letter, "arm": arm, "body": body}[movement]()
    parameters = SIMPLE if uncertainty == "independent" else {}
    return ProbabilisticDMP(**parameters).fit(demonstrations), demonstrations  # type: ignore[arg-type]


def task_of(dmp: ProbabilisticDMP) -> Task:
    """To do it as learned, from a known start."""
    primitive = dmp.primitive_
    return Task(primitive.start, primitive.goal, np.asarray(primitive.duration))


@cache
def model_of(movement: str, n_steps: int = N_STEPS, n_dof: int | None = None) -> LinearGaussianModel:
    """The system that executes a movement in n_steps samples; its first degrees of freedom, or all of them."""
    dmp, _ = learned(movement)
    task = task_of(dmp)
    model = linear_gaussian_model(dmp.primitive_, task, float(task.duration) / (n_steps - 1), n_steps)
    return first_systems(model, dmp.primitive_.n_dof if n_dof is None else n_dof)


def first_systems(model: LinearGaussianModel, n_dof: int) -> LinearGaussianModel:
    """The first of the systems of a model with the batch axis (D)."""
    (n_all,) = model.batch_shape

    def first(name: str, array: FloatArray) -> FloatArray:
        axis = 1 if name in ("inputs", "input_covariances") else 0
        core = 1 if name in ("inputs", "initial_mean") else 2
        full = array if array.ndim == axis + 1 + core else np.expand_dims(array, axis)
        shape = (*full.shape[:axis], n_all, *full.shape[axis + 1 :])
        return np.ascontiguousarray(np.broadcast_to(full, shape).take(range(n_dof), axis=axis))

    return LinearGaussianModel(**{field.name: first(field.name, getattr(model, field.name)) for field in fields(model)})


def recordings_of(model: LinearGaussianModel, n_recordings: int, n_different: int = 1_000) -> FloatArray:
    """Simulated executions, (N, T, D) array; beyond `n_different` they are repeated, which costs everyone the same."""
    rng = np.random.default_rng(0)
    drawn = sample_sequences(model, min(n_recordings, n_different), rng)[1][..., 0]
    return np.ascontiguousarray(np.resize(drawn, (n_recordings, *drawn.shape[1:])))
