"""`probdmp convert`: recordings from one format to another."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from probdmp.cli.exit_codes import usage
from probdmp.cli.options import (
    READ,
    WRITTEN,
    Columns,
    Force,
    Json,
    SampleStep,
    Topic,
    Trim,
    check_recordings_output,
    names_of,
)
from probdmp.cli.output import print_json, print_line, print_table
from probdmp.cli.recordings import read_files
from probdmp.cli.summaries import name_text
from probdmp.cli.trajectories import with_unit

if TYPE_CHECKING:
    from probdmp.demonstrations import Demonstration

__all__ = ["convert"]


def convert(
    files: Annotated[list[Path], typer.Argument(metavar="IN…", help=f"Files to read ({READ}).", show_default=False)],
    output: Annotated[Path, typer.Argument(metavar="OUT", help=f"File to write ({WRITTEN}).", show_default=False)],
    label: Annotated[
        str | None, typer.Option(metavar="LABEL", help="Keep this movement only; recordings without a label are of it.")
    ] = None,
    columns: Columns = None,
    dt: SampleStep = None,
    topic: Topic = None,
    trim: Trim = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Convert recordings between formats; several files into one.

    Shows how they are understood. In several files, recordings without a label are named by their file, without the number:
    those of reach_03.csv are labelled reach.
    """
    from probdmp.io import write_demonstrations

    check_recordings_output(output, force)
    recordings = read_files(files, label, columns=names_of(columns), dt=dt, topic=topic, trim=trim)
    with usage():
        write_demonstrations(output, recordings)
    document = _document(recordings, output)
    if as_json:
        print_json(document)
    else:
        _print_document(document)


def _document(recordings: Sequence["Demonstration"], output: Path) -> dict[str, Any]:
    """What was written."""
    import numpy as np

    from probdmp.evaluation import group_by_label

    first = recordings[0]
    return {
        "output": str(output),
        "dt": first.dt,
        "positions": list(first.names),
        "units": first.units,
        "channels": list(first.channels),
        "movements": [
            {
                "label": label,
                "demonstrations": len(members),
                "shortest": min(d.duration for d in members),
                "longest": max(d.duration for d in members),
                "missing": float(np.mean(np.concatenate([np.isnan(d.positions).any(axis=1) for d in members]))),
            }
            for label, members in group_by_label(recordings).items()
        ],
    }


def _print_document(document: dict[str, Any]) -> None:
    positions = ", ".join(with_unit(name, document["units"]) for name in document["positions"])
    channels = ", ".join(document["channels"]) or "none"
    print_line(f"Positions {positions}; other channels: {channels}; {document['dt']:g} s between samples.")
    print_table(
        ["movement", "demos", "shortest\n[s]", "longest\n[s]", "samples missing\n[%]"],
        [
            [
                name_text(m["label"]),
                str(m["demonstrations"]),
                f"{m['shortest']:.3f}",
                f"{m['longest']:.3f}",
                f"{100 * m['missing']:.1f}",
            ]
            for m in document["movements"]
        ],
    )
    total = sum(m["demonstrations"] for m in document["movements"])
    print_line(f"Wrote {total} demonstrations to {document['output']}.")
