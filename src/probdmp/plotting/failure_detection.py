"""The paper's figure: an execution as recorded, the same one blocked, and the log-likelihood of both."""

from functools import partial
from typing import TYPE_CHECKING

from probdmp.evaluation import Illustration, JudgedExecution
from probdmp.plotting.monitoring import Curve, mark_alarm, plot_log_likelihoods
from probdmp.plotting.panels import Panel
from probdmp.plotting.style import legend_beside
from probdmp.plotting.trajectories import plot_rollout

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["failure_detection_panels", "plot_illustrated_likelihoods", "plot_judged_execution"]


def plot_judged_execution(ax: "Axes", illustration: Illustration, judged: JudgedExecution, dof: int) -> "Axes":
    """One degree of freedom of an execution over the learned band, with its alarm if there was one."""
    plot_rollout(ax, illustration.rollout, dof, is_backdrop=True)
    recording, faulty = judged.recording, judged is illustration.disturbed
    shown = [each.recording.positions[:, dof] for each in (illustration.undisturbed, illustration.disturbed)]
    lowest, highest = min(map(min, shown)), max(map(max, shown))
    ax.set_ylim(min(ax.get_ylim()[0], lowest), max(ax.get_ylim()[1], highest))  # the same for both executions
    Curve(illustration.fault if faulty else "as recorded", recording.times, recording.positions[:, dof], faulty).draw(ax)
    if judged.verdict.failed:
        mark_alarm(ax, judged.verdict.time, float(recording.positions[judged.verdict.step, dof]))
    return ax


def plot_illustrated_likelihoods(ax: "Axes", illustration: Illustration) -> "Axes":
    """Log-likelihood of both executions over time, with the threshold and the onset of the fault."""
    curves = [
        Curve(name, judged.recording.times, judged.statistic, judged is illustration.disturbed)
        for judged, name in ((illustration.undisturbed, "as recorded"), (illustration.disturbed, illustration.fault))
    ]
    plot_log_likelihoods(ax, curves, illustration.level, illustration.onset)
    verdict = illustration.disturbed.verdict
    if verdict.failed:
        mark_alarm(ax, verdict.time, float(illustration.disturbed.statistic[verdict.step]))
    legend_beside(ax)
    return ax


def failure_detection_panels(illustration: Illustration) -> list[Panel]:
    """The paper's figure: undisturbed, disturbed, log-likelihoods; of the degree of freedom that is blamed."""
    dof = int(illustration.disturbed.verdict.contributions.argmin())
    both = {"As recorded": illustration.undisturbed, f"With the fault “{illustration.fault}”": illustration.disturbed}
    return [
        *(Panel(title, partial(plot_judged_execution, illustration=illustration, judged=judged, dof=dof), 3.7, 3.2)
          for title, judged in both.items()),
        Panel("Log-likelihood", partial(plot_illustrated_likelihoods, illustration=illustration), 4.8, 3.2),
    ]  # fmt: skip
