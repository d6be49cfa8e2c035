"""An execution at its own speed, which somebody may disturb."""

from typing import Any

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration, fault_generator, fault_named, perturb_executions
from probdmp.detection import FailureDetector
from probdmp.estimator import ProbabilisticDMP
from probdmp.execution import ExecutionStep, SimulatedPen
from probdmp.studio.limits import DT

__all__ = ["Playing", "faulty"]

MOST_TICKS = 12
"""Control ticks in one frame; a server that is too slow plays slower, and catches up on nothing."""


def faulty(
    recording: Demonstration, fault: str | None, onset: float, label: str, others: list[Demonstration], seed: int
) -> Demonstration:
    """A recording as it would have been with a fault, or as it is.

    Parameters
    ----------
    onset : part of the movement at which the fault begins.
    others : executions of other movements, for faults that take them.
    """
    if fault is None:
        return recording
    known = fault_named(fault)
    ((found,), _) = perturb_executions(known, [recording], others, fault_generator(seed, label, known), onset)
    return found


class Playing:
    """A pen that carries out a movement, and the execution that watches it.

    Parameters
    ----------
    recording : where the pen goes unless it is disturbed.
    speed : seconds of the movement in a second of the display.
    """

    def __init__(
        self,
        executed: ProbabilisticDMP,
        task: dict[str, Any],
        detector: FailureDetector | None,
        recording: Demonstration,
        speed: float,
        rng: np.random.Generator,
    ) -> None:
        self.execution = executed.execute(**task, dt=DT, detector=detector)
        primitive = executed.primitive_
        self.names = (*primitive.names, *primitive.channel_names)
        noise_stds = np.sqrt(primitive.observation_variances)
        self.pen = SimulatedPen(recording, primitive.channel_names, noise_stds, rng)
        self._speed, self._due, self._said = speed, 0.0, ""

    @property
    def is_over(self) -> bool:
        """Whether the pen has arrived, or was given up."""
        return self.pen.is_done

    def advance(self, seconds: float) -> tuple[ExecutionStep, FloatArray] | None:
        """Tick for so many seconds of the display; the last tick and its readings, (S,), if there was one."""
        self._due += seconds * self._speed / DT
        last = None
        for _ in range(min(int(self._due), MOST_TICKS)):
            if self.is_over:
                break
            measured = self.pen.read()
            last = self.execution.step(measured), measured
        self._due -= int(self._due)
        return last

    def has_news(self) -> bool:
        """Whether there is an alarm, and it says something that it did not say when this was asked last."""
        before, self._said = self._said, str(self.execution.verdict) if self.execution.failed else ""
        return self._said not in ("", before)
