"""From recordings with their own clock to the constant rate that everything else assumes."""

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import check_array, check_positive, shape_text
from probdmp.demonstrations.demonstration import LONGEST_RECORDING, MILLISECONDS_HINT, Demonstration
from probdmp.errors import InputError

__all__ = ["demonstration_from_times"]


def demonstration_from_times(
    times: ArrayLike,
    positions: ArrayLike,
    dt: float | None = None,
    label: str = "",
    names: tuple[str, ...] = (),
    units: str = "",
) -> Demonstration:
    """A demonstration from time-stamped samples, resampled along straight lines.

    Parameters
    ----------
    times : (T,) array, seconds, strictly increasing.
    positions : (T, D) array, data units.
    dt : seconds between the new samples; the median spacing of `times` unless given.

    Raises
    ------
    InputError
        If times do not increase, or the recording would have too many samples.
    """
    positions = check_array(positions, "positions", ("T", "D"), hint="One row per time.")
    times = check_array(times, "times", (len(positions),), hint="One time per row of positions.")
    if len(times) < 2 or positions.shape[1] < 1:
        raise InputError("at least two samples of at least one degree of freedom", shape_text(positions.shape))
    steps = np.diff(times)
    if np.any(steps <= 0):
        first = int(np.argmax(steps <= 0))
        raise InputError(
            "times that increase strictly",
            f"{times[first]!r} s followed by {times[first + 1]!r} s at sample {first + 1}",
            "Sort the samples and drop repeated ones.",
        )
    step = float(np.median(steps)) if dt is None else check_positive(dt, "dt", "seconds", MILLISECONDS_HINT)
    n_samples = (times[-1] - times[0]) / step + 1
    if n_samples > LONGEST_RECORDING:
        raise InputError(f"at most {LONGEST_RECORDING} samples", f"{n_samples:.3g}", "Choose a larger dt, or cut.")
    # A last time within rounding of a whole step is a whole step.
    grid = times[0] + step * np.arange(int(n_samples * (1 + 1e-9)))
    resampled = np.column_stack([np.interp(grid, times, column) for column in positions.T])
    return Demonstration(resampled, step, label, names, units)
