"""From three-dimensional recordings to a model file, and from the file to a monitored stream of measurements.

A hand reaches over an obstacle, in metres. The model file holds the movement and its detector, so that what runs on the
robot needs nothing else. The stream has gaps, comes with its own clock, and ends in a collision.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

from probdmp import Demonstration, FailureDetector, ProbabilisticDMP, load, load_detector
from probdmp.plotting.style import ALARM, FAULTY, figure_style
from probdmp.plotting.trajectories import plot_rollout


def reach(rng: np.random.Generator, dt: float = 0.01) -> Demonstration:
    """A minimum-jerk reach of half a metre that is lifted on its way, never twice the same."""
    s = np.arange(0.0, 1.0, dt / rng.normal(1.5, 0.05))
    minimum_jerk = s**3 * (10 - 15 * s + 6 * s**2)
    goal, lift = rng.normal([0.5, 0.2, 0.1], 0.02), rng.normal(0.15, 0.015)
    path = minimum_jerk[:, None] * goal + (lift * np.sin(np.pi * minimum_jerk))[:, None] * [0.0, 0.0, 1.0]
    return Demonstration(path + rng.normal(0, 5e-4, path.shape), dt, names=("x", "y", "z"), units="m")


def stream(execution: Demonstration, collision: float, rng: np.random.Generator) -> Iterator[tuple[float, np.ndarray | None]]:
    """Times and measurements; one in five is lost, and the hand is stopped at the collision."""
    stop = int(collision / execution.dt)
    for k, time in enumerate(execution.times):
        measured = execution.positions[min(k, stop)] + rng.normal(0, 5e-4, 3) * (k > stop)
        yield time, None if rng.random() < 0.2 else measured


def main(figure_path: Path) -> None:
    rng = np.random.default_rng(1)
    demonstrations = [reach(rng) for _ in range(20)]
    dmp = ProbabilisticDMP(n_basis=15).fit(demonstrations)
    with TemporaryDirectory() as folder:
        model = Path(folder) / "reach.probdmp"
        dmp.save(model, FailureDetector(false_alarm_rate=0.05).fit(dmp, demonstrations))
        dmp, detector = load(model), load_detector(model)

    new = reach(rng)
    told = {"start": new.positions[0], "goal": new.positions[-1], "duration": new.duration}
    run = dmp.execute(**told, detector=detector, on_alarm="hold")
    steps = [(time, run.step(measured, time)) for time, measured in stream(new, 0.8, rng)]
    print(run.verdict)

    with figure_style():
        figure, axes = plt.subplots(1, 4, figsize=(11, 2.8), layout="constrained")
        times, plan = [time for time, _ in steps], dmp.rollout(**told)
        for dof in range(3):
            plot_rollout(axes[dof], plan, dof).axvline(0.8, color="0.6", linewidth=1)
            axes[dof].plot(times, [step.position[dof] for _, step in steps], color=FAULTY, linestyle="--")
        axes[0].set_title("Band, and command (dashed)")
        axes[3].plot(times, [step.test_ratio for _, step in steps], color=FAULTY)
        axes[3].axhline(1, color="0.2", linewidth=1, linestyle=":")
        axes[3].plot(run.verdict.time, run.verdict.test_ratio, "v", color=ALARM)
        axes[3].set(xlabel="Time [s]", ylabel="Test ratio", title="Alarm, then hold", ylim=(0, 4))
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
