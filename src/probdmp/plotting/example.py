"""One execution as recorded and with a fault: its path in the learned band, and the test ratio of both."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from probdmp.evaluation import UNDISTURBED, Example
from probdmp.plotting.monitoring import Curve, mark_alarm, plot_test_ratios
from probdmp.plotting.panels import Panel
from probdmp.plotting.style import mark_onset
from probdmp.plotting.trajectories import plot_rollout

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["example_panels", "plot_example_path", "plot_example_ratios"]

MOST_DOFS = 6


def plot_example_path(ax: "Axes", example: Example, dof: int) -> "Axes":
    """One degree of freedom of both executions over the learned band, with the onset and the alarm."""
    plot_rollout(ax, example.rollout, dof, is_backdrop=True)
    for name, recording in example.recordings.items():
        Curve(_shown(name), recording.times, recording.positions[:, dof], name != UNDISTURBED).draw(ax)
    mark_onset(ax, example.onset)
    finding, recording = example.findings[example.fault], example.recordings[example.fault]
    if finding.alarm is not None:
        step = min(int(np.searchsorted(recording.times, finding.alarm)), recording.n_samples - 1)
        mark_alarm(ax, finding.alarm, float(recording.positions[step, dof]))
    return ax


def plot_example_ratios(ax: "Axes", example: Example) -> "Axes":
    """Test ratio of both executions, with threshold, onset and alarm."""
    curves = [
        Curve(_shown(name), finding.trace.times, finding.trace.test_ratios, name != UNDISTURBED)
        for name, finding in example.findings.items()
        if finding.trace is not None
    ]
    plot_test_ratios(ax, curves, example.onset)
    mark_alarm(ax, example.findings[example.fault].alarm, 1.0)
    ax.legend(loc="upper left")
    return ax


def example_panels(example: Example) -> list[Panel]:
    """The test ratio, then every degree of freedom, up to six."""
    names = example.rollout.names[:MOST_DOFS]
    each = [Panel(name, partial(plot_example_path, example=example, dof=dof)) for dof, name in enumerate(names)]
    return [*each, Panel("Test ratio", partial(plot_example_ratios, example=example))]


def _shown(name: str) -> str:
    return "as recorded" if name == UNDISTURBED else name
