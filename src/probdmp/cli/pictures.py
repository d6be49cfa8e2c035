"""What each picture of `probdmp plot` shows, from the files to its panels."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from probdmp.cli.exit_codes import UsageError, usage
from probdmp.cli.options import TaskOptions
from probdmp.cli.recordings import choose_primitive, read_files, read_recording
from probdmp.cli.summaries import name_text
from probdmp.errors import InputError, ModelFileError

if TYPE_CHECKING:
    from probdmp.estimator import ProbabilisticDMP
    from probdmp.evaluation import JudgeRecord
    from probdmp.plotting.panels import Panel
    from probdmp.plotting.timelines import Timelines

__all__ = ["KINDS", "Kind", "Picture", "PictureRequest", "picture_of"]


@dataclass(frozen=True, slots=True)
class PictureRequest:
    """What the command line says."""

    file: Path
    execution: Path | None
    label: str | None
    index: int
    task: TaskOptions
    columns: Sequence[str] | None
    dofs: Sequence[str] | None
    """Names of the two that make a path."""
    onset: float | None
    """Seconds."""


@dataclass(frozen=True, slots=True)
class Picture:
    """Panels in rows, under a heading."""

    panels: "Sequence[Panel]"
    columns: int
    heading: str = ""
    timelines: "Timelines | None" = None
    """The same values for viewers of time series, of kinds that are `over_time`."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of picture: which files and options it takes."""

    draw: Callable[[PictureRequest], Picture]
    files: str
    options: tuple[str, ...] = ()
    needs_execution: bool = False
    over_time: bool = False
    """Whether viewers of time series can show it."""


def picture_of(what: str, request: PictureRequest) -> Picture:
    """The picture that is asked for."""
    return KINDS[what].draw(request)


def _demonstrations(request: PictureRequest) -> Picture:
    from probdmp.evaluation import group_by_label
    from probdmp.plotting.demonstrations import class_panels, demonstration_panels

    by_label = group_by_label(read_files([request.file], request.label, columns=request.columns))
    dofs = _dofs(request, next(iter(by_label.values()))[0].names)
    if len(by_label) > 1:
        return Picture(class_panels(by_label, dofs), 5)
    ((label, members),) = by_label.items()
    return Picture(demonstration_panels(members, dofs), 3, f"{len(members)} demonstrations of {name_text(label)}")


def _basis(request: PictureRequest) -> Picture:
    from probdmp.plotting.forcing import basis_panels

    _, learned = _learned(request)
    return Picture(basis_panels(learned.primitive_), 2)


def _forcing(request: PictureRequest) -> Picture:
    from probdmp.plotting.forcing import forcing_panels

    label, learned = _learned(request)
    return Picture(forcing_panels(learned.primitive_), 3, f"Forcing term of {name_text(label)}")


def _rollout(request: PictureRequest) -> Picture:
    from probdmp.plotting.timelines import rollout_timelines
    from probdmp.plotting.trajectories import band_panels

    label, learned = _learned(request)
    with usage():
        planned = learned.rollout(**request.task.arguments(learned.primitive_))
    panels = band_panels(planned, range(len(planned.names)))
    return Picture(panels, 3, f"Rollout of {name_text(label)}, 95 % bands", rollout_timelines(planned))


def _path(request: PictureRequest) -> Picture:
    from probdmp.dmp import task_for
    from probdmp.execution import position_covariances
    from probdmp.plotting.trajectories import path_panel

    label, learned = _learned(request)
    primitive = learned.primitive_
    if primitive.n_dof < 2:
        raise UsageError(
            "a primitive with two degrees of freedom for a path", f"one: {primitive.names[0]}", "Plot its rollout."
        )
    arguments = request.task.arguments(primitive)
    with usage():
        planned = learned.rollout(**arguments)
    covariances = position_covariances(primitive, task_for(primitive, **arguments), primitive.dt)
    return Picture([path_panel(f"Path of {name_text(label)}", planned, covariances, _dofs(request, primitive.names))], 1)


