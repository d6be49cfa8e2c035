"""Fill the gaps of a recording: filter while it runs, smooth afterwards, and say how sure both are.

NaN marks what was not measured. The filter knows what came before; its band widens in a gap and snaps back after it. The
smoother knows what came after as well.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from probdmp import ProbabilisticDMP, synthetic_letters
from probdmp.plotting.style import FAULTY, RECORDED, figure_style
from probdmp.plotting.trajectories import plot_rollout

GAP = (0.35, 0.65)  # fractions of the duration


def main(figure_path: Path) -> None:
    letters = synthetic_letters(11, letters="g")
    dmp, execution = ProbabilisticDMP().fit(letters[:10]), letters[10]
    fractions = execution.times / execution.duration
    missing = (GAP[0] < fractions) & (fractions < GAP[1])
    seen = execution.positions.copy()
    seen[missing] = np.nan

    task = {"dt": execution.dt, "start": execution.positions[0], "goal": execution.positions[-1]}
    estimates = {"Filter: track": dmp.track(seen, **task), "Smoother: smooth": dmp.smooth(seen, **task)}

    with figure_style():
        figure, axes = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained", sharey=True)
        for ax, (name, estimate) in zip(axes, estimates.items(), strict=True):
            error = np.sqrt(np.mean((estimate.positions - execution.positions)[missing] ** 2))
            print(f"{name}: rms error {error:.2f} mm in the gap, band ±{1.96 * estimate.position_stds[missing].mean():.2f} mm")
            plot_rollout(ax, estimate, dof=1).set_title(name)
            ax.plot(execution.times, seen[:, 1], color=RECORDED, linewidth=2, label="measured")
            hidden = np.where(missing, execution.positions[:, 1], np.nan)
            ax.plot(execution.times, hidden, color=FAULTY, linestyle="--", label="hidden from it")
        axes[0].legend(loc="lower left")
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
