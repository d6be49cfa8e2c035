"""What a failure detector was made from and what it says, for people and as JSON objects; several verbs say the same."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from probdmp.cli.output import print_line, print_table
from probdmp.cli.summaries import name_text

if TYPE_CHECKING:
    from probdmp.detection import CalibrationFacts, FailureDetector, Verdict

__all__ = ["calibration_text", "detector_summary", "percent", "print_detector", "verdict_summary"]

TOLD = {"known": "goal and duration told", "nominal": "only the start told"}
SOURCES = {"leave_one_out": "leave-one-out", "held_out": "held-out"}
FLAGGED = (
    "Flagged, since more of their executions are among the most surprising tenth than chance explains, or all of them rank "
    "higher; with the share among that tenth"
)


def verdict_summary(verdict: "Verdict", calibration: "CalibrationFacts | None") -> dict[str, Any]:
    """All of a verdict, and what its threshold vouches for; contributions are signed, by degree of freedom."""
    return {
        "failed": verdict.failed,
        "time": verdict.time,
        "phase": verdict.phase,
        "step": verdict.step,
        "kind": verdict.kind or None,
        "cause": verdict.cause or None,
        "channel": verdict.channel or None,
        "test_ratio": verdict.test_ratio,
        "contributions": dict(zip(verdict.names, verdict.contributions, strict=True)),
        "better": verdict.better or None,
        "is_stale": verdict.is_stale,
        "has_sensor_fault": verdict.has_sensor_fault,
        "false_alarm_rate": None if calibration is None else calibration.false_alarm_rate,
        "guarantee": None if calibration is None else calibration.guarantee,
    }


def detector_summary(detector: "FailureDetector") -> dict[str, Any]:
    """The rule, and by which thresholds it goes.

    Those of the paper's rule come by label, in nats: the least log-likelihood in training and the level below which an
    execution has failed. Sensors are as in `probdmp.execution.plain_sensors`; None: positions and learned channels.
    """
    from probdmp.execution import sensors_as_plain

    sensors = None if detector.sensors_ is None else sensors_as_plain(detector.sensors_)
    if detector.rule == "paper":
        thresholds = {label: detector.thresholds_[primitive.identity] for label, primitive in detector.primitives_.items()}
        levels = {label: {**asdict(t), "level": t.level} for label, t in thresholds.items()}
        return {"rule": detector.rule, "likelihood": detector.likelihood, "thresholds": levels, "sensors": sensors}
    return {
        "rule": detector.rule,
        "statistic": detector.statistic,
        "false_alarm_rate": detector.false_alarm_rate,
        "persistence": detector.persistence,
        "calibrations": [asdict(facts) for facts in detector.calibrations_],
        "sensors": sensors,
    }


def calibration_text(facts: "CalibrationFacts") -> str:
    """One line: what was asked for, from how many executions, what they can vouch for, who is flagged and why."""
    flagged = ", ".join(f"{label!r} {percent(share)}" for label, share in facts.suspects.items())
    of_which = f" of {name_text(facts.label)!r}" if facts.label else ""
    return (
        f"With {TOLD[facts.task]}{of_which}: {percent(facts.false_alarm_rate)} false alarms per execution asked for, "
        f"{percent(facts.attainable_rate)} attainable with n = {facts.n} ({SOURCES[facts.source]}), "
        f"{facts.method}, {facts.guarantee}." + (f" {FLAGGED}: {flagged}." if flagged else "")
    )


def print_detector(summary: Mapping[str, Any]) -> None:
    """A detector from its summary."""
    _print_rule(summary)
    if summary["sensors"] is not None:
        names = (f"{s['name']} ({', '.join(s.get('outputs', [s['name']]))})" for s in summary["sensors"])
        print_line(f"Sensors of executions: {', '.join(names)}.")


def _print_rule(summary: Mapping[str, Any]) -> None:
    if summary["rule"] == "paper":
        print_line(f"Failure detector: rule “paper”, log-likelihood {summary['likelihood'].replace('_', ' ')}.")
        print_table(
            ["primitive", "least in training [nats]", "failed below [nats]"],
            [[name_text(label), f"{t['minimum']:.2f}", f"{t['level']:.2f}"] for label, t in summary["thresholds"].items()],
        )
        return
    asked = f"{percent(summary['false_alarm_rate'])} false alarms per execution asked for"
    print_line(f"Failure detector: rule “calibrated”, {asked}, statistic {summary['statistic']}.")
    print_table(
        ["task", "for", "n", "attainable", "threshold\n[nats]", "method", "guarantee", "flagged"],
        [
            [
                c["task"],
                c["label"] or "all",
                f"{c['n']}",
                percent(c["attainable_rate"]),
                f"{c['threshold']:.2f}",
                c["method"],
                c["guarantee"],
                "\n".join(f"{label} {percent(share)}" for label, share in c["suspects"].items()) or "–",
            ]
            for c in summary["calibrations"]
        ],
    )


def percent(fraction: float) -> str:
    """A fraction in percent, in at most three digits."""
    return f"{100 * fraction:.3g} %"
