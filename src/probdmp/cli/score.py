"""`probdmp score`: verdicts on a fleet's executions, of any number."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from probdmp.cli.exit_codes import UsageError
from probdmp.cli.options import Jobs, Json, ModelFile, check_output
from probdmp.cli.output import print_json, print_line, print_table
from probdmp.cli.progress import progress
from probdmp.cli.summaries import name_text

if TYPE_CHECKING:
    from probdmp.fleet import FleetSummary

__all__ = ["score"]


def score(
    model: ModelFile,
    executions: Annotated[
        Path, typer.Argument(metavar="EXECUTIONS.parquet", help="Executions, see docs/how-to/fleet.md.", show_default=False)
    ],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="SCORES.parquet", help="Scores, one row per execution.", show_default=False),
    ],
    jobs: Jobs = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Score on the Dask cluster of this scheduler, whose workers see the executions at this path.",
        ),
    ] = None,
    restart: Annotated[
        bool, typer.Option("--restart", help="Begin anew: replace the output and what an earlier run has left.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Judge every execution of a Parquet file.

    Of each: the verdict, when it failed and why, the test ratio, the log-likelihood, a primitive that fits better. An execution
    that cannot be judged gets the verdict error and the reason. Exit code 0 whether or not executions have failed.

    A run that was interrupted is gone on with when the same command is given again, without --restart.
    """
    check_output(output, ".parquet")
    from probdmp.fleet import score_executions
    from probdmp.fleet.parts_folder import is_begun

    if output.exists() and not restart and not is_begun(output):
        raise UsageError("an output file that does not exist yet", repr(str(output)), "Use --restart to replace it.")
    if scheduler is not None and jobs > 1:
        raise UsageError("--jobs or --scheduler", "both", "A cluster has its own workers.")
    done: dict[str, Any] = {}
    with progress("Scoring", None) as bar:

        def on_part(so_far: int, n_parts: int) -> None:
            for k in range(done.get("parts", 0), so_far):
                bar(str(k), n_parts)
            done["parts"] = so_far

        summary = score_executions(
            model, executions, output, workers=jobs if scheduler is None else scheduler, restart=restart, on_part=on_part
        )
    document = _document(summary, output)
    if as_json:
        print_json(document)
    else:
        _print_summary(document)


def _document(summary: "FleetSummary", output: Path) -> dict[str, Any]:
    verdicts = summary.verdicts
    seconds, n_executions = summary.seconds, sum(verdicts.values())
    return {
        "scores": str(output),
        "model": summary.model,
        "executions": n_executions,
        "verdicts": {name: verdicts[name] for name in ("fine", "failed", "error")},
        "primitives": {label: _shares(counts) for label, counts in summary.counts.items()},
        "seconds": seconds,
        "executions_per_second": summary.n_scored / seconds,
        "parts": summary.parts,
        "resumed": summary.resumed,
    }


def _shares(counts: Any) -> dict[str, Any]:
    """Of the executions of one primitive; the share that failed is of those that could be judged, with a 95 % interval."""
    from dataclasses import asdict

    from probdmp.evaluation import rate_of

    judged = counts["fine"] + counts["failed"]
    return {"failed": asdict(rate_of(counts["failed"], judged)) if judged else None, "errors": counts["error"]}


def _print_summary(document: dict[str, Any]) -> None:
    rows = []
    for label, shares in document["primitives"].items():
        failed = shares["failed"]
        share = "–" if failed is None else f"{100 * failed['rate']:.1f} ({100 * failed['low']:.1f}–{100 * failed['high']:.1f})"
        counts = ["0", "0"] if failed is None else [str(failed["n"]), str(failed["count"])]
        rows.append([name_text(label), *counts, share, str(shares["errors"])])
    print_table(["primitive", "judged", "failed", "failed\n[%]", "errors"], rows)
    verdicts, seconds = document["verdicts"], document["seconds"]
    print_line(
        f"{document['executions']} executions: {verdicts['fine']} fine, {verdicts['failed']} failed, "
        f"{verdicts['error']} could not be judged; {seconds:.1f} s, {document['executions_per_second']:.0f} per second."
    )
    resumed = f", {document['resumed']} of {document['parts']} parts from an earlier run" if document["resumed"] else ""
    print_line(f"Wrote {document['scores']}{resumed}.")
