"""Recorded executions as a page shows them."""

from typing import Any

from probdmp.demonstrations import Demonstration
from probdmp.evaluation import JudgedExecution
from probdmp.execution import GaussianTrajectory, TrackedTrajectory
from probdmp.io.plain_values import plain
from probdmp.plotting.trajectories import evenly_spaced
from probdmp.studio.bands import band_of
from probdmp.studio.views import verdict_view

__all__ = ["compared_view", "replayed_view"]

MOST_TIMES = 1000


def replayed_view(
    label: str, recording: Demonstration, tracked: TrackedTrajectory, judged: JudgedExecution | None
) -> dict[str, Any]:
    """What the filter and the detector made of an execution, for the scrubber."""
    chosen = evenly_spaced(recording.n_samples, MOST_TIMES)
    return plain(
        {
            "type": "replayed",
            "label": label,
            "times": recording.times[chosen],
            "positions": recording.positions[chosen],
            "log_likelihoods": tracked.log_likelihoods[chosen],
            "test_ratios": None if judged is None else judged.test_ratios[chosen],
            "contributions": tracked.contributions[chosen],
            "names": tracked.outputs,
            "verdict": verdict_view(None if judged is None else judged.verdict),
        }
    )


def compared_view(
    label: str, recording: Demonstration, tracked: TrackedTrajectory, smoothed: GaussianTrajectory
) -> dict[str, Any]:
    """An execution as recorded, as filtered, and in hindsight."""
    chosen = evenly_spaced(recording.n_samples, MOST_TIMES)
    bands = {
        name: band_of(band.positions[chosen], band.position_stds[chosen])
        for name, band in (("filtered", tracked), ("smoothed", smoothed))
    }
    recorded = {"label": label, "times": recording.times[chosen], "recorded": recording.positions[chosen]}
    return plain({"type": "compared", **recorded, **bands})
