"""What a detector says of an execution."""

from dataclasses import dataclass

import numpy as np

from probdmp.checks import FloatArray, freeze_arrays

__all__ = ["KINDS", "Verdict"]

KINDS = ("motion", "timing", "channel", "sensor", "data missing")
"""What a failure is about: where the movement goes; when it gets there; how it feels, by a learned channel; what measures it;
that nothing does."""


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """Whether, when and why an execution was called failed. An alarm is latched: the first one counts.

    `kind` and `cause` are looked into while the execution goes on, for at the first sign of a failure it may not yet be clear
    whether a movement was blocked or slowed down.
    """

    failed: bool
    step: int
    """Ticks of the controller since the start at the first alarm; without one, where the test ratio was largest."""
    time: float
    """Seconds since the start at `step`."""
    phase: float
    """x at `step`, from 1 down to 0.01 at the end of the movement."""
    test_ratio: float
    """Statistic over threshold at `step`: above 1 for an alarm."""
    contributions: FloatArray
    """(W,) array: squared deviation of each degree of freedom and channel at `step`, in standard deviations of what was
    expected, with its sign (measured minus expected); of a sensor fault, how far each sensor is to blame. The largest is."""
    names: tuple[str, ...]
    """(W) names of the degrees of freedom, and of the channels or sensors that are watched with them."""
    kind: str = ""
    """One of `KINDS`; nothing without an alarm, or where the rule does not tell."""
    cause: str = ""
    """In a few words, such as held, slow, fast, off the path, stuck, spikes."""
    channel: str = ""
    """The statistic that was largest at `step`."""
    better: str = ""
    """Label of the primitive of the library that fits the execution better, if there is one."""
    is_stale: bool = False
    """Whether nothing has been measured for so long that the execution cannot be judged now."""
    has_sensor_fault: bool = False
    """Whether a sensor cannot be believed."""

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def blamed(self) -> str:
        """The degree of freedom or channel that contributes most, with the sign of its deviation; nothing if none does."""
        if not np.any(self.contributions):
            return ""
        largest = int(np.argmax(np.abs(self.contributions)))
        sign = {1: "+", -1: "−"}.get(int(np.sign(self.contributions[largest])), "")
        return f"{sign}{self.names[largest]}"

    def __str__(self) -> str:
        if not self.failed:
            stale = "; nothing measured lately" if self.is_stale else ""
            return f"fine: largest test ratio {self.test_ratio:.2f}{stale}"
        kind = f" [{self.kind}: {self.cause}]" if self.kind else ""
        mostly = f", mostly {self.blamed}" if self.blamed else ""
        better = f", looks like {self.better!r}" if self.better else ""
        when = f"failed at {self.time:.3f} s (phase {self.phase:.2f})"
        return f"{when}{kind}: test ratio {self.test_ratio:.2f}{mostly}{better}"
