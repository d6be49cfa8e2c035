"""Runs every experiment that docs/paper.md reports and writes its tables: `make results`.

The recordings are found through the environment variable PROBDMP_RECORDINGS, as in the tests. Takes about ten minutes.
"""

import os
import re
from collections.abc import Iterator
from pathlib import Path

from probdmp import Demonstration, read_demonstrations, synthetic_letters
from probdmp.dmp import PUBLISHED, Configuration
from probdmp.evaluation import READINGS, Evaluation, Experiment, Summary, evaluate

PAGE = Path(__file__).parent / "paper.md"
RECORDINGS = Path(os.environ["PROBDMP_RECORDINGS"])
CONFIGURATIONS = {"published": PUBLISHED, "default": Configuration()}
TASKS = ("known", "nominal")
SEEDS = range(5)
DATA = {
    "Built-in letters": (None, 10, 10),
    "UCI letters": ("uci_letters/letters.npz", 10, 10),
    "Calinon letters": ("calinon_letters/letters.npz", 5, 5),
    "CLMC reaching": ("clmc_reach/reach.npz", 40, 57),
}
"""By name: file, demonstrations per class for training and for testing."""


def demonstrations_of(name: str) -> list[Demonstration]:
    file, train, test = DATA[name]
    return synthetic_letters(train + test) if file is None else read_demonstrations(RECORDINGS / file)


def run(name: str, configuration: str, task: str, seed: int = 0) -> Evaluation:
    print(name, configuration, task, seed, flush=True)
    _, train, test = DATA[name]
    experiment = Experiment(train, test, seed, task=task, configuration=CONFIGURATIONS[configuration])
    return evaluate(demonstrations_of(name), experiment)


def title(name: str) -> str:
    _, train, test = DATA[name]
    return f"{name}, {len({d.label for d in demonstrations_of(name)})} × ({train} + {test})"


def glance(results: dict[tuple[str, str, str], dict[str, Summary]]) -> Iterator[str]:
    yield "| false alarms / ever / detected, % | " + " | ".join(reading.name for reading in READINGS) + " |"
    yield "|---|" + "---|" * len(READINGS)
    yield "| the paper, 22 × (10 + 10), reading not said | 0.9 / 100 / – |" + " |" * (len(READINGS) - 1)
    for name in DATA:
        cells = []
        for summary in results[name, "published", "known"].values():
            rates = (summary.false_alarms, summary.faults["hold"].ever, summary.faults["hold"].detected)
            cells.append(" / ".join(f"{100 * rate.rate:.1f}" for rate in rates if rate is not None))
        yield f"| {title(name)} | " + " | ".join(cells) + " |"


def seeds(evaluations: list[dict[str, Summary]]) -> Iterator[str]:
    yield "| reading | false alarms | detected | ever |\n|---|---|---|---|"
    for reading in READINGS:
        summaries = [evaluation[reading.name] for evaluation in evaluations]
        columns = (
            [s.false_alarms for s in summaries],
            [s.faults["hold"].detected for s in summaries],
            [s.faults["hold"].ever for s in summaries],
        )
        cells = []
        for rates in columns:
            known = [rate for rate in rates if rate is not None]
            share = 100 * sum(rate.count for rate in known) / sum(rate.n for rate in known)
            cells.append(", ".join(str(rate.count) for rate in known) + f" ({share:.1f} %)")
        yield f"| {reading.name} | " + " | ".join(cells) + " |"


def full(results: dict[tuple[str, str, str], dict[str, Summary]]) -> Iterator[str]:
    for name in DATA:
        n = next(iter(results[name, "published", "known"].values())).false_alarms.n
        yield f"**{title(name)}**: {n} undisturbed and {n} blocked executions. Counts, then % (95 % interval); latency in %"
        yield "of the duration.\n"
        yield "| configuration | task | reading | false alarms | detected | ever | latency |\n|---|---|---|---|---|---|---|"
        for configuration in CONFIGURATIONS:
            for task in TASKS:
                for reading, summary in results[name, configuration, task].items():
                    hold = summary.faults["hold"]
                    cells = [
                        f"{rate.count}, {rate.in_percent}"
                        for rate in (summary.false_alarms, hold.detected, hold.ever)
                        if rate is not None
                    ]
                    latency = "–"
                    if hold.latency_median is not None and hold.latency_p95 is not None:
                        latency = f"{100 * hold.latency_median:.0f} / {100 * hold.latency_p95:.0f}"
                    yield f"| {configuration} | {task} | {reading} | " + " | ".join([*cells, latency]) + " |"
        yield ""


def main() -> None:
    results = {
        (name, configuration, task): run(name, configuration, task).summaries()
        for name in DATA
        for configuration in CONFIGURATIONS
        for task in TASKS
    }
    over_seeds = [results["UCI letters", "published", "known"]]
    over_seeds += [run("UCI letters", "published", "known", seed).summaries() for seed in SEEDS[1:]]
    page = PAGE.read_text()
    for region, lines in (("glance", glance(results)), ("seeds", seeds(over_seeds)), ("full", full(results))):
        body = "\n".join(lines).rstrip()
        pattern = rf"(<!-- {region}: written by make results -->\n).*?(\n<!-- end -->)"
        page, count = re.subn(pattern, rf"\g<1>{body}\g<2>", page, flags=re.S)
        assert count == 1, region
    PAGE.write_text(page)


if __name__ == "__main__":
    main()
