"""The gain of the feedback follows from covariances: a robot is displaced, and what is commanded next answers to it.

The innovation e, what is measured minus what was expected, enters the next command as A K e. `feedback_gains` says what A K is:
the better the sensor, and the more demonstrations vary at that phase, the more of a displacement is believed and followed. A
good sensor that sees a jump sees speed, too.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from probdmp import OnlineExecution, ProbabilisticDMP, synthetic_arm_movements
from probdmp.execution import state_sensor
from probdmp.plotting.style import ALARM, figure_style, series

DOF = 1  # y
DISPLACED = np.array([0.0, 0.005, 0.0])  # metres
WHEN = 0.45  # of the duration
STDS = (0.001, 0.01, 0.05)  # of the sensor, metres


def run_robot(run: OnlineExecution, n_ticks: int, displaced_at: int | None) -> tuple[np.ndarray, np.ndarray]:
    """What it was told for the next tick, and the innovations, (T, 3) arrays: it gets where it is told, but for one tick."""
    position, commands, innovations = run.primitive.start, [], []
    for tick in range(n_ticks):
        step = run.step(position + DISPLACED if tick == displaced_at else position)
        position = step.position
        commands.append(position)
        innovations.append(step.innovations)
    return np.array(commands), np.array(innovations)


def main(figure_path: Path) -> None:
    movements = synthetic_arm_movements(20, movements=("place",))
    dmp = ProbabilisticDMP().fit([m.demonstration for m in movements])
    task = {"start": dmp.primitive_.start, "goal": dmp.primitive_.goal}
    plan = dmp.rollout(**task)
    n_ticks, tick = len(plan.times), int(WHEN * len(plan.times))

    with figure_style():
        figure, (offset, gain) = plt.subplots(1, 2, figsize=(10, 3.2), layout="constrained")
        for k, std in enumerate(STDS):
            name, sensors = f"sensor of {1000 * std:g} mm", [state_sensor(dmp.primitive_, "position", "position", std)]
            gains = dmp.feedback_gains(**task, sensors=sensors)
            runs = [run_robot(dmp.execute(**task, sensors=sensors), n_ticks, at) for at in (tick, None)]
            moved, innovations = (displaced - usual for displaced, usual in zip(*runs, strict=True))
            answer = gains[tick, :, 2] @ innovations[tick]
            print(f"{name}: the next command is {1000 * moved[tick, DOF]:.2f} mm off, A K e is {1000 * answer[DOF]:.2f} mm")
            offset.plot(plan.times + dmp.primitive_.dt, 1000 * moved[:, DOF], label=name, **series(k + 1))
            gain.plot(plan.times[1:], gains[:, DOF, 2, DOF], label=name, **series(k + 1))
        offset.plot(plan.times[tick], 1000 * DISPLACED[DOF], "v", color=ALARM, label="the robot, displaced")
        offset.set(xlabel="Time [s]", ylabel="y off the plan [mm]", title="What is commanded afterwards")
        spread = gain.twinx()
        spread.fill_between(plan.times, 1000 * plan.position_stds[:, DOF], color="0.9", linewidth=0)
        spread.set(ylabel="Executions differ: std of y [mm]", ylim=(0, 32))
        spread.spines["right"].set_visible(True)
        gain.set(xlabel="Time [s]", ylabel="Gain [m per m]", title="Gain of the commanded y, and spread (grey)", ylim=(0, 0.95))
        gain.set(zorder=1, facecolor="none")
        offset.legend()
        gain.legend(loc="upper right")
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
