"""Send a learned movement to another goal, and run it faster or slower.

A goal near the demonstrated ends changes the movement as the demonstrations changed with theirs. A goal far away draws all
of it there, as in any DMP. Another duration stretches time: the path stays, velocities scale.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from probdmp import ProbabilisticDMP, synthetic_letters
from probdmp.plotting.style import figure_style, series


def main(figure_path: Path) -> None:
    dmp = ProbabilisticDMP().fit(synthetic_letters(10, letters="a"))
    learned = dmp.primitive_

    with figure_style():
        figure, (paths, speeds) = plt.subplots(1, 2, figsize=(10, 3.2), width_ratios=(1.2, 1), layout="constrained")
        for k, shift in enumerate(([0, 0], [1, 2], [6, 0], [8, 8])):
            rollout = dmp.rollout(goal=learned.goal + shift)
            label = f"{shift[0]:+d}, {shift[1]:+d} mm" if k else "as learned"
            paths.plot(*rollout.positions.T, label=label, **series(k))
            paths.plot(*rollout.positions[-1], marker="o", color=series(k)["color"])
            print(f"goal {label}: ends {np.linalg.norm(rollout.positions[-1] - learned.goal - shift):.3f} mm from it")
        paths.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title="Goal, moved by")
        paths.legend(loc="upper left", bbox_to_anchor=(1, 1))

        for k, factor in enumerate((0.5, 1.0, 2.0)):
            rollout = dmp.rollout(duration=factor * learned.duration)
            speed = np.linalg.norm(rollout.velocities, axis=1)
            speeds.plot(rollout.times, speed, label=f"{rollout.times[-1]:.2f} s", **series(k))
        speeds.set(xlabel="Time [s]", ylabel="Speed [mm/s]", title="Duration")
        speeds.legend()
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
