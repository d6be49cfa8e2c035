"""Draws every picture of docs/images but that of n_basis, and writes the tables of docs/feedback.md: `make figures`."""

import runpy
from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from feedback_figures import draw_displaced, draw_feedback_compared, draw_feedback_gains, draw_feedback_rest
from feedback_tables import write_feedback_tables
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from movement_figures import draw_arm_movements, draw_letter_speeds, draw_letters

from probdmp import Demonstration, GaussianTrajectory, ProbabilisticDMP, synthetic_letters
from probdmp.dmp.basis import basis_features
from probdmp.dmp.forcing_term import forcing_term
from probdmp.dmp.phase import phases_at
from probdmp.evaluation import Experiment, illustrate
from probdmp.plotting.failure_detection import failure_detection_panels
from probdmp.plotting.panels import tiled
from probdmp.plotting.style import ALARM, FAULTY, MEAN, RECORDED, band, figure_style
from probdmp.plotting.trajectories import plot_rollout

IMAGES = Path(__file__).parent / "images"
EXAMPLES = Path(__file__).parent.parent / "examples"
TAUGHT = 10


def draw_likelihood() -> Figure:
    """The paper's figure."""
    experiment = Experiment()
    letters = synthetic_letters(experiment.train + experiment.test, letters="a")
    return tiled(failure_detection_panels(illustrate(letters, experiment)), 3)


def draw_dmp() -> Figure:
    """Basis functions, the forcing term that they make, and what it does to the path."""
    learned = ProbabilisticDMP(10).fit(synthetic_letters(TAUGHT, letters="a"))
    rollout = learned.rollout()
    times, duration = rollout.times, learned.primitive_.duration
    phases = phases_at(times, duration)
    figure, (basis, forcing, path) = plt.subplots(1, 3, figsize=(10, 3), layout="constrained")
    basis.plot(times, basis_features(phases, 10), color=MEAN, linewidth=1)
    basis.plot(times, phases, color="0.6", linestyle="--")
    basis.text(times[12], phases[8], "phase", fontsize=8, color="0.4")
    basis.set(xlabel="Time [s]", title="1. Basis functions of the phase")
    forcing.axhline(0, color="0.8", linewidth=1)
    forcing.plot(times, forcing_term(learned.primitive_, phases).means)
    forcing.lines[1].set_color(MEAN)
    forcing.lines[2].set_color(FAULTY)
    forcing.legend(forcing.lines[1:], rollout.names)
    forcing.set(xlabel="Time [s]", ylabel="f [mm]", title="2. Weighted: the forcing term")
    path.plot(*rollout.positions.T, color=MEAN, label="with it")
    ends = np.stack([rollout.positions[0], rollout.positions[-1]])
    path.plot(*ends.T, color="0.6", linestyle="--", label="spring and damper alone")
    path.plot(*ends[:1].T, "o", color=RECORDED)
    path.plot(*ends[1:].T, "o", color=ALARM)
    path.annotate("start", ends[0], (4, 6), textcoords="offset points", fontsize=8)
    path.annotate("goal", ends[1], (4, 6), textcoords="offset points", fontsize=8)
    path.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title="3. The path", ylim=(-2, 14))
    path.legend(loc="upper left", bbox_to_anchor=(0, 1.02), ncols=2, columnspacing=0.8)
    return figure


def draw_system() -> Figure:
    """States, inputs and measurements, and which depends on which."""
    figure, ax = plt.subplots(figsize=(7, 2.5), layout="constrained")
    rows = {"u": (2.0, "0.93", "forcing term and goal"), "s": (1.0, "#9db8d9", "state"), "o": (0.0, "white", "measurement")}
    for name, (y, color, words) in rows.items():
        ax.text(-0.75, y, words, ha="right", va="center", fontsize=9)
        for x, index in enumerate(("t-1", "t", "t+1")):
            ax.scatter(2 * x, y, s=750, color=color, edgecolor=MEAN, zorder=2)
            ax.text(2 * x, y, f"${name}_{{{index}}}$", ha="center", va="center", fontsize=11, zorder=3)
    arrow = {"arrowstyle": "-|>", "color": MEAN, "shrinkA": 15, "shrinkB": 15}
    for x in (0, 2, 4):
        ax.annotate("", (x, 0), (x, 1), arrowprops=arrow)
        ax.annotate("", (x + 2, 1), (x, 1), arrowprops=arrow)
        if x < 4:
            ax.annotate("", (x + 2, 1), (x, 2), arrowprops=arrow)
    ax.text(1, 1.1, "A", ha="center", fontsize=9)
    ax.text(1.15, 1.6, "B", ha="center", fontsize=9)
    ax.text(0.12, 0.5, "C", ha="left", va="center", fontsize=9)
    ax.set(xlim=(-3.2, 6.2), ylim=(-0.5, 2.5))
    ax.set_axis_off()
    return figure


