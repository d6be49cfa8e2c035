"""`probdmp evaluate`: the paper's experiment on any labelled demonstrations."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from shlex import join
from typing import TYPE_CHECKING, Annotated, Any

import typer

from probdmp.cli.detector_choice import DEFAULT_RATE, FalseAlarmRate
from probdmp.cli.evaluation_table import print_evaluation
from probdmp.cli.exit_codes import UsageError, usage
from probdmp.cli.options import Columns, Json, RecordingFiles, SampleStep, Seed, check_output, names_of
from probdmp.cli.output import print_json, print_line
from probdmp.cli.progress import progress
from probdmp.cli.recordings import read_files

if TYPE_CHECKING:
    from probdmp.demonstrations import Demonstration
    from probdmp.evaluation import Evaluation, Experiment, Judge

__all__ = ["Faults", "Test", "Train", "evaluate", "evaluation_of", "faults_of", "write_evaluation"]

Train = Annotated[int, typer.Option(metavar="N", help="Demonstrations per class that teach the primitive.")]
FAULT_HELP = """What is injected, with commas between, or all. Failures: hold (blocked), hold_release (for a while), slow, push
(aside and back), drift, wrong_goal, wrong_class. Benign: dropout, jitter. Sensor faults: stuck_sensor, spikes. push:0.4, and so
drift and wrong_goal, go astray by 0.4 of the range. With --channels: lift, press (press:0.4), wrong_channel."""
WHY = {
    "--configuration": "The calibrated detector has one way to make primitives.",
    "--false-alarm-rate": "The paper's rule takes no rate of false alarms.",
    "--coupling": "The weights of the paper's primitives are independent.",
}
"""By option of one detector: why the other refuses it."""
Test = Annotated[int, typer.Option(metavar="N", help="Other demonstrations per class that are judged.")]
Faults = Annotated[str, typer.Option("--fault", metavar="NAMES", help=FAULT_HELP)]


def evaluate(
    files: RecordingFiles,
    columns: Columns = None,
    dt: SampleStep = None,
    train: Train = 10,
    test: Test = 10,
    seed: Seed = 0,
    seeds: Annotated[int, typer.Option(metavar="N", help="Splits, with the seeds S, S + 1, …; figures are pooled.")] = 1,
    detector: Annotated[
        str,
        typer.Option(
            metavar="NAME", help="calibrated: for a rate of false alarms; paper: the paper's rule, in all its readings."
        ),
    ] = "calibrated",
    false_alarm_rate: FalseAlarmRate = None,
    fault: Faults = "hold",
    task: Annotated[
        str,
        typer.Option(metavar="NAME", help="known: start, goal and duration are commanded; nominal: only the start is."),
    ] = "known",
    channels: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES", help="Of calibrated: sensor channels to learn and watch with the movement, as pen_force."
        ),
    ] = None,
    coupling: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Of calibrated: whether signals vary together: full (the default), none or auto."),
    ] = None,
    configuration: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Of paper: how primitives are made. published (the default) or default: the library's."
        ),
    ] = None,
    report: Annotated[
        Path | None, typer.Option("--report", metavar="FILE.html", help="Write a page with tables and figures.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Measure false alarms and detected failures, as the paper does.

    For every label: learn from some demonstrations, judge others as recorded and with a fault that begins at a random moment
    in 30 to 70 % of the movement. Rates come with 95 % intervals, exact for one split and by bootstrap over classes for
    several; latencies are fractions of the duration.

    With --json, operating curves too; probdmp plot and probdmp report make pictures and a page of that document.
    """
    check_output(report, ".html")
    with usage():
        experiment = _experiment(
            detector,
            false_alarm_rate,
            configuration,
            coupling,
            {
                "train": train,
                "test": test,
                "seed": seed,
                "seeds": seeds,
                "task": task,
                "faults": faults_of(fault, channels is not None),
                "channels": tuple(names_of(channels) or ()),
            },
        )
    if report is not None:
        from probdmp.plotting.style import require_matplotlib

        require_matplotlib()
    demonstrations = read_files(files, columns=names_of(columns), dt=dt)
    result = evaluation_of(demonstrations, experiment)
    given = [*map(str, files), *_given("--columns", columns), *_given("--dt", dt), *_given("--channels", channels)]
    command = _command([*given, *_given("--coupling", coupling)], experiment, configuration)
    if as_json:
        print_json(result.as_dict(command))
    else:
        print_evaluation(result)
    if report is not None:
        write_evaluation(report, result, demonstrations, command)
        if not as_json:
            print_line(f"Report: {report}")


