"""`probdmp evaluate`: the paper's experiment on any labelled demonstrations."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from probdmp.cli.evaluation_table import print_evaluation
from probdmp.cli.exit_codes import usage
from probdmp.cli.options import Columns, Json, Seed, names_of
from probdmp.cli.output import print_json
from probdmp.cli.progress import progress
from probdmp.cli.recordings import read_files

if TYPE_CHECKING:
    from probdmp.demonstrations import Demonstration
    from probdmp.evaluation import Evaluation, Experiment

__all__ = ["Test", "Train", "evaluate", "evaluation_of"]

Train = Annotated[int, typer.Option(metavar="N", help="Demonstrations per class that teach the primitive.")]
FAULT_HELP = """What is injected, with commas between, or all. Failures: hold (blocked), hold_release (for a while), slow, push
(aside and back), drift, wrong_goal, wrong_class. Benign: dropout, jitter. Sensor faults: stuck_sensor, spikes. push:0.4, and so
drift and wrong_goal, go astray by 0.4 of the range."""
Test = Annotated[int, typer.Option(metavar="N", help="Other demonstrations per class that are judged.")]


def evaluate(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Labelled demonstrations (.npz).", show_default=False)],
    columns: Columns = None,
    train: Train = 10,
    test: Test = 10,
    seed: Seed = 0,
    seeds: Annotated[int, typer.Option(metavar="N", help="Splits, with the seeds S, S + 1, …; figures are pooled.")] = 1,
    detector: Annotated[str, typer.Option(metavar="NAME", help="paper: the paper's rule, in all its readings.")] = "paper",
    fault: Annotated[str, typer.Option(metavar="NAMES", help=FAULT_HELP)] = "hold",
    task: Annotated[
        str,
        typer.Option(metavar="NAME", help="known: start, goal and duration are commanded; nominal: only the start is."),
    ] = "known",
    configuration: Annotated[
        str, typer.Option(metavar="NAME", help="published: the paper's; default: the library's.")
    ] = "published",
    as_json: Json = False,
) -> None:
    """Measure false alarms and detected failures, as the paper does.

    For every label: learn from some demonstrations, judge others as recorded and with a fault that begins at a random moment
    in 30 to 70 % of the movement. Rates come with 95 % intervals, exact for one split and by bootstrap over classes for
    several; latencies are fractions of the duration.
    """
    from probdmp.checks import check_choice
    from probdmp.dmp import PUBLISHED, Configuration
    from probdmp.evaluation import DETECTORS, Experiment

    configurations = {"published": PUBLISHED, "default": Configuration()}
    with usage():
        chosen = configurations[check_choice(configuration, "configuration", configurations)]
        check_choice(detector, "detector", DETECTORS)
        experiment = Experiment(train, test, seed, detector, task, _faults(fault), chosen, seeds)
    result = evaluation_of(read_files([file], names_of(columns)), experiment)
    if as_json:
        print_json(result.as_dict())
    else:
        print_evaluation(result)


def evaluation_of(demonstrations: Sequence["Demonstration"], experiment: "Experiment") -> "Evaluation":
    """Run an experiment with a progress bar."""
    from probdmp.evaluation import DETECTORS, evaluate

    n_classes = len({demonstration.label for demonstration in demonstrations})
    with progress("Evaluating", n_classes * experiment.seeds * len(DETECTORS[experiment.detector])) as done:
        return evaluate(demonstrations, experiment, on_class=done)


def _faults(text: str) -> tuple[str, ...]:
    from probdmp.demonstrations import FAULTS

    named = [[*FAULTS] if name == "all" else [name] for name in names_of(text) or ()]
    return tuple(dict.fromkeys(name for names in named for name in names))
