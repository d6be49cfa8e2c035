"""The hot path: one small binary message per display tick.

Little-endian: uint8 kind, uint8 flags (bit 0 failed, bit 1 stale), uint16 n, uint32 sequence, float32 time, phase,
log-likelihood, test ratio (NaN: not judged); then float32 (n) measured, desired, upper edge of the band around what is desired,
contributions. n counts the degrees of freedom and the learned channels.
"""

import struct

import numpy as np

from probdmp.checks import FloatArray
from probdmp.execution import ExecutionStep
from probdmp.plotting.trajectories import band_edges

__all__ = ["HEADER", "PLAYING", "TRACING", "frame_of"]

PLAYING, TRACING = 1, 2
HEADER = struct.Struct("<BBHIffff")
LARGEST = 3e38
"""That a float32 can hold."""


def frame_of(kind: int, sequence: int, step: ExecutionStep, measured: FloatArray) -> bytes:
    """One tick as a frame.

    Parameters
    ----------
    kind : `PLAYING` or `TRACING`.
    measured : (S,) array, units of each signal; NaN where nothing was measured.
    """
    verdict, wanted = step.verdict, step.signals
    flags = 0 if verdict is None else int(verdict.failed) | int(getattr(verdict, "is_stale", False)) << 1
    told = np.clip([step.time, step.phase, step.log_likelihood, step.test_ratio], -LARGEST, LARGEST)
    head = HEADER.pack(kind, flags, len(measured), sequence & 0xFFFFFFFF, *told.tolist())
    _, upper = band_edges(wanted.means, wanted.stds)
    rows = np.stack([measured, wanted.means, upper, step.contributions])
    return head + np.clip(rows, -LARGEST, LARGEST).astype("<f4").tobytes()
