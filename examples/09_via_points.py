"""Make a movement pass through points; the rest of it changes as the demonstrations say it would.

A via-point is a time, a position and how far the movement may pass from it. NaN leaves a degree of freedom free. What was
learned is conditioned on it: the result is a new movement, to be rolled out, executed, saved like any other.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from probdmp import ProbabilisticDMP, synthetic_letters
from probdmp.plotting.style import ALARM, figure_style, series
from probdmp.plotting.trajectories import plot_rollout


def main(figure_path: Path) -> None:
    dmp = ProbabilisticDMP().fit(synthetic_letters(15, letters="n"))
    plan = dmp.rollout()
    step = int(0.55 * len(plan.times))
    time, where = plan.times[step], plan.positions[step]
    points = {
        "as learned": [],
        "1.5 mm further right": [(time, [where[0] + 1.5, where[1]], 0.1)],
        "x free, 1.5 mm higher": [(time, [np.nan, where[1] + 1.5], 0.1)],
    }

    with figure_style():
        figure, axes = plt.subplots(1, 4, figsize=(11, 3.2), layout="constrained", width_ratios=(1.3, 1, 1, 1))
        for k, (name, via) in enumerate(points.items()):
            rollout = (dmp.condition(via) if via else dmp).rollout()
            axes[0].plot(*rollout.positions.T, label=name, **series(k))
            plot_rollout(axes[k + 1], rollout, dof=1).set_title(name)
            axes[k + 1].sharey(axes[1])
            for _, position, _ in via:
                free = np.isnan(position)
                marked = np.where(free, rollout.positions[step], position)
                axes[0].plot(*marked, "o", color=series(k)["color"])
                axes[k + 1].plot(time, marked[1], "o", color=ALARM)
                off = (rollout.positions[step] - position)[~free]
                print(f"{name}: passes {np.abs(off).max():.2f} mm from it, std {rollout.position_stds[step, 1]:.2f} mm in y")
        axes[0].set(xlabel="x [mm]", ylabel="y [mm]", title="Paths")
        axes[0].set_aspect("equal", adjustable="datalim")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower left", ncols=3)
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
