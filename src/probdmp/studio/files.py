"""Files in and out of a session; those that come in may be anybody's."""

import io
import os
import zipfile
from collections import Counter
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import NamedTuple

from probdmp.demonstrations import Demonstration, are_within, placement_within
from probdmp.errors import DataFileError, InputError
from probdmp.estimator import ProbabilisticDMP
from probdmp.evaluation import group_by_label
from probdmp.io.formats import FORMATS
from probdmp.studio import jobs
from probdmp.studio.commands import commands_of
from probdmp.studio.fields import name_of
from probdmp.studio.limits import CANVAS, LARGEST_UPLOAD, LONGEST_NAME, LONGEST_STROKE
from probdmp.studio.room import Room

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
    """What was done to them, if anything."""


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
    return add_contents(room, PurePath(name).stem, contents, as_execution)


def add_contents(room: Room, stem: str, contents: jobs.Contents, as_execution: bool = False) -> Import:
    """Take in what a file holds; recordings without a label are named after the file, by its stem."""
    session, note = room.session, ""
    shown = [_shown(d, stem) for d in contents.recordings]
    library = {_label(label, stem): _checked(label, learned) for label, learned in contents.library.items()}
    if as_execution and not shown:
        raise DataFileError("recorded executions to replay", "a model", "Open it to use it instead.")
    if shown and not as_execution:
        session.placement = None if are_within(shown, CANVAS) else placement_within(shown, CANVAS)
    if session.placement is not None:
        shown = [session.placement.placed(d) for d in shown]
        note = f"Scaled by {session.placement.scale:.3g} and moved, to fit the canvas."
    if as_execution:
        session.add_imported(shown)
    else:
        detector = contents.detector
        session.add_movements(library, detector if detector is not None and detector.sensors_ is None else None)
        for label, members in group_by_label(shown).items():
            session.add_strokes(label, members)
        room.learner.learn(*dict.fromkeys(d.label for d in shown))
    room.show_state()
    return Import(dict.fromkeys(library, 0) | Counter(d.label for d in shown), note)


def _label(label: str, stem: str) -> str:
    return name_of({"label": label or stem[:LONGEST_NAME]})


def _shown(recording: Demonstration, stem: str) -> Demonstration:
    """A recording as a stroke of the canvas."""
    if recording.n_dof != 2:
        hint = "The studio shows paths in the plane; probdmp fit and probdmp monitor take any."
        raise DataFileError("recordings of two degrees of freedom", f"{recording.n_dof} ({', '.join(recording.names)})", hint)
    _check_duration(recording.duration)
    return replace(recording, label=_label(recording.label, stem), names=("x", "y"), units="")


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
    if name != "session.zip":
        return await _written(room, name)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for part in DOWNLOADS:
            if part != name:
                archive.writestr(part, await _written(room, part))
        archive.writestr(COMMANDS, "\n\n".join(commands_of(room.session).values()))
    return buffer.getvalue()


async def _written(room: Room, name: str) -> bytes:
    session = room.session
    await room.learner.settled()
    strokes = [d for part in session.all_strokes().values() for d in part]
    with TemporaryDirectory(prefix="probdmp-studio-") as folder:
        path = os.path.join(folder, name)
        arguments = (session.library, strokes, room.shared_detector(), session.selected)
        await room.workers.run_long(jobs.write_file, path, *arguments)
        return Path(path).read_bytes()
