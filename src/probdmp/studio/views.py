"""What a page is shown: values of the library as messages."""

from typing import Any

import numpy as np

from probdmp import __version__
from probdmp.demonstrations import FAULTS, Demonstration
from probdmp.detection import Verdict
from probdmp.detection.calibration_facts import CalibrationFacts
from probdmp.errors import MissingExtraError, ProbDMPError
from probdmp.execution import Judgement
from probdmp.io.plain_values import plain
from probdmp.plotting.style import require_matplotlib
from probdmp.plotting.trajectories import evenly_spaced
from probdmp.studio.commands import commands_of
from probdmp.studio.limits import SIMULATED
from probdmp.studio.session import Session, TaskWish
from probdmp.studio.settings import CHOICES, PRESSURE
from probdmp.studio.strokes import EXAMPLES

__all__ = ["calibration_view", "error_view", "pictures_missing", "state_view", "stroke_view", "task_view", "verdict_view"]

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
                {
                    "name": name,
                    "strokes": [stroke_view(s) for s in m.strokes],
                    "learned": m.learned is not None,
                    "origin": m.origin.as_dict(),
                }
                for name, m in session.movements.items()
            ],
            "selected": session.selected,
            "settings": session.settings.as_dict(),
            "choices": CHOICES,
            "examples": list(EXAMPLES),
            "faults": list(FAULTS),
            "pictures_missing": pictures_missing(),
            "imported": [{"name": f"execution {k + 1}", "label": d.label} for k, d in enumerate(session.imported)],
            "calibration": calibration_view(session),
            "task": task_view(session.task),
            "commands": commands_of(session),
        }
    )


def pictures_missing() -> str:
    """What to type before there are pictures; empty if there are."""
    try:
        require_matplotlib()
    except MissingExtraError as error:
        return error.hint
    return ""


def stroke_view(stroke: Demonstration) -> dict[str, Any]:
    """A demonstration as it is shown small beside the canvas, and taught again: seconds, x, y and, if it was felt, pressure."""
    chosen = evenly_spaced(stroke.n_samples, MOST_SHOWN)
    felt = [stroke.channels[PRESSURE]] if PRESSURE in stroke.channels else []
    points = np.column_stack([stroke.times, stroke.positions, *felt])[chosen]
    return {"points": points.tolist(), "duration": stroke.duration}


def task_view(wish: TaskWish) -> dict[str, Any]:
    """What is asked of executions."""
    via = [[phase, *point.tolist()] for phase, point in wish.via]
    return plain({"start": wish.start, "goal": wish.goal, "via": via, "duration": wish.duration})


def calibration_view(session: Session) -> dict[str, Any] | None:
    """How far alarms about the selected movement may be trusted; None before anything was learned."""
    movement = session.movements.get(session.selected or "")
    if movement is None or movement.learned is None:
        return None
    detector, identity = session.detectors.get(session.selected or ""), movement.learned.primitive_.identity
    note = session.calibration_note
    unknown = {"n": 0, "attainable": None, "alpha": session.settings.alpha, "guarantee": "none", "note": note}
    if detector is None or identity not in {p.identity for p in detector.primitives_.values()}:
        why = session.calibration_problem
        return unknown | {"text": f"Not calibrated. {why}" if why else "Being calibrated."}
    if not detector.calibrations_:
        text = "One demonstration does not say how they vary: the paper's rule watches. Draw it again to calibrate."
        return unknown | {"n": len(movement.strokes), "text": text}
    facts = detector.calibrations_[0]
    return {
        "n": facts.n,
        "attainable": facts.attainable_rate,
        "alpha": facts.false_alarm_rate,
        "guarantee": facts.guarantee,
        "note": note,
        "text": _calibration_text(facts, has_strokes=bool(movement.strokes)),
    }


def _calibration_text(facts: CalibrationFacts, has_strokes: bool) -> str:
    if has_strokes and facts.source == "leave_one_out":
        source = f"Calibrated on {facts.n} demonstrations, each judged by what the others teach"
    elif facts.source == "held_out" and facts.n == SIMULATED:
        source = f"Calibrated on {facts.n} executions drawn from the movement itself, for want of recorded ones"
    else:
        source = f"As calibrated in its file, on {facts.n} executions"
    return f"{source}. So many can vouch for a rate of {facts.attainable_rate:.2g}: {facts.guarantee}."


def verdict_view(verdict: Judgement | None) -> dict[str, Any]:
    """What was noticed."""
    if not isinstance(verdict, Verdict):
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
