"""What a page is shown: values of the library as messages."""

from collections.abc import Mapping
from typing import Any

from probdmp import __version__
from probdmp.demonstrations import FAULTS, Demonstration
from probdmp.detection import Verdict
from probdmp.dmp import Task
from probdmp.errors import ProbDMPError
from probdmp.estimator import ProbabilisticDMP
from probdmp.io.plain_values import plain
from probdmp.plotting.trajectories import evenly_spaced
from probdmp.studio.commands import commands_of
from probdmp.studio.session import Session
from probdmp.studio.settings import CHOICES
from probdmp.studio.strokes import EXAMPLES

__all__ = ["calibration_view", "error_view", "state_view", "stroke_view", "task_view", "verdict_view"]

MOST_SHOWN = 200
"""Points of a stroke that are shown."""


def error_view(error: ProbDMPError) -> dict[str, str]:
    """What was wrong and what to do."""
    return {"expected": error.expected, "got": error.got, "hint": error.hint}


def state_view(session: Session) -> dict[str, Any]:
    """All that a page needs to know of its session."""
    return plain(
        {
            "type": "state",
            "session": session.name,
            "version": __version__,
            "labels": [
                {"name": name, "strokes": [stroke_view(s) for s in m.strokes], "learned": m.learned is not None}
                for name, m in session.movements.items()
            ],
            "selected": session.selected,
            "settings": session.settings.as_dict(),
            "choices": CHOICES,
            "examples": list(EXAMPLES),
            "faults": list(FAULTS),
            "imported": [{"name": f"execution {k + 1}", "label": d.label} for k, d in enumerate(session.imported)],
            "calibration": calibration_view(session),
            "task": task_view(session),
            "commands": commands_of(session),
        }
    )


def stroke_view(stroke: Demonstration) -> dict[str, Any]:
    """A demonstration as it is shown small beside the canvas."""
    chosen = evenly_spaced(stroke.n_samples, MOST_SHOWN)
    points = [[t, *row] for t, row in zip(stroke.times[chosen].tolist(), stroke.positions[chosen].tolist(), strict=True)]
    return {"points": points, "duration": stroke.duration}


def task_view(session: Session) -> dict[str, Any]:
    """What is asked of executions."""
    wish = session.task
    via = [[phase, *point.tolist()] for phase, point in wish.via]
    return plain({"start": wish.start, "goal": wish.goal, "via": via, "duration": wish.duration})


def calibration_view(session: Session, task: Task | None = None) -> dict[str, Any] | None:
    """How far alarms about the selected movement may be trusted; None before anything was learned."""
    label = session.selected
    learned = None if label is None or label not in session.movements else session.movements[label].learned
    if label is None or learned is None:
        return None
    detector, alpha = session.detectors.get(label), session.settings.alpha
    known = detector is not None and any(p is learned.primitive_ or p.identity == learned.primitive_.identity
                                         for p in detector.primitives_.values())
    unknown: dict[str, Any] = {"n": 0, "attainable": None, "alpha": alpha, "guarantee": "none"}
    if session.is_calibrated_late:
        return unknown | {"text": f"Not calibrated: {session.is_calibrated_late}"}
    if detector is None or not known:
        return unknown | {"text": "Not calibrated yet."}
    if not detector.calibrations_:
        text = "One demonstration says nothing of how they vary: the paper's rule watches. Draw it again to calibrate."
        return unknown | {"n": 1, "text": text}
    facts = detector.calibrations_[0]
    text = f"Calibrated on {facts.n} demonstrations, each judged by what the others teach; they can vouch for {facts.attainable_rate:.3g}."
    return {
        "n": facts.n,
        "attainable": facts.attainable_rate,
        "alpha": facts.false_alarm_rate,
        "guarantee": facts.guarantee,
        "text": text,
    }


def verdict_view(verdict: Verdict | None) -> dict[str, Any]:
    """What was noticed."""
    if verdict is None:
        return {"type": "verdict", "failed": False, "text": "not watched: nothing says what is normal for this movement"}
    return plain(
        {
            "type": "verdict",
            "failed": verdict.failed,
            "text": str(verdict),
            "kind": verdict.kind,
            "cause": verdict.cause,
            "time": verdict.time,
            "phase": verdict.phase,
            "test_ratio": verdict.test_ratio,
            "blamed": verdict.blamed,
            "better": verdict.better,
            "contributions": dict(zip(verdict.names, verdict.contributions, strict=True)),
            "is_stale": verdict.is_stale,
        }
    )
