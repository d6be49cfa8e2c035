"""What the demonstrations of a primitive show about executions beside their path: tempo, noise, oddities of the sensor."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, Self

import numpy as np

from probdmp.checks import FloatArray, check_array, freeze_arrays
from probdmp.demonstrations import Demonstration, noise_stds
from probdmp.errors import InputError

__all__ = ["ExecutionProfile", "repeats"]

NEVER = 1e9
"""Seconds; longer than any movement."""
LEAST_TEMPO_STD = 0.01
"""Least standard deviation of log durations; executions that all last equally long do not vouch for the next."""


@dataclass(frozen=True, slots=True, eq=False)
class ExecutionProfile:
    """Of one primitive."""

    tempo_std: FloatArray
    """() array: standard deviation of the logarithm of the duration."""
    noise_stds: FloatArray
    """(S,) array, units of each signal: noise of the sensor."""
    longest_repeats: FloatArray
    """(S,) array, seconds: longest time for which the same number was measured again and again."""
    largest_jumps: FloatArray
    """(S,) array, units of each signal: largest distance of a sample from the straight line through the two before it."""
    usual_gaps: FloatArray
    """(S,) array, seconds: median time from one sample to the next; infinite for what was never measured."""

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @classmethod
    def of(cls, demonstrations: Sequence[Demonstration], measured: Sequence[FloatArray] | None = None) -> Self:
        """What K demonstrations show.

        Parameters
        ----------
        measured : all signals of each, (T, S) arrays; its positions unless given.
        """
        signals = [d.positions for d in demonstrations] if measured is None else measured
        durations = np.log([d.duration for d in demonstrations])
        tempo = max(float(np.std(durations, ddof=1)) if len(durations) > 1 else 0.1, LEAST_TEMPO_STD)
        pairs = list(zip(demonstrations, signals, strict=True))
        return cls(
            np.asarray(tempo),
            np.nan_to_num(np.median([noise_stds(values) for values in signals], axis=0)),
            np.max([repeats(values).max(axis=0) * d.dt for d, values in pairs], axis=0),
            np.max([_largest_jumps(values) for values in signals], axis=0),
            np.max([_usual_gaps(values) * d.dt for d, values in pairs], axis=0),
        )

    def state(self) -> dict[str, Any]:
        """Plain values, for a model file."""
        plain = {name: np.asarray(value).tolist() for name, value in asdict(self).items()}
        return plain | {"usual_gaps": [gap if np.isfinite(gap) else None for gap in plain["usual_gaps"]]}

    @classmethod
    def from_state(cls, state: Mapping[str, Any], n_signals: int) -> Self:
        """The profile again."""
        names = [field.name for field in fields(cls)]
        if set(state) != set(names) or not isinstance(state["usual_gaps"], list):
            raise InputError(f"a profile with {', '.join(names)}", f"{state!r:.200}")
        finite = {**state, "usual_gaps": [NEVER if gap is None else gap for gap in state["usual_gaps"]]}
        checked = {name: check_array(finite[name], name, () if name == "tempo_std" else (n_signals,)) for name in names}
        gaps = checked["usual_gaps"]
        return cls(**{**checked, "usual_gaps": np.where(gaps >= NEVER, np.inf, gaps)})


def repeats(positions: FloatArray) -> FloatArray:
    """How often in a row each sample repeats the one before it exactly, (T, S) array of counts."""
    counts = np.zeros(positions.shape)
    for t in range(1, len(positions)):
        counts[t] = np.where(positions[t] == positions[t - 1], counts[t - 1] + 1, 0)
    return counts


def _usual_gaps(values: FloatArray) -> FloatArray:
    """Samples from one that was measured to the next, (S,) array; infinite where hardly any was."""
    places = [np.flatnonzero(~np.isnan(column)) for column in values.T]
    return np.array([float(np.median(np.diff(seen))) if len(seen) > 1 else np.inf for seen in places])


def _largest_jumps(positions: FloatArray) -> FloatArray:
    if len(positions) < 3:
        return np.zeros(positions.shape[1])
    jumps = np.abs(np.diff(positions, 2, axis=0))
    return np.nan_to_num(np.max(np.where(np.isnan(jumps), 0.0, jumps), axis=0))
