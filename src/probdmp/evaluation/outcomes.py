"""What judges say of each execution, and of themselves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from probdmp.checks import FloatArray, freeze_arrays
from probdmp.detection import CalibrationFacts
from probdmp.evaluation.trials import UNDISTURBED, Trial

__all__ = ["Assessment", "Finding", "Outcome", "Trace", "outcomes_of"]


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """A statistic while an execution runs, for operating curves: at another threshold the first alarm is another."""

    times: FloatArray
    """(T,) array, seconds since the start."""
    test_ratios: FloatArray
    """(T,) array: statistic over threshold, above 1 for an alarm."""

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True, slots=True)
class Finding:
    """What a judge says of one execution."""

    alarm: float | None
    """Seconds since the start at which it was first called failed, if it was."""
    kind: str = ""
    """What the alarm is about, such as `"motion"`, `"timing"` or `"sensor"`; nothing where the judge does not say. All but
    `"sensor"` are about the movement."""
    cause: str = ""
    """What it is in particular, such as `"held"`."""
    better: str = ""
    """Label of a class that fits the execution better, if the judge names one."""
    trace: Trace | None = field(default=None, compare=False)
    """Where `Experiment.traces` asks for it."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One test execution, as recorded and with each fault."""

    label: str
    duration: float
    """Seconds, as recorded."""
    onsets: Mapping[str, float]
    """By fault: when it began, seconds."""
    findings: Mapping[str, Finding]
    """Of `UNDISTURBED` and of each fault."""

    @property
    def false_alarm(self) -> float | None:
        """When the execution as recorded was called failed, if it was; seconds."""
        return self.findings[UNDISTURBED].alarm

    @property
    def alarms(self) -> dict[str, float | None]:
        """By fault: when the faulty execution was called failed, if it was; seconds."""
        return {fault: self.findings[fault].alarm for fault in self.onsets}


@dataclass(frozen=True, slots=True)
class Assessment:
    """All that a judge says of one split."""

    outcomes: Sequence[Outcome]
    """One for each test execution, in the order of the trials."""
    calibrations: tuple[CalibrationFacts, ...] = ()
    """Where its thresholds come from, if it is calibrated and tells."""


def outcomes_of(trial: Trial, findings: Mapping[str, Sequence[Finding]]) -> list[Outcome]:
    """One outcome for each test of a trial.

    Parameters
    ----------
    findings : for each name in `trial.executions`, one for each execution.
    """
    return [
        Outcome(
            label=trial.label,
            duration=test.duration,
            onsets={fault: onsets[i] * test.dt for fault, onsets in trial.onsets.items()},
            findings={name: findings[name][i] for name in trial.executions},
        )
        for i, test in enumerate(trial.tests)
    ]
