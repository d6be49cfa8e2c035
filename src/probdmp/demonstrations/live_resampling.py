"""Samples with a clock of their own put onto a constant rate while they come in."""

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, check_seconds
from probdmp.demonstrations.clock import sampled_on_grid
from probdmp.demonstrations.demonstration import LONGEST_RECORDING
from probdmp.errors import InputError

__all__ = ["LiveResampling"]

ROUNDING = 1e-9
"""Fraction of a step by which a sample may come late and still be one of the grid."""


class LiveResampling:
    """What `demonstration_from_times` does, batch by batch: rows at 0, dt, 2 dt, … from the first sample on.

    Parameters
    ----------
    dt : seconds between the new rows.
    """

    def __init__(self, dt: float) -> None:
        self.dt = check_seconds(dt, "dt")
        self._n_rows = 0
        self._origin: float | None = None
        self._last: tuple[float, FloatArray] | None = None

    def add(self, times: ArrayLike, rows: ArrayLike) -> FloatArray:
        """The rows (N, C) that have become known.

        Parameters
        ----------
        times : (n,) array, seconds, strictly increasing, also from call to call.
        rows : (n, C) array; NaN where a sample is missing.

        Raises
        ------
        InputError
            If times do not increase, or there would be more rows than a recording may have.
        """
        table = check_array(rows, "rows", ("T", "C"), missing=True)
        clock = check_array(times, "times", (len(table),))
        if self._last is not None:
            clock = np.concatenate([[self._last[0]], clock])
            table = np.concatenate([self._last[1][None], table])
        if np.any(np.diff(clock) <= 0):
            hint = "Sort the samples and drop repeated ones."
            raise InputError("times that increase strictly", "some that do not", hint)
        if not len(clock):
            return table
        origin = float(clock[0]) if self._origin is None else self._origin
        n_known = int((float(clock[-1]) - origin) / self.dt + ROUNDING) + 1
        if n_known > LONGEST_RECORDING:
            raise InputError(f"at most {LONGEST_RECORDING} rows", f"{n_known}", "Choose a larger dt, or stop earlier.")
        grid = self.dt * np.arange(self._n_rows, n_known, dtype=np.float64)
        new = sampled_on_grid(clock - origin, table, grid) if len(clock) > 1 else table[: len(grid)]
        self._origin, self._last, self._n_rows = origin, (float(clock[-1]), table[-1].copy()), n_known
        return new
