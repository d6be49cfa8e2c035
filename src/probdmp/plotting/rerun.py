"""Recordings for Rerun, `.rrd`: a scalar over time for each column of a track, and events as a text log.

The file carries its own layout: a plot for each quantity, and the log below them. Time is the timeline `time`, from the start
of the execution. Needs the extra `rerun`.
"""

from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from probdmp.errors import InputError, MissingExtraError
from probdmp.io import write_atomically
from probdmp.plotting.style import BAND
from probdmp.plotting.timelines import Timelines, Track, nanoseconds_of

__all__ = ["LOG", "TIMELINE", "require_rerun", "write_rrd"]

TIMELINE = "time"
LOG = "/log"
"""Where the events are."""
GREY = "#555555"
COLORS = {"lower": BAND, "upper": BAND, "level": GREY, "threshold": GREY}
"""Of columns that are not what a track is about."""


def require_rerun() -> None:
    """Refuse, with the command to type, where the Rerun SDK is not installed."""
    if find_spec("rerun") is None:
        raise MissingExtraError("rerun-sdk for .rrd files", "none installed", "Type: pip install 'probdmp[rerun]'")


def write_rrd(path: str | Path, timelines: Timelines) -> None:
    """Write a recording for Rerun, atomically.

    Raises
    ------
    InputError
        If something other than a regular file is in the way, or Rerun is switched off in the environment.
    MissingExtraError
        If the Rerun SDK is not installed.
    """
    require_rerun()
    import rerun

    with TemporaryDirectory() as folder:
        written = Path(folder) / "recording.rrd"
        stream = rerun.RecordingStream("probdmp", send_properties=False)
        if not rerun.is_enabled(stream):
            raise InputError("Rerun switched on", "RERUN=0 in the environment", "Unset the variable RERUN.")
        stream.set_log_time_enabled(False)  # when it was written is of no interest
        stream.save(written, default_blueprint=_layout(timelines))
        if timelines.heading:
            stream.send_recording_name(timelines.heading)
        for track in timelines.tracks:
            _send(stream, track)
        for event in timelines.events:
            stream.set_time(TIMELINE, duration=np.timedelta64(int(nanoseconds_of(np.asarray([event.time]))[0]), "ns"))
            stream.log(LOG, rerun.TextLog(event.text, level={"warning": "WARN"}.get(event.level, event.level.upper())))
        stream.disconnect()
        write_atomically(path, written.read_bytes())


def _send(stream: Any, track: Track) -> None:
    """Each column of a track, where it is known, and how its line looks."""
    import rerun

    times = nanoseconds_of(track.times)
    for name, values in track.columns.items():
        entity, known = _entity(track, name), np.isfinite(values)
        color = int(COLORS.get(name, track.color).removeprefix("#") + "ff", 16)
        look = rerun.SeriesLines(names=f"{track.name} {name}", colors=[color])
        stream.log(entity, look, static=True)
        column = rerun.TimeColumn(TIMELINE, duration=times[known].astype("timedelta64[ns]"))
        if known.any():
            stream.send_columns(entity, [column], rerun.Scalars.columns(scalars=values[known]))


def _entity(track: Track, column: str | None = None) -> str:
    """The path of a track, or of a column of it; names may have any characters."""
    import rerun

    parts = [*track.name.split("/", 1), *([] if column is None else [column])]
    return str(rerun.new_entity_path(parts))


def _layout(timelines: Timelines) -> Any:
    """Plots of what belongs together, and the log if there is one."""
    import rerun.blueprint as rrb

    views: dict[str, list[str]] = {}
    for track in timelines.tracks:
        views.setdefault(track.view, []).append(f"{_entity(track)}/**")
    plots = [rrb.TimeSeriesView(name=view, contents=contents) for view, contents in views.items()]
    log = [rrb.TextLogView(name="Verdict", origin=LOG)] if timelines.events else []
    return rrb.Blueprint(rrb.Vertical(*plots, *log), collapse_panels=True)
