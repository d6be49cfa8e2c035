"""Which failure detector is asked for, and making it."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from probdmp.cli.exit_codes import UsageError, usage
from probdmp.cli.progress import progress
from probdmp.errors import TooFewDemonstrationsError

if TYPE_CHECKING:
    from probdmp.cli.sensor_file import SensorFile
    from probdmp.demonstrations import Demonstration
    from probdmp.detection import FailureDetector
    from probdmp.estimator import PrimitiveLibrary

__all__ = ["DEFAULT_RATE", "FalseAlarmRate", "Rule", "calibrate", "chosen_detector"]

DEFAULT_RATE = 0.01

FalseAlarmRate = Annotated[
    float | None,
    typer.Option(metavar="ALPHA", help="Of calibrated: share of normal executions that may be called failed. Default: 0.01."),
]
Rule = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Of the failure detector. calibrated (the default): for a rate of false alarms; paper: twice the least "
        "log-likelihood of the demonstrations (the default with --published).",
    ),
]


def chosen_detector(rule: str | None, false_alarm_rate: float | None, settings: Mapping[str, Any]) -> "FailureDetector":
    """What was asked for, not yet fitted, checked before any file is read.

    The calibrated detector needs primitives that know how executions vary.

    Parameters
    ----------
    settings : constructor arguments of ProbabilisticDMP.

    Raises
    ------
    UsageError
        If it does not go with the settings.
    """
    from probdmp.checks import check_choice
    from probdmp.detection import FailureDetector
    from probdmp.detection.detector import RULES
    from probdmp.detection.options import DetectorOptions

    varied = settings["weight_model"] == "hierarchical"
    rate = DEFAULT_RATE if false_alarm_rate is None else false_alarm_rate
    with usage():
        chosen = check_choice(("calibrated" if varied else "paper") if rule is None else rule, "--rule", RULES)
        DetectorOptions(rate)
    if chosen == "calibrated" and not varied:
        hint = "Use --rule paper, or learn how executions vary."
        raise UsageError("--rule paper with pooled weights, as in the paper's configuration", "--rule calibrated", hint)
    if chosen == "paper" and false_alarm_rate is not None:
        raise UsageError("--false-alarm-rate with --rule calibrated", "it with the paper's rule, which takes no rate")
    return FailureDetector(rate, rule=chosen)


def calibrate(
    detector: "FailureDetector",
    library: "PrimitiveLibrary",
    demonstrations: Mapping[str, Sequence["Demonstration"]],
    sensors: "SensorFile | None" = None,
) -> None:
    """Fit a detector; what to do about too few demonstrations is said in the words of the command line.

    Parameters
    ----------
    sensors : what has observed the demonstrations; positions and learned channels unless given.
    """
    scarce = [repr(label) for label, members in demonstrations.items() if len(members) < 2]
    if detector.rule == "calibrated" and scarce:
        hint = "Record more, leave it out with --label, or use --rule paper, which says nothing of false alarms."
        raise TooFewDemonstrationsError("two or more demonstrations of everything", f"one of {', '.join(scarce)}", hint)
    primitives = {label: learned.primitive_ for label, learned in library.items()}
    chosen = None if sensors is None else sensors.sensors_for_all(primitives)
    with progress("Calibrating", None) as done:
        detector.fit(library, demonstrations, on_part=done, sensors=chosen)
