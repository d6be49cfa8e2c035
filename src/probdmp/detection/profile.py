"""What the demonstrations of a primitive show about executions beside their path: tempo, noise, oddities of the sensor."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from probdmp.checks import FloatArray, check_array, freeze_arrays
from probdmp.demonstrations import Demonstration, noise_stds
from probdmp.errors import InputError

__all__ = ["ExecutionProfile", "repeats"]

LEAST_TEMPO_STD = 0.01
"""Least standard deviation of log durations; executions that all last equally long do not vouch for the next."""


@dataclass(frozen=True, slots=True, eq=False)
class ExecutionProfile:
    """Of one primitive."""

    tempo_std: FloatArray
    """() array: standard deviation of the logarithm of the duration."""
    noise_stds: FloatArray
    """(D,) array, data units: noise of the sensor."""
    longest_repeats: FloatArray
    """(D,) array, seconds: longest time for which the same number was measured again and again."""
    largest_jumps: FloatArray
    """(D,) array, data units: largest distance of a sample from the straight line through the two before it."""

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @classmethod
    def of(cls, demonstrations: Sequence[Demonstration]) -> Self:
        """What K demonstrations show."""
        durations = np.log([d.duration for d in demonstrations])
        tempo = max(float(np.std(durations, ddof=1)) if len(durations) > 1 else 0.1, LEAST_TEMPO_STD)
        jumps = [_largest_jumps(d.positions) for d in demonstrations]
        return cls(
            np.asarray(tempo),
            np.median([noise_stds(d.positions) for d in demonstrations], axis=0),
            np.max([repeats(d.positions).max(axis=0) * d.dt for d in demonstrations], axis=0),
            np.max(jumps, axis=0),
        )

    def state(self) -> dict[str, Any]:
        """Plain values, for a model file."""
        return {name: np.asarray(value).tolist() for name, value in asdict(self).items()}

    @classmethod
    def from_state(cls, state: Mapping[str, Any], n_dof: int) -> Self:
        """The profile again."""
        shapes = {"tempo_std": (), "noise_stds": (n_dof,), "longest_repeats": (n_dof,), "largest_jumps": (n_dof,)}
        if set(state) != set(shapes):
            raise InputError(f"a profile with {', '.join(shapes)}", f"{state!r:.200}")
        return cls(**{name: check_array(state[name], name, shape) for name, shape in shapes.items()})


def repeats(positions: FloatArray) -> FloatArray:
    """How often in a row each sample repeats the one before it exactly, (T, D) array of counts."""
    counts = np.zeros(positions.shape)
    for t in range(1, len(positions)):
        counts[t] = np.where(positions[t] == positions[t - 1], counts[t - 1] + 1, 0)
    return counts


def _largest_jumps(positions: FloatArray) -> FloatArray:
    if len(positions) < 3:
        return np.zeros(positions.shape[1])
    jumps = np.abs(np.diff(positions, 2, axis=0))
    return np.nan_to_num(np.max(np.where(np.isnan(jumps), 0.0, jumps), axis=0))
