"""Learn a movement from ten demonstrations and plan it, with its uncertainty.

The demonstrations differ in place, size, shape and duration. The rollout is what a controller would be sent: position,
velocity and acceleration at each tick, here with the 95 % band in which single executions are expected.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

from probdmp import ProbabilisticDMP, synthetic_letters
from probdmp.plotting.demonstrations import plot_demonstrated_paths
from probdmp.plotting.style import MEAN, figure_style
from probdmp.plotting.trajectories import plot_rollout


def main(figure_path: Path) -> None:
    demonstrations = synthetic_letters(10, letters="a")
    dmp = ProbabilisticDMP().fit(demonstrations)
    rollout = dmp.rollout()

    print(f"{len(demonstrations)} demonstrations, {dmp.primitive_.n_dof} degrees of freedom: {', '.join(rollout.names)}")
    print(f"{len(rollout.times)} ticks in {rollout.times[-1]:.2f} s; position stds up to {rollout.position_stds.max():.2f} mm")

    with figure_style():
        figure, (path, position, velocity) = plt.subplots(1, 3, figsize=(10, 3.2), layout="constrained")
        plot_demonstrated_paths(path, demonstrations, start=rollout.positions[0]).set_title("Demonstrations and mean")
        path.plot(*rollout.positions.T, color=MEAN, linewidth=2)
        plot_rollout(position, rollout, dof=0).set_title("Position, 95 % band")
        plot_rollout(velocity, rollout, dof=0, quantity="velocity").set_title("Velocity, 95 % band")
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
