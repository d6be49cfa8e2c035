"""Which movement is it? Ask a library which primitive makes an execution likeliest, and what a detector suggests.

Every primitive filters every execution; the log-likelihoods are compared. Nothing was trained to tell letters apart. A
detector that knows the library names the better primitive when a wrong movement is executed.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from probdmp import FailureDetector, PrimitiveLibrary, synthetic_letters
from probdmp.plotting.style import figure_style, series

LETTERS = "acdgo"
TAUGHT, TESTED = 10, 10


def main(figure_path: Path) -> None:
    demonstrations = {label: synthetic_letters(TAUGHT + TESTED, letters=label) for label in LETTERS}
    taught = {label: members[:TAUGHT] for label, members in demonstrations.items()}
    executions = [execution for members in demonstrations.values() for execution in members[TAUGHT:]]
    library = PrimitiveLibrary.fit(taught)

    scores = np.array([dmp.score_samples(executions) for dmp in library.values()])  # (letters, executions), nats
    counts = np.zeros((len(LETTERS), len(LETTERS)), dtype=int)
    for execution, best in zip(executions, scores.argmax(axis=0), strict=True):
        counts[LETTERS.index(execution.label), best] += 1
    print(f"{np.trace(counts)} of {len(executions)} executions are likeliest under their own letter")

    wrong = demonstrations["d"][TAUGHT]
    detector = FailureDetector(false_alarm_rate=0.05).fit(library, taught)
    run = library["a"].execute(start=wrong.positions[0], detector=detector)
    for position in wrong.positions:
        run.step(position)
    print(f"asked for 'a', written 'd': {run.verdict}")

    with figure_style():
        figure, (matrix, growing) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained", width_ratios=(1, 1.4))
        matrix.imshow(counts, cmap="Blues", vmax=3 * TESTED)
        for (row, column), count in np.ndenumerate(counts):
            if count:
                matrix.text(column, row, count, ha="center", va="center", fontsize=8)
        matrix.set_xticks(range(len(LETTERS)), LETTERS)
        matrix.set_yticks(range(len(LETTERS)), LETTERS)
        matrix.set(xlabel="Likeliest", ylabel="Written", title=f"{TESTED} executions of each")
        own = library["d"].track(wrong).log_likelihoods.cumsum()
        for k, label in enumerate("adgo"):
            behind = library[label].track(wrong).log_likelihoods.cumsum() - own
            growing.plot(wrong.times, behind, label=f"as {label}", **series(k))
        growing.set_yscale("symlog", linthresh=10)
        growing.set(xlabel="Time [s]", ylabel="Log-likelihood, relative to d [nats]", title="While a d is written")
        growing.legend(loc="lower left")
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
