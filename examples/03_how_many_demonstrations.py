"""What more demonstrations buy: bands that are narrower and still hold new executions.

Learn letters from 1 to 20 demonstrations and see how wide the 95 % band is, and how much of other executions lies in it.
With a single demonstration, how executions vary comes from a prior alone.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from probdmp import Demonstration, ProbabilisticDMP, synthetic_letters
from probdmp.plotting.style import MEAN, band, figure_style

NUMBERS = (1, 2, 3, 5, 10, 20)


def width_and_share(dmp: ProbabilisticDMP, execution: Demonstration) -> tuple[float, float]:
    """Half of the mean width of its plan's band, mm, and the share of the execution in it; its task is told."""
    path = execution.positions
    plan = dmp.rollout(start=path[0], goal=path[-1], duration=execution.duration)
    half = 1.96 * np.sqrt(plan.position_stds**2 + dmp.primitive_.observation_variances)
    return float(half.mean()), float((np.abs(path - plan.positions) <= half)[1:-1].mean())


def main(figure_path: Path) -> None:
    bands = np.empty((3, len(NUMBERS), 2))
    with figure_style():
        figure, axes = plt.subplots(1, 4, figsize=(11, 2.8), layout="constrained")
        for row, letter in enumerate("ceu"):
            letters = synthetic_letters(40, letters=letter)
            for column, n in enumerate(NUMBERS):
                dmp = ProbabilisticDMP().fit(letters[:n])
                bands[row, column] = np.mean([width_and_share(dmp, execution) for execution in letters[20:]], axis=0)
                if letter == "e" and n in (1, 3, 10):
                    ax = axes[(1, 3, 10).index(n)]
                    rollout = dmp.rollout()
                    band(ax, rollout.times, rollout.positions[:, 1] - rollout.positions[0, 1], rollout.position_stds[:, 1])
                    ax.set(xlabel="Time [s]", ylabel="y, from the start [mm]", title=f"n = {n}", ylim=(-12, 13))
        axes[3].plot(NUMBERS, bands[..., 0].mean(axis=0), color=MEAN, marker="o")
        for n, (width, share) in zip(NUMBERS, bands.mean(axis=0), strict=True):
            print(f"{n:2d} demonstrations: {100 * share:.0f} % of 60 new executions lie in a band of ±{width:.2f} mm")
            axes[3].text(n, 0.2, f"{100 * share:.0f}", fontsize=8, ha="center")
        axes[3].set(xscale="log", xlabel="Demonstrations", ylabel="Half band [mm]", title="Width (numbers: % inside)")
        axes[3].set_xticks(NUMBERS, map(str, NUMBERS))
        axes[3].set(xlim=(0.8, 26), ylim=(0, 1.15 * bands[..., 0].mean(axis=0).max()))
        axes[3].minorticks_off()
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
