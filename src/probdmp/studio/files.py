"""Files in and out of a session; those that come in may be anybody's."""

import io
import os
import zipfile
from collections import Counter
from collections.abc import AsyncIterator, Iterator, Mapping
from dataclasses import replace
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import NamedTuple

from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError, InputError
from probdmp.estimator import ProbabilisticDMP
from probdmp.evaluation import group_by_label
from probdmp.io.formats import FORMATS
from probdmp.studio import jobs
from probdmp.studio.commands import commands_of
from probdmp.studio.fields import name_of
from probdmp.studio.limits import DT, IMPORTED, LARGEST_UPLOAD, LONGEST_NAME, LONGEST_STROKE
from probdmp.studio.origins import origin_of
from probdmp.studio.room import Room
from probdmp.studio.views import pictures_missing

__all__ = ["DOWNLOADS", "Import", "add_contents", "add_file", "download", "received"]

DOWNLOADS = {
    "demonstrations.npz": "application/octet-stream",
    "demonstrations.csv": "text/csv",
    "model.probdmp": "application/octet-stream",
    "picture.svg": "image/svg+xml",
    "picture.png": "image/png",
    "session.zip": "application/zip",
}
"""Names of what can be downloaded, and what it is."""
COMMANDS = "commands.txt"


async def received(stream: AsyncIterator[bytes]) -> bytes:
    """The body of an upload.

    Raises
    ------
    InputError
        If it is too large; the rest is not read.
    """
    body = bytearray()
    async for part in stream:
        body += part
        if len(body) > LARGEST_UPLOAD:
            hint = "Use the command line: probdmp fit takes files of any size."
            raise InputError(f"a file of at most {LARGEST_UPLOAD} bytes", "a larger one", hint)
    return bytes(body)


class Import(NamedTuple):
    """What was taken in."""

    labels: dict[str, int]
    """Recordings of each label; 0 for a movement that came without any."""
    note: str
    """How they are shown, if not as they are."""
    first: dict[str, int]
    """Place of the first one among the recordings of each label, or among the executions."""


async def add_file(room: Room, name: str, body: bytes, as_execution: bool) -> Import:
    """Take in what an uploaded file holds.

    Raises
    ------
    ProbDMPError
        If it is none of the known kinds, or holds what cannot be shown.
    """
    suffix = PurePath(name).suffix.lower()
    if suffix not in (jobs.MODEL, *FORMATS):
        raise InputError(f"a file that ends in {', '.join((jobs.MODEL, *FORMATS))}", f"{name!r:.100}")
    with TemporaryDirectory(prefix="probdmp-studio-") as folder:
        path = Path(folder) / f"upload{suffix}"  # its own name is the page's, and may be anything
        path.write_bytes(body)
        contents = await room.workers.run_long(jobs.read_file, str(path))
    taken = add_contents(room, PurePath(name).stem, contents, as_execution)
    for label in contents.library:
        await room.show_band(_label(label, PurePath(name).stem))
    return taken


def add_contents(room: Room, stem: str, contents: jobs.Contents, as_execution: bool = False) -> Import:
    """Take in what a file holds; recordings without a label are named after the file, by its stem."""
    session, origins = room.session, []
    shown = [_shown(d, stem) for d in contents.recordings]
    library = {_label(label, stem): _checked(label, learned) for label, learned in contents.library.items()}
    if as_execution and not shown:
        raise DataFileError("recorded executions to replay", "a model", "Open it to use it instead.")
    if as_execution:
        first = {IMPORTED: len(session.imported)}
        session.add_imported(shown)
    else:
        first = {label: session.n_recordings(label) if label in session.movements else 0 for label in _labels(library, shown)}
        detector = contents.detector
        planned = {label: origin_of([_planned(learned)]) for label, learned in library.items()}
        session.add_movements(library, detector if detector is not None and detector.sensors_ is None else None, planned)
        origins = [*planned.values(), *([origin_of(shown)] if shown else [])]
        groups = group_by_label(shown)
        for label in groups:
            session.origin_with(label, origins[-1])  # all or none
        for label, members in groups.items():
            session.add_strokes(label, members, origins[-1])
        room.learner.learn(*dict.fromkeys(d.label for d in shown))
    room.show_state()
    note = next((origin.note for origin in origins if origin.note), "")
    return Import(_labels(library, shown), note, first)


