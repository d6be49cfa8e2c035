"""Execute with feedback: a robot is pushed aside, the command gives way and comes back by itself.

Each tick: measure, `step`, send. The Kalman filter weighs the measurement against the prediction by their covariances,
and the next command starts from the result. How far it gives way is a matter of how much the measurement is trusted.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from probdmp import OnlineExecution, ProbabilisticDMP, synthetic_letters
from probdmp.plotting.style import FAULTY, MEAN, RECORDED, figure_style
from probdmp.plotting.trajectories import plot_rollout

PUSH = 20.0  # mm/s, lasting for PUSHED
PUSHED = (0.5, 0.6)  # seconds


def run_robot(run: OnlineExecution, n_ticks: int, feedback: bool) -> tuple[np.ndarray, np.ndarray]:
    """Where the robot was and what it was told, (T, 2) arrays: it gets where it is told, but for the push."""
    rng = np.random.default_rng(0)
    position, measured, commanded = run.primitive.start, [], []
    for k in range(n_ticks):
        pushed = PUSHED[0] <= k * run.dt < PUSHED[1]
        position = position + pushed * run.dt * np.array([PUSH, 0.0])
        measured.append(position + 0.03 * rng.standard_normal(2))
        position = run.step(measured[-1] if feedback else None).position
        commanded.append(position)
    return np.array(measured), np.array(commanded)


def main(figure_path: Path) -> None:
    dmp = ProbabilisticDMP().fit(synthetic_letters(10, letters="a"))
    plan = dmp.rollout()
    cases = {
        "Sensor noise as learned": (dmp, True),
        "with_sensor_noise, 0.3 mm": (dmp.with_sensor_noise([0.3, 0.3]), True),
        "No feedback: step(None)": (dmp, False),
    }
    with figure_style():
        figure, axes = plt.subplots(1, 3, figsize=(11, 3), layout="constrained", sharey=True)
        for ax, (name, (used, feedback)) in zip(axes, cases.items(), strict=True):
            run = used.execute(start=dmp.primitive_.start)
            measured, commanded = run_robot(run, len(plan.times), feedback)
            plot_rollout(ax, plan, dof=0).set_title(name)
            ax.plot(plan.times, measured[:, 0], color=RECORDED, linewidth=1, label="measured")
            ax.plot(plan.times + run.dt, commanded[:, 0], color=FAULTY, linestyle="--", label="commanded")
            ax.axvspan(*PUSHED, color="0.9", linewidth=0, zorder=0, label="pushed")
            off = np.abs(commanded[:-1, 0] - plan.positions[1:, 0])
            print(f"{name}: command up to {off.max():.2f} mm off the plan, {off[-1]:.2f} mm at the end")
        axes[0].plot([], [], color=MEAN, label="plan")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right center")
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
