"""The compiled kernels, or where there are none their NumPy twins: the only module that knows that there are two.

The extension is built when the package is installed and a compiler is found. `PROBDMP_NO_EXTENSION=1` in the environment
chooses the twins all the same.
"""

import os
from collections.abc import Callable
from itertools import pairwise
from types import ModuleType

from probdmp.checks import FloatArray
from probdmp.gaussian import _kernels_numpy

__all__ = [
    "COMPILED",
    "LANE",
    "MOST_STATES",
    "PreparedSteps",
    "augmented_step",
    "filter_systems",
    "in_threads",
    "least_squares",
    "plain_recordings",
    "points_on_lines",
    "smooth_backwards",
    "smoothed_states",
    "split_sums",
    "squared_innovations",
    "whiten",
    "window_evidence",
    "window_ratios",
    "window_sums",
]


SWITCHED_OFF = os.environ.get("PROBDMP_NO_EXTENSION", "0") not in ("", "0")
"""Whether the environment asks for the twins."""


def _chosen() -> ModuleType:
    if SWITCHED_OFF:
        return _kernels_numpy
    try:
        from probdmp.gaussian import _kernels  # type: ignore[attr-defined]
    except ImportError:  # it could not be built
        return _kernels_numpy
    return _kernels


_kernels = _chosen()
COMPILED = _kernels is not _kernels_numpy
"""Whether the compiled kernels are in use."""
LANE = 8
"""Systems that `PreparedSteps` filters at once: its rows are padded to a multiple of it."""
MOST_STATES = 4
"""States of a system that the kernels can filter."""

filter_systems: Callable[..., None] = _kernels.filter_systems
PreparedSteps: type[_kernels_numpy.PreparedSteps] = _kernels.PreparedSteps
squared_innovations: Callable[..., None] = _kernels.squared_innovations
smoothed_states: Callable[..., None] = _kernels.smoothed_states


def smooth_backwards(transition: FloatArray, *others: FloatArray) -> None:
    """As in `_kernels_numpy`: systems of more than `MOST_STATES` states are smoothed there."""
    (_kernels if transition.shape[-1] <= MOST_STATES else _kernels_numpy).smooth_backwards(transition, *others)


least_squares: Callable[..., None] = _kernels.least_squares
window_evidence: Callable[..., None] = _kernels.window_evidence
window_ratios: Callable[..., None] = _kernels.window_ratios
whiten: Callable[..., bool] = _kernels.whiten
window_sums: Callable[..., None] = _kernels.window_sums
plain_recordings: Callable[..., None] = _kernels.plain_recordings
points_on_lines: Callable[..., None] = _kernels.points_on_lines
augmented_step: Callable[..., int] = _kernels.augmented_step
split_sums = _kernels_numpy.split_sums


def in_threads(work: Callable[[slice], None], n_series: int, n_threads: int) -> None:
    """Split series among threads; the compiled kernels let them run at the same time."""
    if n_threads == 1:
        work(slice(0, n_series))
        return
    from concurrent.futures import ThreadPoolExecutor

    bounds = [n_series * i // n_threads for i in range(n_threads + 1)]
    parts = [slice(first, last) for first, last in pairwise(bounds) if last > first]
    with ThreadPoolExecutor(max(len(parts), 1)) as pool:
        list(pool.map(work, parts))
