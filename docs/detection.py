"""Measures the calibrated detector on real recordings and writes the tables of docs/monitoring.md: `make detection`.

The recordings are found through the environment variable PROBDMP_RECORDINGS, as in the tests. Every split runs in a process of
its own, two at a time; all of it takes about a quarter of an hour. To try it out, without writing:

    python docs/detection.py --seeds 1 --classes 4 --dry
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # two processes, two cores

import re
import time
import tracemalloc
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np

from probdmp import Demonstration, FailureDetector, ProbabilisticDMP, read_demonstrations, synthetic_letters
from probdmp.detection import evidence, path_model, trajectory_family, trajectory_model, trajectory_statistics
from probdmp.evaluation import (
    Assessment,
    Evaluation,
    Experiment,
    FaultSummary,
    Rate,
    RealizedRate,
    Summary,
    at_level,
    evaluate,
    realized_rates,
    summarize,
)

PAGE = Path(__file__).parent / "monitoring.md"
RECORDINGS = Path(os.environ.get("PROBDMP_RECORDINGS", "."))
MOVEMENTS = ("hold", "push:0.25", "push:0.4", "wrong_goal", "wrong_class", "slow")
BENIGN = ("dropout", "jitter")
WORKERS = 2
WORST_AT = 0.05
"""Rate of false alarms at which the worst class is reported; lower ones have too few alarms to tell classes apart."""


class Recordings(NamedTuple):
    """A file, and how many demonstrations of each class are used."""

    file: str
    train: int
    test: int
    faults: tuple[str, ...] = MOVEMENTS + BENIGN


DATA = {
    "UCI letters": Recordings("uci_letters/letters.npz", 10, 10),
    "Calinon letters": Recordings("calinon_letters/letters.npz", 5, 5),
    "CLMC reaching": Recordings("clmc_reach/reach.npz", 40, 57, tuple(f for f in MOVEMENTS + BENIGN if f != "wrong_class")),
}


class Job(NamedTuple):
    """One split, judged by the detector or by what is left of it without an ingredient."""

    data: str
    task: str
    seed: int
    without: str = ""
    classes: int | None = None


# --- what the detector is without one of its ingredients --------------------------------------------------------------


def no_channels(prefix: str) -> None:
    """Channels that never have evidence."""
    evidence = trajectory_model.TrajectoryModel.evidence
    muted = [c for c, name in enumerate(trajectory_model.MOVEMENT_CHANNELS) if name.startswith(prefix)]
    assert muted, prefix

    def without(self, *arguments):  # type: ignore[no-untyped-def]
        found = evidence(self, *arguments)
        found[muted] = np.nan
        return found

    trajectory_model.TrajectoryModel.evidence = without


def no_self_normalisation() -> None:
    """Displacements are not compared with those of the same execution before."""
    assert callable(trajectory_model.make_relative)
    trajectory_model.make_relative = lambda squares: None


def no_shifts() -> None:
    """An execution may not be ahead or behind."""
    unshifted = np.zeros(1, dtype=int)
    for holder, name in ((trajectory_statistics, "DISPLACEMENT_SHIFTS"), *((kind, "shifts") for kind in evidence.EVIDENCE)):
        assert len(getattr(holder, name)) > 1
        setattr(holder, name, unshifted)


def no_goal() -> None:
    """The goal that is told is not used; the duration is."""

    def ignoring(primitive, profile, knows_goal):  # type: ignore[no-untyped-def]
        return path_model.path_model(primitive, replace(profile, tempo_std=np.zeros(())) if knows_goal else profile, False)

    assert trajectory_family.path_model is path_model.path_model
    trajectory_family.path_model = ignoring


def in_sample() -> None:
    """Every demonstration is judged by what it has taught."""
    trajectory_family.TrajectoryFamily.left_out_maxima = trajectory_family.TrajectoryFamily.maxima


ABLATIONS: Mapping[str, Callable[[], None]] = {
    "standstill channels": lambda: no_channels("standstill"),
    "pace channel": lambda: no_channels("pace"),
    "displacement channel": lambda: no_channels("displacement"),
    "position channel": lambda: no_channels("position"),
    "self-normalisation of displacements": no_self_normalisation,
    "shifts of tempo": no_shifts,
    "conditioning on the goal": no_goal,
    "leaving out (judged in-sample)": in_sample,
}
"""What is taken away, by its name; only ever in a process of its own."""
ABLATED = {
    name: DATA[name]._replace(faults=("hold", "push:0.25", "wrong_goal", "slow")) for name in ("UCI letters", "Calinon letters")
}


# --- running ----------------------------------------------------------------------------------------------------------


def experiment_of(job: Job) -> Experiment:
    _, train, test, faults = ABLATED[job.data] if job.without else DATA[job.data]
    chosen = faults if job.task == "known" else ("hold",)
    return Experiment(train, test, job.seed, "calibrated", job.task, chosen, traces=not job.without)


def run(job: Job) -> Assessment:
    """One split, in this process."""
    began = time.perf_counter()
    if job.without in ABLATIONS:
        ABLATIONS[job.without]()
    recordings = read_demonstrations(RECORDINGS / DATA[job.data].file)
    labels = sorted({d.label for d in recordings})[: job.classes]
    evaluation = evaluate([d for d in recordings if d.label in labels], experiment_of(job))
    print(*job[:4], f"{time.perf_counter() - began:.0f} s", flush=True)
    return evaluation.by_seed[job.seed]["calibrated"]


def run_all(jobs: Sequence[Job]) -> dict[Job, Assessment]:
    with ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:
        return dict(zip(jobs, pool.map(run, jobs), strict=True))


class Result(NamedTuple):
    """A data set under one task, all seeds together."""

    evaluation: Evaluation
    summary: Summary
    realized: list[RealizedRate]

    @property
    def assessments(self) -> list[Assessment]:
        return [split["calibrated"] for split in self.evaluation.by_seed.values()]


def pooled(found: Mapping[Job, Assessment], data: str, task: str, without: str = "") -> Result:
    chosen = {job.seed: a for job, a in found.items() if (job.data, job.task, job.without) == (data, task, without)}
    experiment = replace(experiment_of(Job(data, task, 0, without)), seeds=len(chosen))
    evaluation = Evaluation(experiment, {seed: {"calibrated": assessment} for seed, assessment in chosen.items()})
    realized = [] if without else realized_rates(list(chosen.values()))
    return Result(evaluation, evaluation.summaries()["calibrated"], realized)


# --- tables -----------------------------------------------------------------------------------------------------------


def in_percent(rate: Rate | None) -> str:
    return "–" if rate is None else rate.in_percent


def rows(table: Sequence[Sequence[str]]) -> Iterator[str]:
    for i, row in enumerate(table):
        yield f"| {' | '.join(row)} |"
        if i == 0:
            yield "|" + "---|" * len(row)


def figures_table(results: Mapping[tuple[str, str], Result]) -> Iterator[str]:
    def cells(name: str, text: Callable[[FaultSummary], str]) -> list[str]:
        figures = [r.summary.faults.get(name) for r in results.values()]
        return ["–" if f is None else text(f) for f in figures]

    heads = [f"{data}, {task}" for data, task in results]
    sizes = [f"{r.summary.false_alarms.n}" for r in results.values()]
    table = [["%, of n executions", *heads], ["n", *sizes]]
    table.append(["false alarms", *(r.summary.false_alarms.in_percent for r in results.values())])
    for fault in BENIGN:
        table.append([f"{fault}: false alarms", *cells(fault, lambda f: in_percent(f.false_alarms))])
    for fault in MOVEMENTS:
        table.append([f"{fault}: detected", *cells(fault, lambda f: in_percent(f.detected))])
        if fault == "hold":
            table.append(["hold: ever", *cells(fault, lambda f: f.ever.in_percent)])
        if fault in ("hold", "slow"):
            told = "called held" if fault == "hold" else "not called held"
            table.append([f"{fault}: {told}, of those", *cells(fault, lambda f: in_percent(f.told_apart))])
        table.append([f"{fault}: latency, median / p95", *cells(fault, lambda f: f.latency_in_percent)])
    return rows(table)


def realized_table(results: Mapping[tuple[str, str], Result]) -> Iterator[str]:
    rates = next(iter(results.values())).realized
    table = [["recordings, task", "n", *(f"α = {100 * one.nominal:g} %" for one in rates), f"worst at {100 * WORST_AT:g} %"]]
    for (data, task), result in results.items():
        n = result.assessments[0].calibrations[0].n
        cells = [f"{100 * one.realized.rate:.1f} [{100 * one.low:.1f}–{100 * one.high:.1f}]" for one in result.realized]
        table.append([f"{data}, {task}", str(n), *cells, worst_text(result)])
    return rows(table)


def worst_text(result: Result) -> str:
    """The class with most false alarms, and in how many splits the calibration had flagged it."""
    outcomes, flagged = [], []
    for assessment in result.assessments:
        (facts,) = assessment.calibrations
        outcomes += at_level(assessment.outcomes, facts.thresholds[WORST_AT] / facts.threshold)
        flagged.append(facts.suspects_at[WORST_AT])
    worst = summarize(outcomes).worst_class
    if worst is None or len({o.label for o in outcomes}) == 1:
        return "–"
    times = sum(worst.label in suspects for suspects in flagged)
    return f"“{worst.label}” {100 * worst.rate:.0f} ({worst.count}/{worst.n}), flagged in {times} of {len(flagged)}"


def ablation_table(found: Mapping[Job, Assessment]) -> Iterator[str]:
    names = ["", *ABLATIONS]
    table = [["without", *(f"{data}: {what}" for data in ABLATED for what in ("false alarms", *ABLATED[data].faults))]]
    for name in names:
        cells = []
        for data in ABLATED:
            summary = pooled(found, data, "known", name or "nothing").summary
            faults = summary.faults
            cells += [f"{100 * summary.false_alarms.rate:.1f}", f"{ever(faults['hold'])}, {faults['hold'].latency_in_percent}"]
            cells += [ever(faults[fault]) for fault in ("push:0.25", "wrong_goal", "slow")]
        table.append([name or "– (all of it)", *cells])
    return rows(table)


def ever(figures: FaultSummary) -> str:
    return f"{100 * figures.ever.rate:.1f}"


def cost_table() -> Iterator[str]:
    """On built-in letters, alone and side by side as more degrees of freedom."""
    table = [
        [
            "degrees of freedom",
            "step without detector, µs",
            "with, µs (99th percentile)",
            "memory per primitive, MB",
            "learn and calibrate, s",
        ]
    ]
    for n_letters in (1, 2, 3):
        letters = [synthetic_letters(11, seed=k, letters="a") for k in range(n_letters)]
        demos = [side_by_side(same) for same in zip(*letters, strict=True)]
        began = time.perf_counter()
        p = ProbabilisticDMP(weight_model="hierarchical", weight_uncertainty="joint").fit(demos[:10])
        detector = FailureDetector().fit(p, demos[:10])
        seconds = time.perf_counter() - began
        tracemalloc.start()
        step_times(p, demos[10], detector)
        memory = tracemalloc.get_traced_memory()[0] / 1e6
        tracemalloc.stop()
        bare, watched = step_times(p, demos[10], None), step_times(p, demos[10], detector)
        cells = [
            f"{np.median(bare):.0f}",
            f"{np.median(watched):.0f} ({np.quantile(watched, 0.99):.0f})",
            f"{memory:.0f}",
            f"{seconds:.1f}",
        ]
        table.append([str(2 * n_letters), *cells])
    return rows(table)


def side_by_side(same: Sequence[Demonstration]) -> Demonstration:
    length = min(d.n_samples for d in same)
    return Demonstration(np.hstack([d.positions[:length] for d in same]), same[0].dt)


def step_times(p: ProbabilisticDMP, execution: Demonstration, detector: FailureDetector | None) -> list[float]:
    """Microseconds of every step of ten executions."""
    times = []
    for _ in range(10):
        run = p.execute(
            start=execution.positions[0], goal=execution.positions[-1], duration=execution.duration, detector=detector
        )
        for row in execution.positions:
            began = time.perf_counter()
            run.step(row)
            times.append(1e6 * (time.perf_counter() - began))
    return times


# --- the page ---------------------------------------------------------------------------------------------------------


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the calibrated detector.")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--classes", type=int, default=None, help="only the first few of each file")
    parser.add_argument("--dry", action="store_true", help="print the tables and leave the page as it is")
    arguments = parser.parse_args()
    jobs = [
        Job(d, task, seed, "", arguments.classes)
        for d in DATA
        for task in ("known", "nominal")
        for seed in range(arguments.seeds)
    ]
    jobs += [Job(data, "known", 0, name, arguments.classes) for name in ("nothing", *ABLATIONS) for data in ABLATED]
    found = run_all(jobs)
    results = {(data, task): pooled(found, data, task) for data in DATA for task in ("known", "nominal")}
    tables = {
        "figures": figures_table(results),
        "realized": realized_table(results),
        "ablation": ablation_table(found),
        "cost": cost_table(),
    }
    page = PAGE.read_text()
    for name, lines in tables.items():
        body = "\n".join(lines)
        print(f"\n{name}\n{body}", flush=True)
        pattern = rf"(<!-- {name}: written by make detection -->\n).*?(<!-- end -->)"
        page, count = re.subn(pattern, lambda match, body=body: f"{match[1]}{body}\n{match[2]}", page, flags=re.S)
        assert count == 1, name
    if not arguments.dry:
        PAGE.write_text(page)


if __name__ == "__main__":
    main()
