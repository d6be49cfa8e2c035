"""Notice a failure while it happens: an execution is blocked half-way, and the detector says when, why and where.

The detector is calibrated on demonstrations that were left out. Its test ratio is one number per tick; above 1 is an alarm.
The movement held back at 55 % of its duration keeps its sensor noise, so nothing gives it away but where it is.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from probdmp import Demonstration, FailureDetector, ProbabilisticDMP, Verdict, synthetic_letters
from probdmp.demonstrations import hold
from probdmp.plotting.style import ALARM, FAULTY, RECORDED, figure_style
from probdmp.plotting.trajectories import plot_rollout


def watch(dmp: ProbabilisticDMP, detector: FailureDetector, task: Demonstration, measured: np.ndarray) -> tuple[list, Verdict]:
    """Test ratio at each tick, and what the detector says in the end."""
    start, goal = task.positions[0], task.positions[-1]
    run = dmp.execute(start=start, goal=goal, duration=task.duration, dt=task.dt, detector=detector)
    return [run.step(position).test_ratio for position in measured], run.verdict


def main(figure_path: Path) -> None:
    letters = synthetic_letters(21, letters="d")
    dmp, execution = ProbabilisticDMP().fit(letters[:20]), letters[20]
    detector = FailureDetector(false_alarm_rate=0.05).fit(dmp, letters[:20])
    onset = int(0.55 * execution.n_samples)
    blocked = hold(execution.positions, onset, np.random.default_rng(0))
    plan = dmp.rollout(start=execution.positions[0], goal=execution.positions[-1], duration=execution.duration)

    with figure_style():
        figure, (path, ratio) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
        plot_rollout(path, plan, dof=1).set_title("What was measured")
        for name, measured, color, line in (
            ("as recorded", execution.positions, RECORDED, "-"),
            ("blocked", blocked, FAULTY, "--"),
        ):
            ratios, verdict = watch(dmp, detector, execution, measured)
            print(f"{name}: {verdict}")
            path.plot(execution.times, measured[:, 1], color=color, linestyle=line, label=name)
            ratio.plot(execution.times, ratios, color=color, linestyle=line)
            if verdict.failed:
                path.plot(verdict.time, measured[verdict.step, 1], "v", color=ALARM, label="alarm")
                ratio.plot(verdict.time, verdict.test_ratio, "v", color=ALARM)
        for ax in (path, ratio):
            ax.axvline(execution.times[onset], color="0.6", linewidth=1, label="onset")
        ratio.axhline(1, color="0.2", linewidth=1, linestyle=":")
        ratio.set(xlabel="Time [s]", ylabel="Test ratio", title="What the detector says: above 1 is an alarm", ylim=(0, 5))
        path.legend()
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