def _labels(library: Mapping[str, ProbabilisticDMP], shown: list[Demonstration]) -> dict[str, int]:
    return dict.fromkeys(library, 0) | Counter(d.label for d in shown)


def _planned(learned: ProbabilisticDMP) -> Demonstration:
    """Where a movement goes."""
    planned = learned.rollout(dt=DT)
    return Demonstration(planned.positions, DT, names=learned.primitive_.names, units=learned.primitive_.units)


def _label(label: str, stem: str) -> str:
    return name_of({"label": label or stem[:LONGEST_NAME]})


def _shown(recording: Demonstration, stem: str) -> Demonstration:
    """A recording as a stroke of the canvas."""
    if recording.n_dof != 2:
        hint = "The studio shows paths in the plane; probdmp fit and probdmp monitor take any."
        raise DataFileError("recordings of two degrees of freedom", f"{recording.n_dof} ({', '.join(recording.names)})", hint)
    _check_duration(recording.duration)
    return replace(recording, label=_label(recording.label, stem))


def _checked(label: str, learned: ProbabilisticDMP) -> ProbabilisticDMP:
    if learned.primitive_.n_dof != 2:
        hint = "The studio shows paths in the plane; probdmp rollout and probdmp monitor take any."
        raise DataFileError("a model of two degrees of freedom", f"{learned.primitive_.n_dof} of {label!r:.60}", hint)
    _check_duration(learned.primitive_.duration)
    return learned


def _check_duration(seconds: float) -> None:
    if seconds > LONGEST_STROKE:
        hint = "A time in milliseconds? The command line takes longer ones."
        raise DataFileError(f"movements of at most {LONGEST_STROKE:g} s", f"{seconds:g} s", hint)


async def download(room: Room, name: str) -> bytes:
    """One of `DOWNLOADS`."""
    await room.learner.settled()
    if name != "session.zip":
        return await _written(room, name, _all_strokes(room))
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for part, strokes in _parts(room):
            archive.writestr(part, await _written(room, part, strokes))
        archive.writestr(COMMANDS, "\n\n".join(commands_of(room.session).values()))
    return buffer.getvalue()


def _all_strokes(room: Room) -> list[Demonstration]:
    return [stroke for strokes in room.session.all_strokes().values() for stroke in strokes]


def _parts(room: Room) -> Iterator[tuple[str, list[Demonstration]]]:
    """What a session consists of: demonstrations in a file for each unit, no pictures where nothing draws them."""
    by_origin: dict[tuple[tuple[str, ...], str], list[Demonstration]] = {}
    for stroke in _all_strokes(room):
        by_origin.setdefault((stroke.names, stroke.units), []).append(stroke)
    for part in DOWNLOADS:
        path = PurePath(part)
        if path.suffix in FORMATS:
            for k, strokes in enumerate(by_origin.values()):
                yield (path.name if k == 0 else f"{path.stem}-{k + 1}{path.suffix}"), strokes
        elif path.suffix == jobs.MODEL or (path.stem == "picture" and not pictures_missing()):
            yield part, []


async def _written(room: Room, name: str, strokes: list[Demonstration]) -> bytes:
    session = room.session
    if len({(d.names, d.units) for d in strokes}) > 1:
        hint = "session.zip holds a file for each unit."
        raise InputError("demonstrations of one unit in one file", "of several", hint)
    with TemporaryDirectory(prefix="probdmp-studio-") as folder:
        path = os.path.join(folder, name)
        arguments = (session.library, strokes, room.shared_detector(), session.selected)
        await room.workers.run_long(jobs.write_file, path, *arguments)
        return Path(path).read_bytes()
