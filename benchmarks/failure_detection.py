"""Failure detectors against one another, on the same executions: `make bench-detection`.

    python benchmarks/failure_detection.py FILE.npz --train 10 --test 10 --seeds 1 --json

First at the same nominal rate of false alarms, then at the same realized rate: a detector may look good in the first table
because its threshold is too low, or bad because it is too high; the second compares statistics alone.

To add a detector, add a judge to `judges`: any `probdmp.evaluation.Judge` that keeps its traces.
"""

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from baselines.judging import judge_by
from baselines.method import Method
from probdmp import read_demonstrations
from probdmp.evaluation import (
    DETECTORS,
    TASKS,
    Evaluation,
    Experiment,
    FaultSummary,
    Judge,
    Rate,
    Summary,
    at_level,
    evaluate,
    level_realizing,
    summarize,
)

FAULTS = ("hold", "push", "push:0.4", "wrong_goal", "wrong_class", "slow")
REALIZED = (0.01, 0.025, 0.05)
"""Rates of false alarms at which detectors are compared, as fractions."""
CURVE = (0.0, 0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.075, 0.1, 0.15, 0.2)
"""Rates of false alarms of the operating curve, as fractions."""
CONSOLE = Console(width=160)


def baselines() -> dict[str, Callable[[], Method]]:
    """The baselines by name; here, so that the command says what it needs before it asks for the packages."""
    from baselines.hidden_markov import HiddenMarkovLikelihood
    from baselines.isolation_forest import WindowForest
    from baselines.promp import MovementPrimitiveDistance
    from baselines.time_warping import TimeWarpingDistance
    from baselines.z_score import ZScoreBand

    return {
        "z-score band": ZScoreBand,
        "ProMP": MovementPrimitiveDistance,
        "time warping": TimeWarpingDistance,
        "hidden Markov": HiddenMarkovLikelihood,
        "isolation forest": WindowForest,
    }


def judges(alpha: float, jobs: int) -> dict[str, Judge]:
    """All that can be compared, by name: the baselines, and this library's detectors, whose judges calibrate themselves."""
    compared = {name: judge_by(make, alpha, jobs) for name, make in baselines().items()}
    own = {
        name if name == reading else f"{name}: {reading}": judge
        for name, readings in DETECTORS.items()
        for reading, judge in readings.items()
    }
    return {**compared, **own}


def summaries_at(evaluation: Evaluation, rate: float) -> dict[str, Summary]:
    """The figures of each judge at the threshold that realizes a rate of false alarms on the executions as recorded."""
    return {
        name: summarize(at_level(outcomes, level_realizing(outcomes, rate)), len(evaluation.by_seed))
        for name, outcomes in evaluation.outcomes.items()
    }


def document(evaluation: Evaluation, alpha: float) -> dict[str, Any]:
    """All figures, for JSON."""
    experiment = evaluation.experiment
    curves = {rate: summaries_at(evaluation, rate) for rate in CURVE}
    return {
        "train": experiment.train,
        "test": experiment.test,
        "seed": experiment.seed,
        "seeds": experiment.seeds,
        "task": experiment.task,
        "alpha": alpha,
        "nominal": {name: summary.as_dict() for name, summary in evaluation.summaries().items()},
        "realized": {str(rate): _as_dicts(summaries_at(evaluation, rate)) for rate in REALIZED},
        "operating_curves": {
            name: [{"false_alarms": at[name].false_alarms.rate, "detected": _detected(at[name])} for at in curves.values()]
            for name in evaluation.outcomes
        },
    }


def _as_dicts(summaries: Mapping[str, Summary]) -> dict[str, Any]:
    return {name: summary.as_dict() for name, summary in summaries.items()}


def _detected(summary: Summary) -> dict[str, float]:
    return {name: fault.detected.rate for name, fault in summary.faults.items() if fault.detected is not None}


def print_tables(evaluation: Evaluation, alpha: float) -> None:
    """A table at the nominal rate and one for each realized rate."""
    experiment = evaluation.experiment
    last = experiment.seed + experiment.seeds - 1
    seeds = f"seed {last}" if experiment.seeds == 1 else f"seeds {experiment.seed} to {last}"
    CONSOLE.print(
        f"{experiment.train} training and {experiment.test} test demonstrations per class, task {experiment.task}, {seeds}"
    )
    _print_table(f"Calibrated for {100 * alpha:g} % false alarms", evaluation.summaries(), experiment.faults)
    for rate in REALIZED:
        title = f"At most {100 * rate:g} % false alarms realized"
        _print_table(title, summaries_at(evaluation, rate), experiment.faults)
    CONSOLE.print("Detected: first alarm at or after the onset of the fault, %, second lines 95 % intervals.", style="dim")
    CONSOLE.print("Latency: of hold, from onset to alarm, % of the duration, median and 95th percentile.", style="dim")


def _print_table(title: str, summaries: Mapping[str, Summary], faults: Sequence[str]) -> None:
    table = Table(title=title)
    table.add_column("detector")
    with_latency = [column for fault in faults for column in ([fault, "latency"] if fault == "hold" else [fault])]
    for column in ("false alarms", *with_latency):
        table.add_column(column, justify="right")
    for name, summary in summaries.items():
        cells = [_rate(summary.false_alarms)]
        for fault in faults:
            figures = summary.faults[fault]
            cells.append(_rate(figures.detected))
            if fault == "hold":
                cells.append(_latency(figures))
        table.add_row(name, *cells)
    CONSOLE.print(table)


def _rate(rate: Rate | None) -> str:
    return "–" if rate is None else f"{100 * rate.rate:.1f}\n{100 * rate.low:.1f}–{100 * rate.high:.1f}"


def _latency(figures: FaultSummary) -> str:
    if figures.latency_median is None or figures.latency_p95 is None:
        return "–"
    return f"{100 * figures.latency_median:.1f}\np95 {100 * figures.latency_p95:.1f}"


def arguments() -> argparse.Namespace:
    """What the command was given."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("file", help="labelled demonstrations (.npz)")
    parser.add_argument("--train", type=int, default=10, help="demonstrations per class that are learned from")
    parser.add_argument("--test", type=int, default=10, help="other demonstrations per class that are judged")
    parser.add_argument("--seed", type=int, default=0, help="first seed")
    parser.add_argument("--seeds", type=int, default=1, help="number of splits")
    parser.add_argument("--task", choices=TASKS, default="known", help="known: start, goal and duration are commanded")
    parser.add_argument("--alpha", type=float, default=0.01, help="false alarms per execution that thresholds are made for")
    parser.add_argument("--faults", default=",".join(FAULTS), help="with commas between")
    parser.add_argument("--detectors", default="", help="names of those compared, with commas between; all unless given")
    parser.add_argument("--jobs", type=int, default=1, help="classes learned at the same time")
    parser.add_argument("--json", action="store_true", help="print all figures as JSON")
    return parser.parse_args()


def main() -> None:
    """Run the comparison."""
    given = arguments()
    compared = judges(given.alpha, given.jobs)
    if given.detectors:
        compared = {name: judge for name, judge in compared.items() if name in given.detectors.split(",")}
    experiment = Experiment(
        given.train,
        given.test,
        given.seed,
        detector="compared",
        task=given.task,
        faults=tuple(given.faults.split(",")),
        seeds=given.seeds,
        traces=True,
    )
    evaluation = evaluate(read_demonstrations(given.file), experiment, compared)
    if given.json:
        print(json.dumps(document(evaluation, given.alpha), indent=2, ensure_ascii=False))
    else:
        print_tables(evaluation, given.alpha)


if __name__ == "__main__":
    main()
