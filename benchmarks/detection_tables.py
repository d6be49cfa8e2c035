"""Writes benchmarks/detection.md: failure detectors against one another, at equal false alarms. `make bench-detection`.

The recordings are found through the environment variable PROBDMP_RECORDINGS, as in the tests. Every split runs in a process of
its own, two at a time. To try it out, without writing:

    python benchmarks/detection_tables.py --seeds 1 --classes 4 --dry
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # two processes, two cores

import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

from failure_detection import FAULTS, judges, summaries_at
from probdmp import read_demonstrations
from probdmp.evaluation import Assessment, Evaluation, Experiment, Rate, Summary, evaluate

PAGE = Path(__file__).parent / "detection.md"
RECORDINGS = Path(os.environ.get("PROBDMP_RECORDINGS", "."))
WORKERS = 2
ALPHA = 0.01
OWN = ("calibrated", "paper: predictive, per step")
"""This library's detectors that take part; docs/paper.md has the others."""
PAGE_HEAD = f"""# Failure detectors at equal false alarms

Written by `make bench-detection`, two splits each. [README.md](README.md) says who takes part and how all are kept comparable.
The threshold of each detector is the lowest at which at most {100 * ALPHA:g} % of the undisturbed executions raise an
alarm, whatever its calibration; *detected* is a first alarm at or after the onset, in % of the executions, with a 95 %
interval by bootstrap over classes. The best of each column is bold. Latency: of hold, median / 95th percentile, % of the
duration. Alarms about a sensor do not depend on the threshold, so the calibrated detector's false alarms may stay above the
rate, where recordings repeat numbers.
"""


class Recordings(NamedTuple):
    """A file, and how many demonstrations of each class are used."""

    file: str
    train: int
    test: int


DATA = {
    "UCI letters": Recordings("uci_letters/letters.npz", 10, 10),
    "Calinon letters": Recordings("calinon_letters/letters.npz", 5, 5),
}


class Job(NamedTuple):
    """One split."""

    data: str
    task: str
    seed: int
    classes: int | None


def experiment_of(job: Job) -> Experiment:
    _, train, test = DATA[job.data]
    # Without a told goal its being wrong, and slowness, are legal as far as they were demonstrated.
    faults = FAULTS if job.task == "known" else ("hold", "wrong_class")
    return Experiment(train, test, job.seed, "compared", job.task, faults, traces=True)


def run(job: Job) -> Mapping[str, Assessment]:
    """One split, in this process."""
    began = time.perf_counter()
    recordings = read_demonstrations(RECORDINGS / DATA[job.data].file)
    labels = sorted({d.label for d in recordings})[: job.classes]
    compared = {name: judge for name, judge in judges(ALPHA, 1).items() if ":" not in name or name in OWN}
    evaluation = evaluate([d for d in recordings if d.label in labels], experiment_of(job), compared)
    print(*job[:3], f"{time.perf_counter() - began:.0f} s", flush=True)
    return evaluation.by_seed[job.seed]


def table(summaries: Mapping[str, Summary], faults: Sequence[str]) -> Iterator[str]:
    rates = {name: [summary.faults[fault].detected for fault in faults] for name, summary in summaries.items()}
    best = [max(rate.rate for rate in column if rate is not None) for column in zip(*rates.values(), strict=True)]
    yield f"| detector | false alarms | {' | '.join(faults)} | latency of hold |"
    yield "|" + "---|" * (len(faults) + 3)
    for name, summary in summaries.items():
        detected = [rate_text(*pair) for pair in zip(rates[name], best, strict=True)]
        cells = [name, summary.false_alarms.in_percent, *detected, summary.faults["hold"].latency_in_percent]
        yield f"| {' | '.join(cells)} |"


def rate_text(rate: Rate | None, best: float) -> str:
    if rate is None:
        return "–"
    point, rest = rate.in_percent.split(maxsplit=1)
    return f"**{point}** {rest}" if rate.rate == best else rate.in_percent


def main() -> None:
    parser = argparse.ArgumentParser(description="Compare failure detectors.")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--classes", type=int, default=None, help="only the first few of each file")
    parser.add_argument("--dry", action="store_true", help="print the tables and leave the page as it is")
    given = parser.parse_args()
    settings = [(data, task) for data in DATA for task in ("known", "nominal")]
    jobs = [Job(*setting, seed, given.classes) for setting in settings for seed in range(given.seeds)]
    with ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:
        found = dict(zip(jobs, pool.map(run, jobs), strict=True))
    lines = [PAGE_HEAD]
    for data, task in settings:
        splits = {job.seed: assessments for job, assessments in found.items() if (job.data, job.task) == (data, task)}
        experiment = replace(experiment_of(Job(data, task, 0, None)), seeds=given.seeds)
        summaries = summaries_at(Evaluation(experiment, splits), ALPHA)
        n = next(iter(summaries.values())).false_alarms.n
        lines += [f"## {data}, task {task}: {n} executions\n", *table(summaries, experiment.faults), ""]
    text = "\n".join(lines)
    print(text)
    if not given.dry:
        PAGE.write_text(text)


if __name__ == "__main__":
    main()
