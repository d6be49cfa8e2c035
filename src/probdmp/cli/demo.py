"""`probdmp demo`: the main job on built-in data."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from probdmp.cli.evaluate import Faults, Test, Train, evaluation_of, faults_of, write_evaluation
from probdmp.cli.evaluation_table import print_evaluation
from probdmp.cli.exit_codes import message, usage
from probdmp.cli.options import Json, Seed, check_output
from probdmp.cli.output import print_json, print_line
from probdmp.errors import MissingExtraError

__all__ = ["demo"]


def demo(
    letters: Annotated[
        str | None, typer.Option(metavar="LETTERS", help="Such as abc. Default: all 22 one-stroke letters.")
    ] = None,
    train: Train = 10,
    test: Test = 10,
    seed: Seed = 0,
    fault: Faults = "hold",
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE.html", help="Report with the table and figures.")
    ] = Path("report.html"),
    as_json: Json = False,
) -> None:
    """Learn letters, block them half-way, detect it; writes a report.

    Prints a table of false alarms and detected failures: the paper's as published, the calibrated detector, and the paper's
    rule on the same executions. The report says more about the calibrated detector, and shows an execution.

    The letters are synthetic: a writer who varies shape, size, slant, tempo and place. Takes one to
    two minutes; fewer --letters take less.
    """
    check_output(output, ".html")
    from probdmp.demonstrations import LETTERS, synthetic_letters
    from probdmp.evaluation import DETECTORS, READINGS, Experiment

    letters = LETTERS if letters is None else letters
    with usage():
        experiment = Experiment(train, test, seed, detector="calibrated", faults=faults_of(fault), traces=True)
        demonstrations = synthetic_letters(train + test, seed, letters)
    has_report = _can_report()
    paper = READINGS[0].name
    result = evaluation_of(demonstrations, experiment, {**DETECTORS["calibrated"], paper: DETECTORS["paper"][paper]})
    command = f"probdmp demo --letters {letters} --train {train} --test {test} --seed {seed} --fault {fault}"
    if as_json:
        print_json(result.as_dict(command))
    else:
        print_evaluation(result)
    if has_report:
        write_evaluation(output, result, demonstrations, command)
        if not as_json:
            print_line(f"Report: {output}")


def _can_report() -> bool:
    """False if what draws the report is not installed, which is said, before the wait, but is no failure."""
    from probdmp.plotting.style import require_matplotlib

    try:
        require_matplotlib()
    except MissingExtraError as error:
        print(f"probdmp: no report: {message(error)}", file=sys.stderr)
        return False
    return True
