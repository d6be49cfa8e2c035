"""A B A B: what is compared takes turns, so that whatever else the machine does meets all of it alike."""

import gc
import time
from collections.abc import Callable, Mapping

import numpy as np

from probdmp.checks import FloatArray
from speed.machine import in_step

__all__ = ["Clocked", "Times", "clocked", "interleaved"]

Clocked = Callable[[int], float]
"""Does something as often as told and says how many seconds it took."""
LEAST_SECONDS = 0.004
"""A turn lasts at least as long, so that the clock's own cost and a single interruption count for little."""
MOST_REPEATS = 100_000


class Times(dict[str, FloatArray]):
    """Seconds of one execution, by name of what was executed, a number for each round."""

    def typical(self, name: str) -> float:
        """Median over the rounds, seconds."""
        return float(np.median(self[name]))

    def ratio(self, slow: str, fast: str) -> float:
        """How many times as long one takes as the other: the median over the rounds, each of which has both."""
        return float(np.median(self[slow] / self[fast]))


def clocked(work: Callable[[], object]) -> Clocked:
    """A call in this process."""
    return lambda count: in_step(work, count)


def interleaved(contestants: Mapping[str, Clocked], rounds: int) -> Times:
    """Measure all in each of several rounds, after one execution of each that does not count.

    Collecting garbage is left to the pauses between turns.
    """
    counts = {name: _enough(run) for name, run in contestants.items()}
    times: dict[str, list[float]] = {name: [] for name in contestants}
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        for _ in range(rounds):
            for name, run in contestants.items():
                times[name].append(run(counts[name]) / counts[name])
            gc.collect()
    finally:
        if was_enabled:
            gc.enable()
    return Times({name: np.array(found) for name, found in times.items()})


def _enough(run: Clocked) -> int:
    """How many executions last long enough; the first, which may compile or load something, is not asked."""
    run(1)
    count = 1
    while count < MOST_REPEATS:
        began = time.perf_counter()
        took = max(run(count), 1e-9)
        if took >= LEAST_SECONDS or time.perf_counter() - began > 1.0:
            break
        count = min(MOST_REPEATS, max(2 * count, int(1.2 * count * LEAST_SECONDS / took)))
    return count
