"""What the paper's experiment is run with, on any labelled demonstrations.

For every class: draw training demonstrations, learn a primitive, make a detector; draw test demonstrations, judge each as
recorded and with faults that begin at a random onset in 30 to 70 % of the movement.
Source: Meier & Schaal 2016, "Failure Detection with Probabilistic DMPs".
"""

from dataclasses import dataclass

from probdmp.checks import check_choice, check_count, check_names
from probdmp.demonstrations import fault_named
from probdmp.detection.options import DetectorOptions
from probdmp.dmp import PUBLISHED, Configuration
from probdmp.errors import InputError, InputTypeError

__all__ = ["TASKS", "Experiment"]

TASKS = ("known", "nominal")


@dataclass(frozen=True, slots=True)
class Experiment:
    """What is run."""

    train: int = 10
    """Demonstrations per class that teach the primitive."""
    test: int = 10
    """Other demonstrations per class that are judged."""
    seed: int = 0
    """Decides the split, the onsets and the noise of the faults; each class and each fault draws independently."""
    detector: str = "paper"
    """Which judges are asked: a name from `probdmp.evaluation.DETECTORS`, or what to call those that `evaluate` is given."""
    task: str = "known"
    """`"known"`: start, goal and duration of each execution are commanded (the paper); `"nominal"`: only the start is, goal
    and duration are as learned. Thresholds are learned with the same knowledge."""
    faults: tuple[str, ...] = ("hold",)
    """Names of faults, some with a size, such as `"push:0.4"`; see `probdmp.demonstrations.fault_named`."""
    configuration: Configuration | None = None
    """How primitives are made. Unless given, as published for the paper's detector and as the library does for others. Readings
    of the paper's rule set the forcing noise themselves; the calibrated detector learns how executions vary in any case."""
    false_alarm_rate: float = 0.01
    """What a calibrated detector is asked for, as a share of normal executions."""
    seeds: int = 1
    """Number of splits: with the seeds `seed`, `seed` + 1, …, figures pooled."""
    channels: tuple[str, ...] = ()
    """Sensor channels that the calibrated detector learns and watches with the movement."""
    traces: bool = False
    """Whether judges are asked to keep their statistic over time, for operating curves."""

    def configuration_for(self, detector: str) -> Configuration:
        """How primitives are made for a detector, whether that was given or not."""
        if self.configuration is not None:
            return self.configuration
        return PUBLISHED if detector == "paper" else Configuration(weight_uncertainty="joint")

    def __post_init__(self) -> None:
        for name in ("train", "test", "seeds"):
            check_count(getattr(self, name), name)
        check_count(self.seed, "seed", least=0)
        DetectorOptions(self.false_alarm_rate)
        check_choice(self.task, "task", TASKS)
        if check_names(self.channels, "channels") and self.detector == "paper":
            raise InputError("channels with the calibrated detector only", "them with the paper's, which knows positions alone")
        object.__setattr__(self, "channels", tuple(self.channels))
        if isinstance(self.faults, str):
            raise InputTypeError("faults as a tuple of names", repr(self.faults), f"A single one: ({self.faults!r},).")
        for fault in self.faults:
            fault_named(fault)
