"""`probdmp perturb`: executions as they would be with a fault."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from probdmp.cli.exit_codes import UsageError, usage
from probdmp.cli.options import (
    Columns,
    Force,
    Json,
    OutputRecordings,
    RecordingFiles,
    SampleStep,
    Seed,
    check_recordings_output,
    names_of,
)
from probdmp.cli.output import print_json, print_line, print_table
from probdmp.cli.recordings import read_files
from probdmp.cli.summaries import name_text

if TYPE_CHECKING:
    from probdmp.demonstrations import Demonstration, Fault

__all__ = ["perturb"]

FAULT_HELP = """Failures: hold (blocked), hold_release (for a while), slow, push (aside and back), drift, wrong_goal,
wrong_class (another movement of the same files). Benign: dropout, jitter. Sensor faults: stuck_sensor, spikes. push:0.4, and so
drift and wrong_goal, go astray by 0.4 of the range. Of sensor channels: lift, press (press:0.4), wrong_channel."""


def perturb(
    files: RecordingFiles,
    output: OutputRecordings,
    fault: Annotated[str, typer.Option(metavar="NAME", help=FAULT_HELP)] = "hold",
    onset: Annotated[
        float | None,
        typer.Option(
            metavar="FRACTION", help="Where it begins, such as 0.5. Default: drawn from 0.3 to 0.7 for each execution."
        ),
    ] = None,
    label: Annotated[str | None, typer.Option(metavar="LABEL", help="Only executions with this label.")] = None,
    columns: Columns = None,
    dt: SampleStep = None,
    seed: Seed = 0,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Put a fault into recorded executions, to see what is noticed.

    Writes what would have been recorded, in the order of the files, and tells when each fault begins. What is drawn depends on
    the seed, the label and the fault alone. Sensor channels of what is held, slowed down, or another movement, are so too.
    """
    from probdmp.demonstrations import fault_named
    from probdmp.io import write_demonstrations

    check_recordings_output(output, force)
    with usage():
        chosen = fault_named(fault)
    if onset is not None and not 0 < onset < 1:
        raise UsageError("--onset as a fraction between 0 and 1", f"{onset:g}")
    if onset is not None and chosen.takes_others:
        raise UsageError(f"no --onset with {chosen.name}", f"{onset:g}", "It is another movement from the first sample on.")
    recordings = read_files(files, columns=names_of(columns), dt=dt)
    faulty, onsets = _perturbed(recordings, chosen, seed, label, onset)
    with usage():
        write_demonstrations(output, [faulty[k] for k in sorted(faulty)])
    executions = [_execution(k, recordings[k], faulty[k], onsets[k]) for k in sorted(faulty)]
    document = {"fault": chosen.name, "nature": chosen.nature, "seed": seed, "output": str(output), "executions": executions}
    if as_json:
        print_json(document)
    else:
        _print_document(document)


def _perturbed(
    recordings: "list[Demonstration]", fault: "Fault", seed: int, label: str | None, onset: float | None
) -> "tuple[dict[int, Demonstration], dict[int, int]]":
    """By place in the files: executions with the fault, and the first sample of each that has it."""
    from probdmp.demonstrations import fault_generator, perturb_executions

    labels = dict.fromkeys(d.label for d in recordings)
    if label is not None and label not in labels:
        raise UsageError(f"--label to be one of those in the files: {', '.join(map(repr, labels))}", repr(label))
    faulty: dict[int, Demonstration] = {}
    onsets: dict[int, int] = {}
    for name in labels if label is None else [label]:
        members = [k for k, d in enumerate(recordings) if d.label == name]
        others = [d for d in recordings if d.label != name]
        rng = fault_generator(seed, name, fault)
        perturbed, first = perturb_executions(fault, [recordings[k] for k in members], others, rng, onset)
        faulty |= zip(members, perturbed, strict=True)
        onsets |= zip(members, first, strict=True)
    return faulty, onsets


def _execution(index: int, before: "Demonstration", faulty: "Demonstration", onset: int) -> dict[str, Any]:
    """Which execution got which onset: sample, seconds, and fraction of the duration it had."""
    return {
        "index": index,
        "label": before.label,
        "onset": onset * before.dt / before.duration,
        "onset_time": onset * before.dt,
        "onset_sample": onset,
        "duration_before": before.duration,
        "duration": faulty.duration,
    }


def _print_document(document: dict[str, Any]) -> None:
    print_line(f"Fault {document['fault']} ({document['nature']}), seed {document['seed']}", style="bold")
    print_table(
        ["execution", "label", "onset\n[s]", "onset\n[% of duration]", "duration before\n[s]", "with the fault\n[s]"],
        [
            [
                f"{e['index']}",
                name_text(e["label"]),
                f"{e['onset_time']:.3f}",
                f"{100 * e['onset']:.1f}",
                f"{e['duration_before']:.3f}",
                f"{e['duration']:.3f}",
            ]
            for e in document["executions"]
        ],
    )
    print_line(f"Wrote {len(document['executions'])} executions to {document['output']}.")
