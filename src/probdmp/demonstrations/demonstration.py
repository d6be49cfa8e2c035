"""A recorded movement as checked data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, check_seconds, frozen, shape_text
from probdmp.errors import InputError, InputTypeError

__all__ = [
    "LONGEST_RECORDING",
    "SHORTEST_RECORDING",
    "Demonstration",
    "Recording",
    "Recordings",
    "as_demonstrations",
    "signals_of",
    "stack_signals",
]

SHORTEST_RECORDING = 3
"""Samples; acceleration needs three."""
LONGEST_RECORDING = 100_000
"""Samples, 100 s at 1 kHz; more is refused rather than computed for minutes."""


@dataclass(frozen=True, slots=True, eq=False)
class Demonstration:
    """One recording of a movement, sampled at a constant rate.

    Raises
    ------
    InputError, InputTypeError
        If positions are not a finite (T, D) array of real numbers (NaN marks a missing sample), T is out of bounds, dt is
        not positive, or names and channels do not fit.
    """

    positions: FloatArray
    """(T, D) array, data units; NaN where a sample is missing."""
    dt: float
    """Seconds between samples."""
    label: str = ""
    """What movement this is, such as a letter."""
    names: tuple[str, ...] = ()
    """(D) names of the degrees of freedom (DoF); dof0, dof1, … unless given."""
    units: str = ""
    """Unit of the positions, such as "m"; free text."""
    channels: Mapping[str, FloatArray] = field(default_factory=dict)
    """Further sensor channels by name, (T,) arrays: kept with the demonstration, not degrees of freedom."""

    def __post_init__(self) -> None:
        hint = "Time goes first: one row per sample, one column per degree of freedom."
        positions = check_array(self.positions, "positions", ("T", "D"), missing=True, hint=hint)
        n_samples, n_dof = positions.shape
        if not SHORTEST_RECORDING <= n_samples <= LONGEST_RECORDING:
            raise InputError(
                f"positions with {SHORTEST_RECORDING} to {LONGEST_RECORDING} samples", shape_text(positions.shape), hint
            )
        if n_dof < 1:
            raise InputError("positions with at least one degree of freedom", shape_text(positions.shape), hint)
        if not all(isinstance(given, kind) for given, kind in ((self.names, tuple | list), (self.channels, Mapping))):
            raise InputTypeError("names in a tuple and channels by name", f"{self.names!r:.100} and {self.channels!r:.100}")
        if not all(isinstance(text, str) for text in (self.label, self.units, *self.names, *self.channels)):
            raise InputTypeError(
                "label, units and names as text",
                f"{(self.label, self.units, *self.names, *self.channels)!r:.200}",
            )
        names = tuple(self.names) or _default_names(n_dof)
        if len(names) != n_dof or len(set(names)) != n_dof:
            raise InputError(f"{n_dof} different names, one per column", repr(names))
        if not set(names).isdisjoint(self.channels):
            raise InputError("channels named otherwise than the degrees of freedom", repr(sorted(self.channels)))
        channels = {
            name: frozen(check_array(values, f"channel {name!r}", (n_samples,), missing=True))
            for name, values in self.channels.items()
        }
        object.__setattr__(self, "positions", frozen(positions))
        object.__setattr__(self, "dt", check_seconds(self.dt, "dt"))
        object.__setattr__(self, "names", names)
        object.__setattr__(self, "channels", MappingProxyType(channels))

    def __reduce__(self) -> tuple[Any, ...]:
        channels = dict(self.channels)  # the read-only view of them cannot be copied or sent elsewhere
        return type(self), (self.positions, self.dt, self.label, self.names, self.units, channels)

    def __repr__(self) -> str:
        label = f" {self.label!r}" if self.label else ""
        return f"<Demonstration{label}: {self.n_samples} samples × {self.n_dof} DoF, {self.duration:g} s>"

    @property
    def has_names(self) -> bool:
        """Whether the degrees of freedom were given names; bare arrays fit any."""
        return self.names != _default_names(self.n_dof)

    @property
    def fingerprint(self) -> str:
        """SHA-256 of positions and dt, by which a recording is known again."""
        import hashlib  # loads OpenSSL

        return hashlib.sha256(np.float64(self.dt).tobytes() + self.positions.tobytes()).hexdigest()

    @property
    def n_samples(self) -> int:
        """T."""
        return len(self.positions)

    @property
    def n_dof(self) -> int:
        """D."""
        return int(self.positions.shape[1])

    @property
    def times(self) -> FloatArray:
        """(T,) array, seconds from the first sample."""
        return np.arange(self.n_samples, dtype=np.float64) * self.dt

    @property
    def duration(self) -> float:
        """Seconds from the first sample to the last, (T - 1) dt."""
        return (self.n_samples - 1) * self.dt


Recording = Demonstration | ArrayLike
"""What a recorded movement may be given as: a demonstration, or a bare (T, D) array."""
Recordings = Demonstration | Sequence[Recording] | FloatArray
"""Several of them: in a sequence, or as one (K, T, D) array."""


def _default_names(n_dof: int) -> tuple[str, ...]:
    return tuple(f"dof{i}" for i in range(n_dof))


def as_demonstrations(data: Recordings, dt: float | None = None) -> list[Demonstration]:
    """Demonstrations from whatever a user has: demonstrations, (T, D) arrays with `dt`, or one (K, T, D) array.

    Parameters
    ----------
    data : one demonstration, a sequence of demonstrations or of (T_k, D) arrays, or a (K, T, D) array.
    dt : seconds between samples, needed for bare arrays; demonstrations carry their own.

    Raises
    ------
    InputError
        If there are none, a bare array comes without `dt`, or they disagree in number or names of DoFs.
    """
    if isinstance(data, Demonstration):
        data = [data]
    if isinstance(data, np.ndarray) and data.ndim != 3:
        raise InputError(
            "demonstrations as a list of (T, D) arrays or one (K, T, D) array",
            f"an array of shape {shape_text(data.shape)}",
            "One recording alone? Put it into a list.",
        )
    if isinstance(data, str | bytes | Mapping) or not isinstance(data, Sequence | np.ndarray):
        raise InputTypeError(
            "demonstrations as a list of Demonstration or arrays",
            f"{type(data).__name__}",
            "A file name? Read it with probdmp.read_demonstrations(path).",
        )
    if len(data) == 0:
        raise InputError("at least one demonstration", "none")
    demonstrations = [_as_demonstration(item, k, dt) for k, item in enumerate(data)]
    first = demonstrations[0]
    for k, other in enumerate(demonstrations):
        if (other.names, other.units) != (first.names, first.units):
            raise InputError(
                f"all demonstrations with the same degrees of freedom {first.names} in the same units {first.units!r}",
                f"{other.names} in {other.units!r} in demonstration {k}",
            )
    return demonstrations


def _as_demonstration(item: Recording, k: int, dt: float | None) -> Demonstration:
    if isinstance(item, Demonstration):
        return item
    if dt is None:
        raise InputError("dt in seconds with bare arrays", "none", "Say how far apart the samples are: dt=0.01 for 100 Hz.")
    return Demonstration(check_array(item, f"demonstration {k}", ("T", "D"), missing=True), dt)


def signals_of(demonstration: Demonstration, channels: Sequence[str] = ()) -> FloatArray:
    """Positions, then channels by name, (T, S) array; NaN where a sample is missing.

    Raises
    ------
    InputError
        If it has no such channel, or one of which nothing was measured.
    """
    missing = [name for name in channels if name not in demonstration.channels]
    if missing:
        present = ", ".join(map(repr, demonstration.channels)) or "none"
        raise InputError(f"demonstrations with the channels {', '.join(map(repr, channels))}", f"one with {present}")
    columns = [demonstration.channels[name] for name in channels]
    for name, column in zip(channels, columns, strict=True):
        if np.isnan(column).all():
            raise InputError(f"channel {name!r} measured in every demonstration", "one without a single sample of it")
    return np.column_stack([demonstration.positions, *columns])


def stack_signals(demonstrations: Sequence[Demonstration], channels: Sequence[str] = ()) -> FloatArray:
    """Recordings side by side, (T, K, S) array; the shorter ones end in NaN, as if nothing more was measured."""
    tables = [signals_of(demonstration, channels) for demonstration in demonstrations]
    stacked = np.full((max(map(len, tables)), len(tables), tables[0].shape[1]), np.nan)
    for k, table in enumerate(tables):
        stacked[: len(table), k] = table
    return stacked
