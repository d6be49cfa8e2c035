"""Everything in the page as commands: what to type to do the same again."""

from shlex import quote
from typing import Any

from probdmp.studio.session import Session

__all__ = ["commands_of"]


def commands_of(session: Session) -> dict[str, str]:
    """The commands for a shell, and the same in Python, about the demonstrations that the page can download."""
    return {"shell": "\n".join(_shell(session)), "python": "\n".join(_python(session))}


def _shell(session: Session) -> list[str]:
    settings, label = session.settings, session.selected or ""
    options = ["--published"] if settings.variant == "as_published" else []
    options += ["--n-basis", str(settings.n_basis)]
    if settings.variant != "as_published":
        options += ["--weight-model", settings.weight_model, "--discretization", settings.discretization]
    if settings.use_pressure:
        options += ["--channels", "pressure"]
    options += ["--false-alarm-rate", f"{settings.alpha:g}"]
    lines = [f"probdmp fit demonstrations.npz -o model.probdmp {' '.join(options)}"]
    lines.append(" ".join(["probdmp rollout model.probdmp", "--label", quote(label), *_task_options(session)]))
    if session.task.via:
        lines.append("# The command line has no via-points: the code in Python goes through them.")
    lines.append(f"probdmp plot path model.probdmp --label {quote(label)} -o picture.svg")
    lines.append(f"probdmp monitor model.probdmp demonstrations.npz --label {quote(label)}")
    return lines


def _task_options(session: Session) -> list[str]:
    task = session.task
    points = {"--start": task.start, "--goal": task.goal}
    given = [f"{name}={','.join(f'{x:g}' for x in point)}" for name, point in points.items() if point is not None]
    return [*given, *([f"--duration {task.duration:g}"] if task.duration is not None else [])]


def _python(session: Session) -> list[str]:
    settings, label = session.settings, session.selected or ""
    task = ", ".join(f"{name}={_literal(value)}" for name, value in session.task.arguments.items() if value is not None)
    if settings.variant == "as_published":
        movement = f"ProbabilisticDMP.as_published(n_basis={settings.n_basis})"
    else:
        movement = f"ProbabilisticDMP({', '.join(f'{k}={v!r}' for k, v in settings.parameters.items())})"
    lines = [
        "from probdmp import FailureDetector, ProbabilisticDMP, read_demonstrations",
        "",
        f"demonstrations = read_demonstrations('demonstrations.npz', label={label!r})",
        f"movement = {movement}.fit(demonstrations)",
        f"detector = FailureDetector({settings.alpha:g}).fit(movement, demonstrations)",
    ]
    if session.task.via:  # the detector knows the movement as taught, not through via-points
        via = [(phase, point.tolist()) for phase, point in session.task.via]
        lines[1:1] = ["from probdmp.dmp import task_for", "from probdmp.execution import via_points_for"]
        lines.append(f"task = task_for(movement.primitive_{', ' if task else ''}{task})")
        lines.append(f"movement = movement.condition(via_points_for(movement.primitive_, task, {via!r}))")
    lines += [
        f"planned = movement.rollout({task})",
        "verdicts = detector.verdicts(demonstrations)",
    ]
    return lines


def _literal(value: Any) -> str:
    return repr(value.tolist() if hasattr(value, "tolist") else value)
