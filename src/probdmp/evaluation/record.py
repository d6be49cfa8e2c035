"""The figures of an evaluation, as they are kept: all that its tables and pictures need, no recording."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from probdmp.detection import CalibrationFacts
from probdmp.errors import DataFileError
from probdmp.evaluation.operating import OperatingCurves, RealizedRate
from probdmp.evaluation.restoring import restored
from probdmp.evaluation.summary import Summary

__all__ = ["EvaluationRecord", "JudgeRecord", "record_of"]


@dataclass(frozen=True, slots=True)
class JudgeRecord:
    """The figures of one judge, over all seeds."""

    name: str
    summary: Summary
    calibrations: Mapping[int, tuple[CalibrationFacts, ...]]
    """Where its thresholds come from, by seed."""
    realized: tuple[RealizedRate, ...] = ()
    """False alarms at several nominal rates, if its thresholds can be moved."""
    operating: OperatingCurves | None = None
    """None where judges kept no traces."""

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {
            "name": self.name,
            **self.summary.as_dict(),
            "calibrations": [{"seed": seed, **asdict(facts)} for seed, each in self.calibrations.items() for facts in each],
            "realized": [asdict(one) for one in self.realized],
            "operating": None if self.operating is None else asdict(self.operating),
        }


@dataclass(frozen=True, slots=True)
class EvaluationRecord:
    """The figures of all judges, and what was run."""

    classes: int
    train: int
    test: int
    seed: int
    seeds: int
    detector: str
    task: str
    false_alarm_rate: float | None
    """What calibrated detectors were asked for; None if there were none."""
    interval: str
    """How intervals were made: a name from `probdmp.evaluation.metrics`."""
    judges: tuple[JudgeRecord, ...]
    """The first stands for the evaluation."""
    channels: tuple[str, ...] = ()
    """Sensor channels that were learned and watched with the movement."""
    command: str = ""
    """What to type to get the same figures, if it is known."""


FIELDS: dict[str, Any] = {
    name: EvaluationRecord.__annotations__[name]
    for name in ("classes", "train", "test", "seed", "seeds", "detector", "task", "false_alarm_rate", "interval")
}
HINT = "Make it with: probdmp evaluate FILE --json > evaluation.json"


def record_of(document: Any) -> EvaluationRecord:
    """The record in a document that `probdmp evaluate --json` printed.

    Raises
    ------
    DataFileError
        If it is none, or one from before curves were kept.
    """
    try:
        fields = {name: restored(kind, document[name]) for name, kind in FIELDS.items()}
        judges = tuple(_judge(entry) for entry in document["readings"])
        command = restored(str, document.get("command", ""))
        channels = restored(tuple[str, ...], document.get("channels", []))
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
        reason = f"missing {error}" if isinstance(error, KeyError) else str(error)
        raise DataFileError("an evaluation as JSON", f"something else ({reason:.200})", HINT) from error
    if not judges or not all(judge.summary.faults for judge in judges):
        raise DataFileError("an evaluation with a judge and a fault", "one without", HINT)
    return EvaluationRecord(**fields, judges=judges, channels=channels, command=command)


def _judge(entry: Mapping[str, Any]) -> JudgeRecord:
    calibrations: dict[int, tuple[CalibrationFacts, ...]] = {}
    for given in entry["calibrations"]:
        facts = {name: value for name, value in given.items() if name != "seed"}
        seed = restored(int, given["seed"])
        calibrations[seed] = (*calibrations.get(seed, ()), restored(CalibrationFacts, facts))
    return JudgeRecord(
        name=restored(str, entry["name"]),
        summary=restored(Summary, {name: entry[name] for name in ("false_alarms", "faults", "worst_class")}),
        calibrations=calibrations,
        realized=restored(tuple[RealizedRate, ...], entry["realized"]),
        operating=restored(OperatingCurves | None, entry["operating"]),
    )
