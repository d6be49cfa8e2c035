"""What is done in worker processes: learning, calibrating, reading files that strangers may have made."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import PurePath
from typing import Any, NamedTuple

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration, synthetic_letters
from probdmp.detection import FailureDetector
from probdmp.dmp import task_for
from probdmp.errors import InputError, RecordingWarning
from probdmp.estimator import PrimitiveLibrary, ProbabilisticDMP, load_detector
from probdmp.estimator.partial_scores import log_densities_so_far
from probdmp.evaluation import judge_execution
from probdmp.execution import (
    GaussianTrajectory,
    position_covariances,
    task_of_recording,
    track_recording,
)
from probdmp.io import read_demonstrations, write_demonstrations
from probdmp.io.formats import FORMATS
from probdmp.plotting.panels import save_panels
from probdmp.plotting.trajectories import path_panel
from probdmp.studio.limits import DT, SIMULATED
from probdmp.studio.replays import compared_view, replayed_view

__all__ = [
    "MODEL",
    "Contents",
    "calibrate",
    "calibrate_by_simulation",
    "compare",
    "judge",
    "learn",
    "read_file",
    "recognise",
    "warm_up",
    "write_file",
]

MODEL = ".probdmp"
"""Suffix of model files."""


class Contents(NamedTuple):
    """What a file holds."""

    recordings: list[Demonstration]
    library: dict[str, ProbabilisticDMP]
    detector: FailureDetector | None


def learn(strokes: Sequence[Demonstration], parameters: Mapping[str, Any]) -> ProbabilisticDMP:
    """A movement from its demonstrations."""
    return ProbabilisticDMP(**parameters).fit(list(strokes))


def calibrate(
    library: Mapping[str, ProbabilisticDMP], strokes: Mapping[str, Sequence[Demonstration]], alpha: float
) -> dict[str, FailureDetector]:
    """Detectors by label: one that all labels with two or more demonstrations share, the paper's rule for the others."""
    several = {label: p for label, p in library.items() if len(strokes[label]) > 1}
    detectors: dict[str, FailureDetector] = {}
    if several:
        shared = FailureDetector(alpha).fit(several, {label: list(strokes[label]) for label in several})
        detectors = dict.fromkeys(several, shared)
    for label in library.keys() - several.keys():
        detectors[label] = FailureDetector(rule="paper").fit({label: library[label]}, {label: list(strokes[label])})
    return detectors


def calibrate_by_simulation(learned: ProbabilisticDMP, alpha: float) -> FailureDetector:
    """A detector of a movement without demonstrations of its own, such as one through via-points."""
    drawn = learned.sample_recordings(SIMULATED, random_state=0)
    return FailureDetector(alpha, calibration="held_out").fit(learned, drawn)


def recognise(library: Mapping[str, ProbabilisticDMP], drawn: Demonstration, is_complete: bool) -> dict[str, float]:
    """Log density per sample of a drawing under each movement, nats."""
    return log_densities_so_far(library, drawn, is_complete)


def judge(label: str, learned: ProbabilisticDMP, detector: FailureDetector | None, recording: Demonstration) -> dict[str, Any]:
    """A recorded execution as the filter and the detector have seen it, to be shown."""
    primitive = learned.primitive_
    task = task_of_recording(primitive, recording, duration=primitive.duration)
    judged = None if detector is None else judge_execution(detector, primitive, task, recording)
    return replayed_view(label, recording, track_recording(primitive, task, recording), judged)


def compare(label: str, learned: ProbabilisticDMP, recording: Demonstration) -> dict[str, Any]:
    """A recorded execution as filtered, and in hindsight, to be shown."""
    return compared_view(label, recording, learned.track(recording), learned.smooth(recording))


def read_file(path: str) -> Contents:
    """What a file holds: demonstrations at the rate of the studio, or movements with their detector."""
    if path.endswith(MODEL):
        return Contents([], dict(PrimitiveLibrary.load(path)), load_detector(path))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)
        return Contents(read_demonstrations(path, dt=DT), {}, None)


def write_file(
    path: str,
    library: Mapping[str, ProbabilisticDMP],
    strokes: Sequence[Demonstration],
    detector: FailureDetector | None,
    drawn: str | None,
) -> None:
    """A model, demonstrations, or a picture of the movement `drawn`, by suffix.

    Raises
    ------
    ProbDMPError
        If there is nothing to write, or what writes it is not installed.
    """
    suffix = PurePath(path).suffix
    if suffix in FORMATS:
        if not strokes:
            raise InputError("demonstrations to write", "none", "Draw one, or choose an example.")
        write_demonstrations(path, [replace(d, channels={}) for d in strokes] if _differ(strokes) else strokes)
    elif not library:
        raise InputError("a movement that was learned", "none", "Draw one, or choose an example.")
    elif suffix == MODEL:
        PrimitiveLibrary(library).save(path, detector, "probdmp studio")
    else:
        save_panels(path, [path_panel(label, *_path(library[label])) for label in ([drawn] if drawn else library)], 3)


def _differ(strokes: Sequence[Demonstration]) -> bool:
    """Whether some have channels that others have not, which no file can hold."""
    return len({frozenset(d.channels) for d in strokes}) > 1


def _path(learned: ProbabilisticDMP) -> tuple[GaussianTrajectory, FloatArray]:
    primitive = learned.primitive_
    return learned.rollout(), position_covariances(primitive, task_for(primitive), primitive.dt)


def warm_up() -> None:
    """Load what the first piece of work would wait for."""
    taught = synthetic_letters(2, letters="a")
    calibrate({"a": learn(taught, {})}, {"a": taught}, 0.01)