def _experiment(
    detector: str,
    false_alarm_rate: float | None,
    configuration: str | None,
    coupling: str | None,
    given: Mapping[str, Any],
) -> "Experiment":
    """What was asked for; options of the other detector are refused."""
    from probdmp.checks import check_choice
    from probdmp.dmp import PUBLISHED, Configuration
    from probdmp.evaluation import DETECTORS, Experiment

    check_choice(detector, "detector", DETECTORS)
    others: dict[str, dict[str, object]] = {
        "calibrated": {"--configuration": configuration},
        "paper": {"--false-alarm-rate": false_alarm_rate, "--coupling": coupling},
    }
    for option, value in others[detector].items():
        if value is not None:
            raise UsageError(f"{option} with the other detector only", f"it with --detector {detector}", WHY[option])
    chosen = None if coupling is None else Configuration(weight_uncertainty="joint", coupling=coupling)
    if configuration is not None:
        configurations = {"published": PUBLISHED, "default": Configuration()}
        chosen = configurations[check_choice(configuration, "configuration", configurations)]
    rate = DEFAULT_RATE if false_alarm_rate is None else false_alarm_rate
    return Experiment(**given, detector=detector, configuration=chosen, false_alarm_rate=rate, traces=True)


def evaluation_of(
    demonstrations: Sequence["Demonstration"], experiment: "Experiment", judges: "Mapping[str, Judge] | None" = None
) -> "Evaluation":
    """Run an experiment with a progress bar; the judges are those of its detector unless given."""
    from probdmp.evaluation import DETECTORS, evaluate
    from probdmp.evaluation.judges import STAGES

    chosen = DETECTORS[experiment.detector] if judges is None else judges
    n_classes = len({demonstration.label for demonstration in demonstrations})
    with progress("Evaluating", n_classes * experiment.seeds * sum(STAGES.get(name, 1) for name in chosen)) as done:
        return evaluate(demonstrations, experiment, chosen, on_class=done)


def write_evaluation(path: Path, result: "Evaluation", demonstrations: Sequence["Demonstration"], command: str) -> None:
    """Write the report.

    Raises
    ------
    MissingExtraError
        If what draws it is not installed.
    """
    from probdmp.evaluation import example_of
    from probdmp.io import write_atomically
    from probdmp.plotting.evaluation_report import evaluation_page

    write_atomically(path, evaluation_page(result.record(command), example_of(result, demonstrations)).encode())


def _given(option: str, value: object) -> list[str]:
    return [] if value is None else [option, str(value)]


def _command(given: Sequence[str], experiment: "Experiment", configuration: str | None) -> str:
    """What to type to get the same figures; `given` says on which recordings."""
    words = ["probdmp", "evaluate", *given]
    for name in ("train", "test", "seed", "seeds", "detector", "task"):
        words += [f"--{name}", str(getattr(experiment, name))]
    words += ["--fault", ",".join(experiment.faults)]
    if experiment.detector == "calibrated":
        words += ["--false-alarm-rate", f"{experiment.false_alarm_rate:g}"]
    return join([*words, *_given("--configuration", configuration)])


def faults_of(text: str, has_channels: bool = False) -> tuple[str, ...]:
    """What `--fault` names, each once."""
    from probdmp.demonstrations import CHANNEL_FAULTS, FAULTS

    every = [*FAULTS, *(CHANNEL_FAULTS if has_channels else ())]
    named = [every if name == "all" else [name] for name in names_of(text) or ()]
    return tuple(dict.fromkeys(name for names in named for name in names))
