"""What each sensor said, and whether it was believed."""

from dataclasses import dataclass

import numpy as np

from probdmp.checks import BoolArray, FloatArray
from probdmp.execution.gating import gate_ratios
from probdmp.execution.sensor_array import SensorArray

__all__ = ["SensorCounts", "SensorTrack", "sensor_tracks"]


@dataclass(frozen=True, slots=True, eq=False)
class SensorTrack:
    """One sensor over a recording, or at one tick, for which T = 1."""

    innovations: FloatArray
    """(T, O) array, units of the outputs: measured minus predicted; NaN where not seen."""
    innovation_covariances: FloatArray
    """(T, O, O) array."""
    test_ratios: FloatArray
    """(T,) array: squared innovation over its gate, above 1 beyond it; NaN where nothing was measured. A sensor without a gate
    is compared with `probdmp.execution.gating.REPORTED_GATE` standard deviations."""
    fused: BoolArray
    """(T,) array: whether anything of the reading was used."""
    rejected: BoolArray
    """(T,) array: whether it was measured, but rejected by the gate."""

    def __repr__(self) -> str:
        return f"<SensorTrack: {self.n_fused} readings used, {self.n_rejected} rejected, {self.n_missing} missing>"

    @property
    def n_fused(self) -> int:
        """Readings that were used."""
        return int(self.fused.sum())

    @property
    def n_rejected(self) -> int:
        """Readings that were rejected."""
        return int(self.rejected.sum())

    @property
    def n_missing(self) -> int:
        """Times without a reading."""
        return int(np.isnan(self.innovations).all(axis=-1).sum())


def sensor_tracks(
    array: SensorArray, innovations: FloatArray, covariances: FloatArray, fused: BoolArray
) -> dict[str, SensorTrack]:
    """By name of each sensor, from innovations (T, O), their covariances (T, O, O) and what was fused (T, O)."""
    tracks = {}
    for sensor in array.sensors:
        part = array.slices[sensor.name]
        own, spread, used = innovations[:, part], covariances[:, part, part], np.any(fused[:, part], axis=-1)
        measured = ~np.all(np.isnan(own), axis=-1)
        ratios = gate_ratios(own, spread, sensor.gate)
        tracks[sensor.name] = SensorTrack(own, spread, ratios, used, np.logical_and(measured, ~used))
    return tracks


@dataclass(slots=True)
class SensorCounts:
    """The readings of one sensor while executing."""

    n_fused: int = 0
    """Used."""
    n_rejected: int = 0
    """Rejected by the gate."""
    n_missing: int = 0
    """Ticks without a reading."""
    n_rejected_in_a_row: int = 0
    """Rejected since one was used: a sensor that has been wrong for long, or a filter that is."""

    def add_fused(self, count: int) -> None:
        """Count readings that were used."""
        self.n_fused += count
        self.n_rejected_in_a_row = 0

    def add(self, innovations: FloatArray, fused: BoolArray) -> None:
        """Count one tick, (O,) arrays; innovations are NaN where nothing was seen."""
        if fused.any():
            self.add_fused(1)
        elif np.isnan(innovations).all():
            self.n_missing += 1
        else:
            self.n_rejected += 1
            self.n_rejected_in_a_row += 1
