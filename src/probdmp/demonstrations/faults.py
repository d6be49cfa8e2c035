"""What can go wrong with an execution, as seeded pure functions.

A fault takes an execution, the sample at which it begins and a random generator, and returns the positions that would have
been recorded. A faulty movement is still measured by the same sensor: its noise is drawn anew at the recording's own
level, so that nothing can be detected merely because samples repeat exactly or because noise sets in.
"""

from collections.abc import Callable

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations.smoothing import noise_stds

__all__ = ["FAULTS", "Fault", "hold"]

Fault = Callable[[FloatArray, int, np.random.Generator], FloatArray]
"""(positions (T, D), onset sample, generator) to positions (T, D)."""


def hold(positions: FloatArray, onset: int, rng: np.random.Generator) -> FloatArray:
    """Blocked from `onset` until the end: the paper's fault.

    Parameters
    ----------
    positions : (T, D) array, data units.
    onset : first sample at which the movement no longer advances, 1 to T - 1.

    Returns
    -------
    (T, D) array: as recorded before the onset, the last position measured, with sensor noise, from then on.
    """
    held = np.array(positions)
    noise = rng.standard_normal(held[onset:].shape) * noise_stds(positions)
    for d, column in enumerate(positions[:onset].T):
        seen = column[~np.isnan(column)]
        held[onset:, d] = (seen[-1] if len(seen) else np.nan) + noise[:, d]
    return held


FAULTS: dict[str, Fault] = {"hold": hold}
"""By name, as given to `--fault`."""
