"""What a filter finds at one tick of an execution: what the sensors said, and the state to be reached at the next tick."""

from typing import NamedTuple, Protocol

import numpy as np

from probdmp.checks import BoolArray, FloatArray

__all__ = ["RECORD_SIZE", "RecordedTick", "SensedTick", "Tick"]

RECORD_SIZE = 15
"""Mean (3) and covariance (9) of the next state of a signal, innovation, its variance, and log-likelihood."""


class SensedTick(Protocol):
    """One tick; S signals, O outputs of the sensors."""

    @property
    def n_fused(self) -> int:
        """Outputs that were measured and believed."""
        ...

    @property
    def mean(self) -> FloatArray:
        """(S, 3) array: the state at the next tick, in data units and seconds."""
        ...

    @property
    def covariance(self) -> FloatArray:
        """(S, 3, 3) array."""
        ...

    @property
    def log_likelihood(self) -> float:
        """Nats: of this tick; 0 where nothing was measured."""
        ...

    @property
    def contributions(self) -> FloatArray:
        """(O,) array, nats: the share of each output in it."""
        ...

    @property
    def innovations(self) -> FloatArray:
        """(O,) array, units of the outputs; NaN where not seen."""
        ...

    @property
    def innovation_covariance(self) -> FloatArray:
        """(O, O) array, whether seen or not."""
        ...

    @property
    def innovation_variances(self) -> FloatArray:
        """(O,) array, its diagonal."""
        ...

    @property
    def fused(self) -> BoolArray:
        """(O,) array: what was seen and believed."""
        ...


class Tick(NamedTuple):
    """A tick with its arrays; see `SensedTick` for each."""

    n_fused: int
    mean: FloatArray
    covariance: FloatArray
    contributions: FloatArray
    innovations: FloatArray
    innovation_covariance: FloatArray
    fused: BoolArray

    @property
    def log_likelihood(self) -> float:
        """Nats."""
        return float(self.contributions.sum())

    @property
    def innovation_variances(self) -> FloatArray:
        """(O,) array."""
        return np.diagonal(self.innovation_covariance)


class RecordedTick(NamedTuple):
    """A tick as the kernel writes it, one output for each signal; arrays are made of it when they are asked for."""

    n_fused: int
    n_outputs: int
    """S."""
    log_likelihood: float
    record: bytes
    """A float64 array (RECORD_SIZE, W), of which the first S columns count."""

    @property
    def mean(self) -> FloatArray:
        """(S, 3) array."""
        return self._rows()[:3].T

    @property
    def covariance(self) -> FloatArray:
        """(S, 3, 3) array."""
        return self._rows()[3:12].reshape(3, 3, -1).transpose(2, 0, 1)

    @property
    def contributions(self) -> FloatArray:
        """(S,) array."""
        return self._rows()[14]

    @property
    def innovations(self) -> FloatArray:
        """(S,) array."""
        return self._rows()[12]

    @property
    def innovation_covariance(self) -> FloatArray:
        """(S, S) array."""
        return np.diag(self.innovation_variances)

    @property
    def innovation_variances(self) -> FloatArray:
        """(S,) array."""
        return self._rows()[13]

    @property
    def fused(self) -> BoolArray:
        """(S,) array."""
        return ~np.isnan(self.innovations)

    def _rows(self) -> FloatArray:
        return np.frombuffer(self.record).reshape(RECORD_SIZE, -1)[:, : self.n_outputs]
