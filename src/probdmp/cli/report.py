"""`probdmp report`: a page about a model or an evaluation."""

from pathlib import Path
from shlex import join
from typing import Annotated

import typer

from probdmp.cli.exit_codes import UsageError, usage
from probdmp.cli.options import Json, check_output
from probdmp.cli.output import print_json, print_line
from probdmp.cli.progress import progress

__all__ = ["report"]


def report(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="MODEL|EVALUATION",
            help="A model file, or what probdmp evaluate --json printed (.json).",
            show_default=False,
        ),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE.html", help="The page to write.")] = Path(
        "report.html"
    ),
    label: Annotated[
        str | None, typer.Option("--label", metavar="LABEL", help="Of a model: draw this primitive only. Default: all.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write a page about a model or an evaluation.

    One file that needs nothing else, with tables, pictures, how each number was made, and the command that makes it again; for
    the screen, the phone and paper.

    Of a model: what it was learned from, each primitive with its path, bands and forcing term, and what its failure detector
    can vouch for. Of an evaluation: rates with intervals, calibration, operating curves, detection by onset, latencies.

    Needs the extra: pip install 'probdmp[plot]'.
    """
    check_output(output, ".html")
    is_evaluation = file.suffix == ".json"
    if is_evaluation and label is not None:
        raise UsageError("--label with a model only", f"it with {str(file)!r}")
    from probdmp.io import write_atomically
    from probdmp.plotting.style import require_matplotlib

    require_matplotlib()
    text = _evaluation_page(file) if is_evaluation else _model_page(file, label, output)
    with usage():
        write_atomically(output, text.encode())
    if as_json:
        print_json({"written": str(output)})
    else:
        print_line(f"Report: {output}")


def _evaluation_page(file: Path) -> str:
    from probdmp.evaluation import record_of
    from probdmp.io import read_json
    from probdmp.plotting.evaluation_report import evaluation_page

    return evaluation_page(record_of(read_json(file)))


def _model_page(file: Path, label: str | None, output: Path) -> str:
    from probdmp.detection import FailureDetector
    from probdmp.io import read_model
    from probdmp.plotting.model_report import ModelReport, model_page

    contents = read_model(file)
    primitives = contents.primitives
    if label is not None and label not in primitives:
        raise UsageError(f"--label to be one of those in the model: {', '.join(map(repr, primitives))}", repr(label))
    drawn = tuple(primitives) if label is None else (label,)
    detector = None if contents.detector is None else FailureDetector.from_state(contents.detector, primitives)
    words = ["probdmp", "report", str(file), *(["--label", label] if label is not None else []), "-o", str(output)]
    with progress("Drawing", len(drawn)) as done:
        return model_page(ModelReport(file.name, primitives, drawn, detector, contents.provenance, join(words)), done)
