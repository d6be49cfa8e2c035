"""What a detector says of an execution."""

from dataclasses import dataclass

from probdmp.checks import FloatArray, freeze_arrays

__all__ = ["Verdict"]


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """Whether, when and why an execution was called failed. An alarm is latched: the first one counts."""

    failed: bool
    step: int
    """Ticks since the start at the first alarm; without one, where the test ratio was largest."""
    time: float
    """Seconds since the start at `step`."""
    phase: float
    """x at `step`, from 1 down to 0.01 at the end of the movement."""
    test_ratio: float
    """Statistic over threshold at `step`: above 1 for an alarm."""
    contributions: FloatArray
    """(D,) array, nats: log-likelihood of each degree of freedom at `step`, positions in units of their range. The lowest is
    to blame."""
    names: tuple[str, ...]
    """(D) names of the degrees of freedom."""

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def __str__(self) -> str:
        if not self.failed:
            return f"fine: largest test ratio {self.test_ratio:.2f}"
        blamed = self.names[int(self.contributions.argmin())]
        return f"failed at {self.time:.3f} s (phase {self.phase:.2f}): test ratio {self.test_ratio:.2f}, mostly {blamed}"
