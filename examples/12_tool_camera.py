"""Joint angles of an arm from a camera that sees its tool, and only now and then.

The movement was taught in joint angles. The camera is a nonlinear sensor: where the tool is, as a function of the angles. The
filter linearises that; nobody inverts it. Between frames and while the view is blocked, the movement itself says how to go on.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from probdmp import Demonstration, ProbabilisticDMP
from probdmp.demonstrations import WrittenLetter, written_letters
from probdmp.execution import PlanarArm, planar_arm_sensor
from probdmp.plotting.style import FAULTY, MEAN, RECORDED, band, figure_style

ARM = PlanarArm([150.0, 120.0])  # lengths of its links, mm
PAPER = np.array([110.0, 90.0])  # mm from its base: where letters are written
CAMERA = planar_arm_sensor("camera", ARM.lengths, stds=0.5)  # mm
EVERY = 4  # ticks from frame to frame
BLOCKED = (0.45, 0.65)  # of the duration
JOINTS = ("shoulder", "elbow")


def joint_angles(tool: np.ndarray) -> np.ndarray:
    """(T, 2) radians, of an arm that holds its tool at (T, 2) positions: how the movement was taught."""
    (x, y), (upper, lower) = tool.T, ARM.lengths
    elbow = np.arccos((x**2 + y**2 - upper**2 - lower**2) / (2 * upper * lower))
    shoulder = np.arctan2(y, x) - np.arctan2(lower * np.sin(elbow), upper + lower * np.cos(elbow))
    return np.stack([shoulder, elbow], axis=-1)


def frames_of(written: WrittenLetter, rng: np.random.Generator) -> np.ndarray:
    """(T, 2) mm: what the camera saw of the tool; NaN where there was no frame, or something in the way."""
    share = np.linspace(0, 1, len(written.positions))
    blind = (np.arange(len(share)) % EVERY > 0) | ((share > BLOCKED[0]) & (share < BLOCKED[1]))
    seen = written.positions + PAPER + rng.multivariate_normal(np.zeros(2), CAMERA.covariance, len(share))
    return np.where(blind[:, None], np.nan, seen)


def main(figure_path: Path) -> None:
    letters, rng, dt = written_letters(20, letters="g"), np.random.default_rng(0), 0.01
    taught = [Demonstration(joint_angles(w.demonstration.positions + PAPER), dt, "g", JOINTS) for w in letters[:10]]
    dmp, said = ProbabilisticDMP().fit(taught), {"with the camera": [], "without": []}
    for new in letters[10:]:
        frames, angles = frames_of(new, rng), joint_angles(new.positions + PAPER)
        task = {"start": angles[0], "goal": angles[-1], "dt": dt}
        found = dmp.smooth({"camera": frames}, **task, sensors=[CAMERA])
        for name, guess in zip(said, (found, dmp.rollout(**task, duration=found.times[-1])), strict=True):
            off, inside = guess.positions - angles, np.abs(guess.positions - angles) < 1.96 * guess.position_stds
            said[name].append(
                (np.mean(off**2), np.linalg.norm(ARM(guess.positions) - ARM(angles), axis=1).max(), inside.mean())
            )
    for name, numbers in said.items():
        square, worst, share = np.mean(numbers, axis=0)
        worst_said = f"the tool {worst:.1f} mm at worst, {100 * share:.0f} % in the 95 % bands"
        print(f"{name}: angles {np.degrees(square**0.5):.2f}° off, {worst_said}; of {len(numbers)} executions")

    with figure_style():
        figure, (path, *joints) = plt.subplots(1, 3, figsize=(11, 3.2), layout="constrained", width_ratios=(1.1, 1, 1))
        path.plot(*ARM(angles).T, color=RECORDED, linewidth=4, alpha=0.4, label="truth")
        path.plot(*ARM(found.positions).T, color=MEAN, linestyle="--", label="estimate")
        path.plot(*frames.T, ".", color=FAULTY, label="frames")
        path.set(xlabel="x [mm]", ylabel="y [mm]", title="The tool, as the camera sees it", aspect="equal", xlim=(104, 132))
        path.legend(loc="upper right")
        for k, (ax, name) in enumerate(zip(joints, JOINTS, strict=True)):
            band(ax, found.times, np.degrees(found.positions[:, k]), np.degrees(found.position_stds[:, k]))
            ax.plot(found.times, np.degrees(angles[:, k]), color=RECORDED, linestyle="--", label="truth")
            ax.axvspan(*(np.array(BLOCKED) * found.times[-1]), color="0.9", linewidth=0, zorder=0, label="view blocked")
            ax.set(xlabel="Time [s]", ylabel=f"{name.capitalize()} [°]", title=f"The {name}, never measured")
        joints[1].legend()
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
