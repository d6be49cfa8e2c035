"""A control loop at 1 kHz that calls `step()`: how long a tick takes, and how often it is not done when the next is due.

    python benchmarks/realtime.py --seconds 10

What a loop with deadlines should do is done here, in `measured` and `tended`: stay on one core, load everything, collect
garbage once, exempt what is left from later collections (`gc.freeze`), switch the collector off (`gc.disable`), and call `step`
a few times that do not count. Nothing that a tick leaves behind needs the collector: it goes when its last user lets go. The
same loops are run without that, with the collector as Python has it.
"""

import argparse
import gc
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np

from probdmp import FailureDetector
from probdmp.checks import FloatArray
from speed.machine import cores
from speed.rows import duration_text
from speed.workload import learned, model_of, recordings_of, task_of

__all__ = ["COLUMNS", "Loop", "LoopTimes", "loops", "measured", "paced", "row_of", "tended"]

PERIOD = 1e-3
"""Seconds."""
NEARLY = 3e-4
"""Seconds before a tick is due from when on the loop looks at the clock instead of sleeping."""
FAR_BEHIND = 0.5
"""Share of a loop's length by which it may be late before it is ended."""
WARM = 200
"""Ticks that do not count."""
DETECTORS = {"letter": "trajectory", "arm": "trajectory", "body": "nis"}
"""The statistic of the detector: the default, but for 30 degrees of freedom, where calibrating that takes minutes."""
COLUMNS = ("robot", "weights", "detector", "collector", "median", "p99", "p99.9", "worst", "overruns")


class Loop(NamedTuple):
    """What is executed, and how."""

    movement: str
    """"arm", 7 degrees of freedom, or "body", 30."""
    uncertainty: str
    """"independent" or "joint" weights."""
    detector: str
    """Statistic of the detector; "": there is none."""
    is_tended: bool


class LoopTimes(NamedTuple):
    """Of each tick."""

    seconds: FloatArray
    """From the call of `step` to its return, (n,) array; a loop that falls far behind is ended early."""
    overruns: int
    """Ticks that were not done when the next was due."""


@contextmanager
def tended(is_tended: bool = True) -> Iterator[None]:
    """The collector out of the way."""
    if not is_tended:
        yield
        return
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.unfreeze()


def paced(step: Callable[[FloatArray], object], observations: FloatArray, period: float = PERIOD) -> LoopTimes:
    """Call `step` with each of the observations (n, D), one every `period` seconds."""
    seconds, overruns, now = np.empty(len(observations)), 0, time.perf_counter
    start = now() + period
    patience = FAR_BEHIND * len(observations) * period
    for k, observation in enumerate(observations):
        due = start + k * period
        if due - now() > NEARLY:
            time.sleep(max(due - now() - NEARLY, 0.0))
        while now() < due:
            pass
        began = now()
        step(observation)
        ended = now()
        seconds[k] = ended - began
        overruns += ended > due + period
        if ended > due + patience:
            break
    return LoopTimes(seconds[: k + 1], overruns)


@cache
def detector_of(movement: str, uncertainty: str, statistic: str) -> FailureDetector | None:
    """Calibrated on two simulated executions: the threshold has no part in how long a tick takes."""
    if not statistic:
        return None
    dmp, demonstrations = learned(movement, uncertainty)
    detector = FailureDetector(statistic=statistic, calibration="held_out")
    return detector.fit(dmp, dmp.sample(2, random_state=0), dt=demonstrations[0].dt)


def measured(loop: Loop, loop_seconds: float) -> LoopTimes:
    """Run one of them, on one core."""
    dmp, _ = learned(loop.movement, loop.uncertainty)
    task, n_steps = task_of(dmp), round(loop_seconds / PERIOD) + WARM
    observations = recordings_of(model_of(loop.movement, n_steps), 1)[0]
    detector = detector_of(loop.movement, loop.uncertainty, loop.detector)
    duration = (n_steps - 1) * PERIOD
    execution = dmp.execute(task.start, task.goal, duration, PERIOD, detector)
    with cores(1), tended(loop.is_tended):
        for observation in observations[:WARM]:
            execution.step(observation)
        return paced(execution.step, observations[WARM:])


def loops(movements: tuple[str, ...] = ("arm", "body")) -> Iterator[Loop]:
    """All combinations."""
    for movement in movements:
        for uncertainty, detector, is_tended in product(("independent", "joint"), ("", DETECTORS[movement]), (True, False)):
            yield Loop(movement, uncertainty, detector, is_tended)


def row_of(loop: Loop, times: LoopTimes) -> list[str]:
    """Under `COLUMNS`."""
    n_dof = learned(loop.movement, loop.uncertainty)[0].primitive_.n_dof
    quantiles = [duration_text(q) for q in np.quantile(times.seconds, [0.5, 0.99, 0.999, 1.0])]
    collector = "off" if loop.is_tended else "on"
    return [
        f"{n_dof} DoF",
        loop.uncertainty,
        loop.detector or "none",
        collector,
        *quantiles,
        f"{times.overruns} of {len(times.seconds):,}",
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Run control loops at 1 kHz.")
    parser.add_argument("--seconds", type=float, default=10.0, help="of each loop")
    parser.add_argument("--movements", nargs="+", default=["arm", "body"], choices=["letter", "arm", "body"])
    given = parser.parse_args()
    print(" | ".join(COLUMNS))
    for loop in loops(tuple(given.movements)):
        print(" | ".join(row_of(loop, measured(loop, given.seconds))), flush=True)


if __name__ == "__main__":
    main()