def _smoothing(request: PictureRequest) -> Picture:
    from probdmp.estimator import PrimitiveLibrary
    from probdmp.plotting.executions import smoothing_panels
    from probdmp.plotting.timelines import smoothing_timelines

    assert request.execution is not None, "checked"
    library = PrimitiveLibrary.load(request.file)
    label, learned, recording = read_recording(request.execution, library, request.label, request.index)
    arguments = request.task.arguments(learned.primitive_)
    tracked, smoothed = learned.track(recording, **arguments), learned.smooth(recording, **arguments)
    heading = f"{name_text(label)}, recording {request.index}: log-likelihood {tracked.log_likelihoods.sum():.1f} nats"
    timelines = smoothing_timelines(recording, tracked, smoothed)
    return Picture(smoothing_panels(recording, tracked, smoothed), 3, heading, timelines)


def _monitor(request: PictureRequest) -> Picture:
    from probdmp.dmp import task_for
    from probdmp.estimator import PrimitiveLibrary, load_detector
    from probdmp.evaluation import judge_execution
    from probdmp.plotting.monitoring import monitoring_panels
    from probdmp.plotting.timelines import monitored_timelines

    assert request.execution is not None, "checked"
    library, detector = PrimitiveLibrary.load(request.file), load_detector(request.file)
    if detector is None:
        raise ModelFileError(
            f"a failure detector in {str(request.file)!r}", "a model without one", "Learn it with probdmp fit."
        )
    label, learned, recording = read_recording(request.execution, library, request.label, request.index)
    primitive = learned.primitive_
    arguments = request.task.arguments(primitive)
    if arguments["start"] is None:
        arguments["start"] = recording.positions[0]
    task = task_for(primitive, **arguments)
    judged = judge_execution(detector, primitive, task, recording)
    planned = learned.rollout(dt=recording.dt, **arguments | {"start": primitive.starts(task)})
    heading = f"{name_text(label)}, recording {request.index}: {judged.verdict}"
    timelines = monitored_timelines(planned, judged, request.onset)
    return Picture(monitoring_panels(planned, judged, request.onset), 2, heading, timelines)


def _operating(request: PictureRequest) -> Picture:
    from probdmp.plotting.operating import operating_panels

    judge = _first_judge(request)
    panels = operating_panels(judge)
    if not panels:
        raise InputError("an evaluation of failures, with operating curves", "one without", "Evaluate with --fault hold.")
    return Picture(panels, 3, f"Operating curves of the detector “{judge.name}”")


def _onset(request: PictureRequest) -> Picture:
    from probdmp.plotting.operating import onset_panels

    judge = _first_judge(request)
    panels = onset_panels(judge.summary)
    if not panels:
        raise InputError("an evaluation of failures", "one without", "Evaluate with --fault hold.")
    return Picture(panels, 2, f"Detection by onset, and latency, of the detector “{judge.name}”")


def _learned(request: PictureRequest) -> "tuple[str, ProbabilisticDMP]":
    from probdmp.estimator import PrimitiveLibrary

    return choose_primitive(PrimitiveLibrary.load(request.file), request.label)


def _first_judge(request: PictureRequest) -> "JudgeRecord":
    from probdmp.evaluation import record_of
    from probdmp.io import read_json

    return record_of(read_json(request.file)).judges[0]


def _dofs(request: PictureRequest, names: Sequence[str]) -> tuple[int, int]:
    """Places of the two degrees of freedom that make a path."""
    if request.dofs is None:
        return 0, 1
    if len(request.dofs) != 2 or len(set(request.dofs)) != 2 or not set(request.dofs) <= set(names):
        raise UsageError(f"--dof as two of {', '.join(names)}", ",".join(request.dofs))
    first, second = (list(names).index(name) for name in request.dofs)
    return first, second


TASK = ("--start", "--goal", "--duration", "--start-velocity")
KINDS: dict[str, Kind] = {
    "demonstrations": Kind(_demonstrations, "FILE", ("--label", "--columns", "--dof")),
    "basis": Kind(_basis, "MODEL", ("--label",)),
    "forcing": Kind(_forcing, "MODEL", ("--label",)),
    "rollout": Kind(_rollout, "MODEL", ("--label", *TASK), over_time=True),
    "path": Kind(_path, "MODEL", ("--label", *TASK, "--dof")),
    "smoothing": Kind(_smoothing, "MODEL EXECUTION", ("--label", "--index", *TASK), True, over_time=True),
    "monitor": Kind(_monitor, "MODEL EXECUTION", ("--label", "--index", *TASK, "--onset"), True, over_time=True),
    "operating": Kind(_operating, "EVALUATION.json"),
    "onset": Kind(_onset, "EVALUATION.json"),
}
"""By name, as given to `probdmp plot`."""
