"""Pictures of the built-in movements; `docs/figures.py` saves them."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from probdmp import synthetic_arm_movements, synthetic_letters
from probdmp.demonstrations import ARM_MOVEMENTS, LETTERS, written_letters
from probdmp.demonstrations.sigma_lognormal import speeds
from probdmp.plotting.style import MEAN, series

__all__ = ["draw_arm_movements", "draw_letter_speeds", "draw_letters"]


def draw_letters(repetitions: int = 6, per_row: int = 3, pitch: float = 22.0) -> Figure:
    """A contact sheet: each letter so many times, `pitch` millimetres apart."""
    rows = -(-len(LETTERS) // per_row)
    figure, axes = plt.subplots(rows, per_row, figsize=(11, 1.15 * rows), sharex=True, sharey=True, layout="constrained")
    for k, ax in enumerate(axes.flat):
        ax.set_aspect("equal")
        ax.axis("off")
        for place, demonstration in enumerate(synthetic_letters(repetitions, letters=LETTERS[k]) if k < len(LETTERS) else ()):
            ax.plot(demonstration.positions[:, 0] + pitch * place, demonstration.positions[:, 1], color="k", linewidth=1.2)
    return figure


def draw_letter_speeds(shown: str = "aes") -> Figure:
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


def draw_arm_movements(executions: int = 5) -> Figure:
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
