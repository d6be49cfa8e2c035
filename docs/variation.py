"""Measures the models of variation on executions that were left out and writes docs/variation.md: `make variation`.

The recordings are found through the environment variable PROBDMP_RECORDINGS, as in the tests. Takes about ten minutes.
"""

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from probdmp import Demonstration, Primitive, ProbabilisticDMP, Task, read_demonstrations
from probdmp.dmp import task_for
from probdmp.execution import filter_recordings, roll_out
from probdmp.execution.trajectory import HALF_BAND

PAGE = Path(__file__).parent / "variation.md"
RECORDINGS = Path(os.environ.get("PROBDMP_RECORDINGS", "."))
DATA = {
    "UCI letters": ("uci_letters/letters.npz", 10),
    "Calinon letters": ("calinon_letters/letters.npz", 10),
    "CLMC reaching": ("clmc_reach/reach.npz", 20),
}
"""By name: file, and how many recordings of each class are used, the first ones."""
FOLDS = 5
JOINT = {"weight_model": "hierarchical", "weight_uncertainty": "joint"}
MODELS = {
    "pooled, independent": {"weight_model": "pooled", "weight_uncertainty": "independent"},
    "hierarchical, joint": JOINT,
    "– without deviations": JOINT | {"forcing_noise": "posterior"},
    "– goal conditioned on": JOINT | {"goal_handling": "condition"},
    "– goal as attractor": JOINT | {"goal_handling": "attractor"},
    "– coupling: none": JOINT | {"coupling": "none"},
    "– coupling: auto": JOINT | {"coupling": "auto"},
}
FEW = 20
"""Points of an execution at which it is seen, in the second column."""


class Score(NamedTuple):
    """What one left-out execution says about a model; lengths in units of the range."""

    all_points: float
    """Nats per recorded point."""
    few_points: float
    """Nats per point, of `FEW` evenly spaced."""
    coverage: float
    """Share of the points inside their 95 % band, before the movement begins."""
    error: float
    """Root mean square of execution minus rollout."""


def score(primitive: Primitive, executions: Sequence[Demonstration]) -> list[Score]:
    """Each execution with its start, goal and duration known; the first and last point, which are told, do not count."""
    tasks = [task_for(primitive, d.positions[0], d.positions[-1], d.duration) for d in executions]
    everything = nats(primitive, tasks, [seen_at(d, range(1, d.n_samples - 1)) for d in executions])
    some = [np.unique(np.round(np.linspace(0, d.n_samples - 1, FEW + 2)).astype(int))[1:-1] for d in executions]
    few = nats(primitive, tasks, [seen_at(d, steps) for d, steps in zip(executions, some, strict=True)])
    scores = []
    for task, execution, a, b in zip(tasks, executions, everything, few, strict=True):
        rolled = roll_out(primitive, task, execution.dt)
        errors = (execution.positions - rolled.positions)[1:-1]
        stds = np.sqrt(rolled.position_stds**2 + primitive.observation_variances)[1:-1]
        relative = float(np.sqrt(np.mean((errors / primitive.ranges) ** 2)))
        scores.append(Score(a, b, float(np.mean(np.abs(errors) < HALF_BAND * stds)), relative))
    return scores


def seen_at(execution: Demonstration, steps: Sequence[int]) -> Demonstration:
    positions = np.full_like(execution.positions, np.nan)
    positions[list(steps)] = execution.positions[list(steps)]
    return replace(execution, positions=positions)


def nats(primitive: Primitive, tasks: Sequence[Task], executions: Sequence[Demonstration]) -> list[float]:
    totals = filter_recordings(primitive, tasks, executions).log_likelihoods.sum(axis=(0, -1))
    counts = [np.sum(~np.isnan(d.positions[:, 0])) for d in executions]
    return [float(total / n + np.log(primitive.ranges).sum()) for total, n in zip(totals, counts, strict=True)]


def measure(name: str, folder: Path = RECORDINGS, classes: slice = slice(None)) -> dict[str, list[Score]]:
    """Scores of every model, from five-fold cross-validation within each class."""
    file, most = DATA[name]
    recordings = read_demonstrations(folder / file)
    scores: dict[str, list[Score]] = {model: [] for model in MODELS}
    for label in sorted({d.label for d in recordings})[classes]:
        members = [d for d in recordings if d.label == label][:most]
        for fold in range(FOLDS):
            training = [d for i, d in enumerate(members) if i % FOLDS != fold]
            fitted: dict[str, Primitive] = {}
            for model, settings in MODELS.items():
                kind = settings["weight_model"] + settings.get("forcing_noise", "") + settings.get("coupling", "")
                if kind not in fitted:
                    fitted[kind] = ProbabilisticDMP(**settings).fit(training).primitive_
                handling = settings.get("goal_handling", "blend")
                primitive = replace(fitted[kind], configuration=replace(fitted[kind].configuration, goal_handling=handling))
                scores[model] += score(primitive, members[fold::FOLDS])
    return scores


def table(results: dict[str, dict[str, list[Score]]]) -> Iterator[str]:
    yield f"| recordings | model | nats per point | of {FEW} points | in the 95 % band, % | rms error, % of range |"
    yield "|---|---|---|---|---|---|"
    for name, models in results.items():
        for model, scores in models.items():
            means, errors = np.mean(scores, axis=0), np.std(scores, axis=0) / np.sqrt(len(scores))
            cells = [f"{m:.2f} ± {e:.2f}" for m, e in zip(means[:2], errors[:2], strict=True)]
            cells += [f"{100 * m:.1f} ± {100 * e:.1f}" for m, e in zip(means[2:], errors[2:], strict=True)]
            yield f"| {name}, n = {len(scores)} | {model} | " + " | ".join(cells) + " |"


def main() -> None:
    results = {}
    for name in DATA:
        print(name, flush=True)
        results[name] = measure(name)
    body = "\n".join(table(results))
    pattern = r"(<!-- table: written by make variation -->\n).*?(\n<!-- end -->)"
    page, count = re.subn(pattern, rf"\g<1>{body}\g<2>", PAGE.read_text(), flags=re.S)
    assert count == 1
    PAGE.write_text(page)


if __name__ == "__main__":
    main()
