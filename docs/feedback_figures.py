"""Pictures of docs/feedback.md; `docs/figures.py` saves them."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pushed_robot import BY, HELD, LETTERS, Inferred, coupled, displace, plan_of, position_sensor

from probdmp import ProbabilisticDMP, synthetic_letters
from probdmp.checks import FloatArray
from probdmp.demonstrations import WriterVariation
from probdmp.plotting.style import ALARM, BAND, FAULTY, MEAN, RECORDED, series

__all__ = ["draw_displaced", "draw_feedback_compared", "draw_feedback_gains", "draw_feedback_rest"]

SENSOR = 0.3
"""Standard deviation of the position sensor in pictures of what else sets the gain, mm."""


def draw_displaced() -> Figure:
    """An execution that is displaced: where it is, the innovation and what it adds to the command, the log-likelihood."""
    dmp = ProbabilisticDMP().fit(LETTERS)
    plan, inferred = plan_of(dmp), Inferred(dmp)
    execution = displace(dmp, inferred)
    gains = dmp.feedback_gains(start=dmp.primitive_.start, goal=dmp.primitive_.goal)
    innovations = np.array([step.innovations for step in inferred.steps])
    added = np.matmul(gains, innovations[:-1, None, :, None])[..., 0]
    figure, (path, feedback, likelihood) = plt.subplots(1, 3, figsize=(10, 3), layout="constrained")
    path.plot(plan.times, plan.positions[:, 0], color=MEAN, linestyle=":", label="plan")
    path.plot(plan.times, execution.positions[:, 0], color=RECORDED, linewidth=2.5, label="robot")
    path.plot(plan.times + dmp.primitive_.dt, execution.commands[:, 0, 2], color=FAULTY, linestyle="--", label="command")
    path.set(ylabel="x position [mm]", title="1. A hand holds the robot 2 mm off")
    feedback.plot(plan.times, innovations[:, 0], color=MEAN, label="innovation e")
    feedback.plot(plan.times[:-1], added[:, 0, 2], color=FAULTY, linestyle="--", label="A K e")
    feedback.set(ylabel="x position [mm]", title="2. What is added to the command")
    likelihood.plot(plan.times, [step.log_likelihood for step in inferred.steps], color=MEAN)
    likelihood.set(ylabel="Log-likelihood [nats]", title="3. How likely each tick was")
    for ax in (path, feedback, likelihood):
        _mark_held(ax)
    path.legend(loc="lower right")
    feedback.legend()
    return figure


def _mark_held(ax: Axes) -> None:
    ax.axvspan(*HELD, color="0.9", linewidth=0, zorder=0, label="held")
    ax.set_xlabel("Time [s]")


def _position_gains(dmp: ProbabilisticDMP, std: float | None = SENSOR) -> FloatArray:
    """(T - 1, 2, 2) array, mm per mm: of the commanded positions, per output."""
    task = {"start": dmp.primitive_.start, "goal": dmp.primitive_.goal}
    return dmp.feedback_gains(**task, sensors=position_sensor(dmp, std))[:, :, 2]


def draw_feedback_gains() -> Figure:
    """What sets the gain along the movement."""
    dmp, published = ProbabilisticDMP().fit(LETTERS), ProbabilisticDMP.as_published().fit(LETTERS)
    figure, axes = plt.subplots(2, 2, figsize=(10, 5.4), layout="constrained", sharex=True)
    noise, forcing, variation, cross = axes.flat
    for k, std in enumerate((0.03, 0.3, 3.0)):
        _plot_gain(noise, _position_gains(dmp, std)[:, 0, 0], f"{std:g} mm", k)
    noise.set_title("1. R: the better the sensor, the larger")
    for k, factor in enumerate((100, 1, 0.01)):
        other = _with_forcing_noise(published, factor)
        _plot_gain(forcing, _position_gains(other)[:, 0, 0], "as learned" if factor == 1 else f"{factor:g} × as learned", k)
    forcing.set_title("2. Q: the noisier the forcing term, the larger")
    for k, (name, share) in enumerate({"three times as varied": 3.0, "as usual": 1.0, "a third as varied": 1 / 3}.items()):
        _plot_gain(variation, _position_gains(_taught_by_writer(share))[:, 0, 0], name, k)
    variation.set_title("3. Demonstrations: the more they vary, the larger")
    for k, (name, (dof, output)) in enumerate({"x from x": (0, 0), "y from y": (1, 1), "y from x": (1, 0)}.items()):
        _plot_gain(cross, _position_gains(dmp)[:, dof, output], name, k)
    cross.axhline(0, color="0.8", linewidth=1, zorder=0)
    cross.set_title("4. Where they vary, and together with what")
    variation.set_ylim(top=0.68)
    for ax in axes[-1]:
        ax.set_xlabel("Share of the duration")
    for ax in axes[:, 0]:
        ax.set_ylabel("Gain [mm per mm]")
    for ax in axes.flat:
        ax.legend(loc="center right" if ax is forcing else "upper right")
    return figure


def _with_forcing_noise(dmp: ProbabilisticDMP, factor: float) -> ProbabilisticDMP:
    other, primitive = ProbabilisticDMP(**dmp.get_params()), dmp.primitive_
    other.primitive_ = replace(primitive, forcing_precisions=primitive.forcing_precisions / factor)
    return other


def _taught_by_writer(share: float) -> ProbabilisticDMP:
    """By one whose letters vary in shape by a share of what is usual; tempo and timing stay."""
    usual = WriterVariation()
    less = {what: share * getattr(usual, what) for what in ("shape", "bend", "size", "aspect", "slant")}
    return ProbabilisticDMP().fit(synthetic_letters(len(LETTERS), letters="a", variation=replace(usual, **less)))


def _plot_gain(ax: Axes, gains: FloatArray, name: str, k: int) -> None:
    ax.plot(np.arange(1, len(gains) + 1) / len(gains), gains, label=name, **series(k))


def draw_feedback_compared() -> Figure:
    """The same displacement, with gains set by hand and with the inferred one."""
    dmp = ProbabilisticDMP().fit(LETTERS)
    plan = plan_of(dmp)
    controllers = {
        "K_c = −60 / s²: gives way": coupled(dmp, -60),
        "K_c = 0: the plan": coupled(dmp, 0),
        "Inferred, sensor noise as learned": Inferred(dmp),
        "K_c = 300 / s²: pulls back": coupled(dmp, 300),
        "K_c = 3000 / s²: rings": coupled(dmp, 3000),
        "Inferred, sensor noise 0.3 mm": Inferred(dmp, 0.3),
    }
    figure, axes = plt.subplots(2, 3, figsize=(10, 5), layout="constrained", sharex=True, sharey=True)
    for ax, (name, controller) in zip(axes.flat, controllers.items(), strict=True):
        execution = displace(dmp, controller)
        ax.axhline(0, color=MEAN, linestyle=":", linewidth=1, label="plan")
        ax.plot(plan.times, execution.positions[:, 0] - plan.positions[:, 0], color=RECORDED, linewidth=2.5, label="robot")
        commands = execution.commands[:-1, 0, 2] - plan.positions[1:, 0]
        ax.plot(plan.times[1:], commands, color=FAULTY, linestyle="--", label="command")
        ax.axvspan(*HELD, color="0.9", linewidth=0, zorder=0, label="held")
        ax.set(title=name, ylim=(-4.2, 3.2), xlim=(0.4, plan.times[-1]))
    for ax in axes[-1]:
        ax.set_xlabel("Time [s]")
    for ax in axes[:, 0]:
        ax.set_ylabel("x off the plan [mm]")
    axes[0, 1].legend(loc="lower right", ncols=2)
    return figure


def draw_feedback_rest() -> Figure:
    """What is expected of the rest of the movement when the robot is let go."""
    models = {"The paper's model: x": (ProbabilisticDMP.as_published(), 0)}
    models |= {"The default model: x": (ProbabilisticDMP(), 0), "The default model: y": (ProbabilisticDMP(), 1)}
    figure, axes = plt.subplots(1, 3, figsize=(10, 3.2), layout="constrained", sharey=True)
    for ax, (name, (model, dof)) in zip(axes, models.items(), strict=True):
        dmp = model.fit(LETTERS)
        plan, seen = plan_of(dmp), displace(dmp, Inferred(dmp)).positions
        n_seen = int(np.searchsorted(plan.times, HELD[1]))
        seen[n_seen:] = np.nan
        expected = dmp.smooth(seen, dmp.primitive_.dt, start=seen[0], goal=dmp.primitive_.goal)
        off, half = (expected.positions - plan.positions)[:, dof], 1.96 * expected.position_stds[:, dof]
        rest = slice(n_seen - 1, None)
        ax.fill_between(plan.times[rest], (off - half)[rest], (off + half)[rest], color=BAND, linewidth=0, label="95 % band")
        ax.plot(plan.times[rest], off[rest], color=MEAN, label="expected rest")
        ax.plot(plan.times, seen[:, dof] - plan.positions[:, dof], color=RECORDED, linewidth=2.5, label="measured")
        ax.axhline(0, color=ALARM, linestyle=(0, (1, 1)), linewidth=1.2, label="plan, all that a coupling term expects")
        _mark_held(ax)
        ax.set(title=name, xlim=(0.4, plan.times[-1]), ylim=(-BY, 1.6 * BY))
    axes[0].set_ylabel("Off the plan [mm]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure
