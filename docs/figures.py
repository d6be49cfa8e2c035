"""Draws every picture of the documentation: `make figures`."""

from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np

from probdmp import synthetic_arm_movements, synthetic_letters
from probdmp.demonstrations import ARM_MOVEMENTS, LETTERS, written_letters
from probdmp.demonstrations.sigma_lognormal import speeds
from probdmp.evaluation import Experiment, illustrate
from probdmp.plotting.failure_detection import failure_detection_panels
from probdmp.plotting.panels import tiled
from probdmp.plotting.style import MEAN, figure_style, series

if TYPE_CHECKING:
    from matplotlib.figure import Figure

IMAGES = Path(__file__).parent / "images"


def failure_detection() -> "Figure":
    """The paper's figure."""
    experiment = Experiment()
    shown = illustrate(synthetic_letters(experiment.train + experiment.test, letters="a"), experiment)
    return tiled(failure_detection_panels(shown), 3)


def letters(repetitions: int = 6, per_row: int = 3, pitch: float = 22.0) -> "Figure":
    """A contact sheet: each letter so many times, `pitch` millimetres apart."""
    rows = -(-len(LETTERS) // per_row)
    figure, axes = plt.subplots(rows, per_row, figsize=(11, 1.15 * rows), sharex=True, sharey=True, layout="constrained")
    for k, ax in enumerate(axes.flat):
        ax.set_aspect("equal")
        ax.axis("off")
        for place, demonstration in enumerate(synthetic_letters(repetitions, letters=LETTERS[k]) if k < len(LETTERS) else ()):
            ax.plot(demonstration.positions[:, 0] + pitch * place, demonstration.positions[:, 1], color="k", linewidth=1.2)
    return figure


def letter_speeds(shown: str = "aes") -> "Figure":
    """How fast the pen is, and the lognormal strokes behind it."""
    figure, axes = plt.subplots(1, len(shown), figsize=(11, 2.4), sharey=True, layout="constrained")
    for ax, letter in zip(axes, shown, strict=True):
        (written,) = written_letters(1, letters=letter)
        times = written.demonstration.times
        for k, stroke in enumerate(speeds(written.strokes, times).T):
            ax.plot(times, stroke, linewidth=1, **series(k + 1), label="strokes" if k == 0 else None)
        ax.plot(times, np.linalg.norm(written.velocities, axis=1), color=MEAN, linewidth=2, label="pen")
        ax.set_title(letter)
        ax.set_xlabel("Time [s]")
    axes[0].set_ylabel("Speed [mm/s]")
    axes[0].legend()
    return figure


def arm_movements(executions: int = 5) -> "Figure":
    """Positions over time with the via-points; one execution strong, the others faint."""
    figure, axes = plt.subplots(2, 3, figsize=(11, 4.6), layout="constrained")
    for ax, name in zip(axes.flat, ARM_MOVEMENTS, strict=True):
        for k, movement in enumerate(reversed(synthetic_arm_movements(executions, movements=(name,)))):
            first, names = k == executions - 1, movement.demonstration.names
            for d, positions in enumerate(movement.positions.T):
                style = {**series(d), "label": names[d], "linewidth": 1.8} if first else {"color": "0.8", "linewidth": 0.8}
                ax.plot(movement.demonstration.times, positions, **style)
            if first:
                ax.plot(movement.via_times, movement.via_points, "k.", markersize=4)
        ax.set_title(name)
        ax.set_xlabel("Time [s]")
        ax.set_ylabel(f"Position [{movement.demonstration.units}]")
    for ax in axes[:, -1]:
        ax.legend(loc="center left", bbox_to_anchor=(1, 0.5))
    return figure


def main() -> None:
    with figure_style():
        for draw in (failure_detection, letters, letter_speeds, arm_movements):
            draw().savefig(IMAGES / f"{draw.__name__}.png", dpi=150)


if __name__ == "__main__":
    main()
