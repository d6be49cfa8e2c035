"""What pictures over time show, as plain values by name: for viewers that draw by themselves."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.demonstrations import Demonstration
from probdmp.evaluation import JudgedExecution
from probdmp.execution import GaussianTrajectory
from probdmp.plotting.style import FAULTY, MEAN, RECORDED, axis_label
from probdmp.plotting.trajectories import QUANTITIES

__all__ = [
    "HALF_WIDTH",
    "Event",
    "Timelines",
    "Track",
    "monitored_timelines",
    "nanoseconds_of",
    "rollout_timelines",
    "smoothing_timelines",
]

HALF_WIDTH = 2.0
"""Standard deviations from the mean to `lower` and `upper`."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Values that are known at the same times."""

    name: str
    """Such as `planned/x`."""
    times: FloatArray
    """(T,) array, seconds from the start."""
    columns: Mapping[str, FloatArray]
    """(T,) arrays by name, such as mean, lower, upper; what is not finite is not known."""
    view: str
    """What it is seen together with, with its unit: `x position [m]`."""
    color: str = MEAN

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", MappingProxyType(dict(self.columns)))

    def rows(self) -> Iterator[tuple[int, dict[str, float]]]:
        """Nanoseconds and what is known then, time by time; times at which nothing is known are left out."""
        for k, nanoseconds in enumerate(nanoseconds_of(self.times).tolist()):
            known = {name: float(values[k]) for name, values in self.columns.items() if np.isfinite(values[k])}
            if known:
                yield nanoseconds, known


@dataclass(frozen=True, slots=True)
class Event:
    """Something to be told at a time."""

    time: float
    """Seconds from the start."""
    text: str
    level: str
    """`"info"`, `"warning"` or `"error"`."""


@dataclass(frozen=True, slots=True, eq=False)
class Timelines:
    """Tracks and events of one execution or plan."""

    tracks: tuple[Track, ...]
    events: tuple[Event, ...] = ()
    heading: str = ""


def nanoseconds_of(times: FloatArray) -> IntArray:
    """(T,) array of whole numbers from (T,) seconds."""
    return np.asarray(np.rint(times * 1e9), dtype=np.int64)


def monitored_timelines(rollout: GaussianTrajectory, judged: JudgedExecution, onset: float | None = None) -> Timelines:
    """What `probdmp.plotting.monitoring.monitoring_panels` draws: plan and execution, log-likelihood, test ratio and verdict.

    Parameters
    ----------
    rollout : the plan of the same task.
    onset : seconds, if a fault began.
    """
    recording, verdict = judged.recording, judged.verdict
    likelihood = {"value": judged.statistic} | _constant("level", judged.level, len(judged.statistic))
    ratios = {"value": judged.test_ratios} | _constant("threshold", 1.0, len(judged.test_ratios))
    events = [] if onset is None else [Event(onset, "onset of the fault", "warning")]
    events.append(Event(verdict.time, str(verdict), "error" if verdict.failed else "info"))
    return Timelines(
        (
            *_bands("planned", rollout),
            *_measured(recording, rollout),
            Track("log_likelihood", recording.times, likelihood, "Log-likelihood per step [nats]", RECORDED),
            Track("test_ratio", recording.times, ratios, "Test ratio", RECORDED),
        ),
        tuple(sorted(events, key=lambda event: event.time)),
    )


def rollout_timelines(rollout: GaussianTrajectory) -> Timelines:
    """Mean and band of position, velocity and acceleration, and of channels."""
    tracks = [
        _band(f"{quantity}/{name}", rollout, d, quantity) for quantity in QUANTITIES for d, name in enumerate(rollout.names)
    ]
    return Timelines((*tracks, *_channel_bands("channel", rollout)))


def smoothing_timelines(recording: Demonstration, filtered: GaussianTrajectory, smoothed: GaussianTrajectory) -> Timelines:
    """What was measured, and the state as filtered and in hindsight."""
    both = (*_bands("filtered", filtered, FAULTY), *_bands("smoothed", smoothed))
    return Timelines((*_measured(recording, smoothed), *both))


def _bands(prefix: str, trajectory: GaussianTrajectory, color: str = MEAN) -> list[Track]:
    own = [_band(f"{prefix}/{name}", trajectory, d, "position", color) for d, name in enumerate(trajectory.names)]
    return own + _channel_bands(prefix, trajectory, color)


def _band(name: str, trajectory: GaussianTrajectory, dof: int, quantity: str, color: str = MEAN) -> Track:
    means, stds, per = QUANTITIES[quantity]
    view = axis_label(f"{trajectory.names[dof]} {quantity}", trajectory.units, per)
    columns = _around(getattr(trajectory, means)[:, dof], getattr(trajectory, stds)[:, dof])
    return Track(name, trajectory.times, columns, view, color)


def _channel_bands(prefix: str, trajectory: GaussianTrajectory, color: str = MEAN) -> list[Track]:
    return [
        Track(f"{prefix}/{name}", trajectory.times, _around(channel.means, channel.stds), name, color)
        for name, channel in trajectory.channels.items()
    ]


def _measured(recording: Demonstration, trajectory: GaussianTrajectory) -> list[Track]:
    """Positions, and those channels that something is expected of."""
    positions = [
        Track(
            f"measured/{name}",
            recording.times,
            {"value": recording.positions[:, d]},
            axis_label(f"{name} position", trajectory.units),
            RECORDED,
        )
        for d, name in enumerate(trajectory.names)
    ]
    channels = [
        Track(f"measured/{name}", recording.times, {"value": recording.channels[name]}, name, RECORDED)
        for name in trajectory.channels
        if name in recording.channels
    ]
    return positions + channels


def _around(means: FloatArray, stds: FloatArray) -> dict[str, FloatArray]:
    return {"mean": means, "lower": means - HALF_WIDTH * stds, "upper": means + HALF_WIDTH * stds}


def _constant(name: str, value: float | None, count: int) -> dict[str, FloatArray]:
    return {} if value is None else {name: np.full(count, value)}