def draw_uncertainty() -> Figure:
    """The bands of the paper's model and of the library's, with executions that neither has seen."""
    letters = synthetic_letters(TAUGHT + 12, letters="a")
    models = {
        "How sure of the mean movement (the paper)": ProbabilisticDMP.as_published(),
        "How executions differ (the default)": ProbabilisticDMP(),
    }
    figure, axes = plt.subplots(1, 2, figsize=(9, 3), layout="constrained", sharey=True)
    for ax, (title, model) in zip(axes, models.items(), strict=True):
        rollout = model.fit(letters[:TAUGHT]).rollout()
        plot_rollout(ax, rollout, 0).set_title(title)
        _beside(ax, rollout, letters[TAUGHT:])
    axes[1].plot([], [], color=RECORDED, linewidth=0.8, label="12 other executions")
    axes[1].legend(loc="lower right")
    return figure


def _beside(ax: Axes, rollout: GaussianTrajectory, executions: list[Demonstration]) -> None:
    """Executions, moved to the start of the rollout and stretched to its duration."""
    for execution in executions:
        path = execution.positions[:, 0] - execution.positions[0, 0] + rollout.positions[0, 0]
        ax.plot(np.linspace(0, rollout.times[-1], len(path)), path, color=RECORDED, linewidth=0.7)


def draw_belief() -> Figure:
    """What an execution so far says about its rest."""
    letters = synthetic_letters(TAUGHT + 2, letters="a")
    learned, execution = ProbabilisticDMP().fit(letters[:TAUGHT]), letters[TAUGHT + 1]
    figure, axes = plt.subplots(1, 3, figsize=(10, 3), layout="constrained", sharey=True)
    for ax, share in zip(axes, (0.0, 0.25, 0.5), strict=True):
        seen = execution.positions.copy()
        n_seen = max(1, int(share * len(seen)))
        seen[n_seen:] = np.nan
        belief = learned.smooth(seen, execution.dt, goal=execution.positions[-1])
        band(ax, belief.times, belief.positions[:, 0], belief.position_stds[:, 0])
        ax.plot(execution.times, execution.positions[:, 0], color=FAULTY, linestyle="--", linewidth=1, label="still to come")
        ax.plot(execution.times[:n_seen], seen[:n_seen, 0], color=RECORDED, linewidth=2.5, label="measured")
        ax.set(xlabel="Time [s]", title=f"{100 * share:.0f} % seen" if share else "The start is seen")
    axes[0].set_ylabel("x position [mm]")
    axes[2].legend(loc="lower right")
    return figure


PICTURES: dict[str, Callable[[], Figure]] = {
    "failure_detection": draw_likelihood,
    "dmp": draw_dmp,
    "system": draw_system,
    "uncertainty": draw_uncertainty,
    "belief": draw_belief,
    "letters": draw_letters,
    "letter_speeds": draw_letter_speeds,
    "arm_movements": draw_arm_movements,
    "displaced": draw_displaced,
    "feedback_gains": draw_feedback_gains,
    "feedback_compared": draw_feedback_compared,
    "feedback_rest": draw_feedback_rest,
}


def main() -> None:
    with figure_style():
        for name, draw in PICTURES.items():
            draw().savefig(IMAGES / f"{name}.png", dpi=150)
    write_feedback_tables()
    pictures = {"06_detect_a_failure": "alarm", "12_tool_camera": "tool_camera", "13_how_it_should_feel": "how_it_feels"}
    for example, name in pictures.items():
        runpy.run_path(str(EXAMPLES / f"{example}.py"))["main"](IMAGES / f"{name}.png")


if __name__ == "__main__":
    main()
