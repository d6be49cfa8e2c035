"""Measures how many basis functions a movement needs and writes docs/how-to/choose-n-basis.md: `make n-basis`."""

import re
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from probdmp import Demonstration, ProbabilisticDMP, Task, synthetic_letters
from probdmp.plotting.style import figure_style, series

PAGE = Path(__file__).parent / "how-to" / "choose-n-basis.md"
PICTURE = Path(__file__).parent / "images" / "n_basis.png"
NUMBERS = (3, 5, 8, 12, 20, 30, 45, 60)
LETTERS = "ceglmsvz"
TAUGHT, JUDGED = 10, 10
FEW = 20
"""Samples of an execution at which it is seen, in the second column."""


def at_few(execution: Demonstration) -> np.ndarray:
    """The execution seen at few moments, evenly spaced; nothing else was measured."""
    seen = np.full(execution.positions.shape, np.nan)
    steps = np.unique(np.round(np.linspace(0, execution.n_samples - 1, FEW + 2)).astype(int))[1:-1]
    seen[steps] = execution.positions[steps]
    return seen


def scores(n_basis: int, letters: list[Demonstration]) -> np.ndarray:
    """(JUDGED, 3) array, a row for each left-out execution: nats per sample, of few, rms error in % of the range."""
    dmp, executions = ProbabilisticDMP(n_basis).fit(letters[:TAUGHT]), letters[TAUGHT:]
    ranges = dmp.primitive_.ranges
    tasks = [Task(d.positions[0], d.positions[-1], d.duration) for d in executions]
    unit = np.log(ranges).sum()  # densities of positions in units of the range
    lengths = np.array([d.n_samples for d in executions])
    everything = dmp.score_samples(executions, tasks=tasks) / lengths + unit
    few = dmp.score_samples([at_few(d) for d in executions], executions[0].dt, tasks) / FEW + unit
    errors = [
        100 * np.sqrt(np.mean(((dmp.rollout(t.start, t.goal, t.duration, d.dt).positions - d.positions) / ranges) ** 2))
        for t, d in zip(tasks, executions, strict=True)
    ]
    return np.column_stack([everything, few, errors])


def main() -> None:
    demonstrations = {label: synthetic_letters(TAUGHT + JUDGED, letters=label) for label in LETTERS}
    table = {n: np.concatenate([scores(n, letters) for letters in demonstrations.values()]) for n in NUMBERS}
    lines = ["| n_basis | nats per sample | of 20 samples | rms error, % of range |", "|---|---|---|---|"]
    for n, rows in table.items():
        cells = zip(rows.mean(axis=0), rows.std(axis=0, ddof=1) / np.sqrt(len(rows)), (2, 2, 1), strict=True)
        lines.append(f"| {n} | " + " | ".join(f"{mean:.{d}f} ± {error:.{d}f}" for mean, error, d in cells) + " |")
    text = PAGE.read_text()
    block = "<!-- table: written by make n-basis -->\n" + "\n".join(lines) + "\n<!-- end -->"
    PAGE.write_text(re.sub(r"<!-- table: written by make n-basis -->.*?<!-- end -->", lambda _: block, text, flags=re.S))
    with figure_style():
        figure, axes = plt.subplots(1, 2, figsize=(9, 3), layout="constrained")
        for column, (ax, title) in enumerate(zip(axes, ("Every sample", "20 samples"), strict=True)):
            for k, (row, letter) in enumerate(zip(range(0, JUDGED * len(LETTERS), JUDGED), LETTERS, strict=True)):
                means = [table[n][row : row + JUDGED, column].mean() for n in NUMBERS]
                ax.plot(NUMBERS, means, linewidth=1, alpha=0.6, label=letter, **series(k))
            ax.plot(NUMBERS, [table[n][:, column].mean() for n in NUMBERS], color="k", linewidth=2.5, label="mean")
            ax.set(xscale="log", xlabel="n_basis", ylabel="Log-likelihood [nats/sample]", title=title)
            ax.set_xticks(NUMBERS, map(str, NUMBERS))
            ax.minorticks_off()
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right center")
        figure.savefig(PICTURE, dpi=150)


if __name__ == "__main__":
    main()
