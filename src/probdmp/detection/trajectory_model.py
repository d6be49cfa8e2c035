"""All channels of the trajectory together, over recordings side by side or tick by tick."""

from collections import deque
from itertools import groupby
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.channel_statistics import ChannelStatistic
from probdmp.detection.evidence import EVIDENCE, Evidence
from probdmp.detection.path_model import PathModel
from probdmp.detection.trajectory_statistics import (
    SLOPPINESS_DELAY,
    Displacement,
    Position,
    relative_to_sloppiness,
    sloppiness,
)
from probdmp.detection.windows import gather

__all__ = [
    "MEMORY",
    "MOVEMENT_CHANNELS",
    "TrajectoryFollower",
    "TrajectoryModel",
    "as_suspicion",
    "channels_for",
]

MOVEMENT_CHANNELS = ("position", "displacement", *(f"{kind.name}_{horizon}" for kind in EVIDENCE for horizon in kind.horizons))
MOVEMENT_FLOORS = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0])
"""Values up to which a channel is not suspicious: a standstill has to be likelier than its contrary."""
MOVEMENT_HANDICAPS = np.array([2.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0])
"""Nats of surprise by which a channel stands back behind displacement. What the others are for, a movement that ends elsewhere
or stands still, becomes plain sooner or later; a push passes, and the false alarms that may be had are better spent on it."""
FEEL_HANDICAP = 1.0
"""The same of what learned channels, or sensors of other kinds, say."""
MEMORY = max(int(kind.before.max()) + max(kind.horizons) for kind in EVIDENCE) + 1
"""Ticks that have to be remembered while executing."""

LARGEST_LOG_RATIO = 500.0
EVIDENCE_SCALE = 10.0
"""Nats of evidence that multiply the value of a channel by e."""


def channels_for(names: tuple[str, ...]) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Names, floors and handicaps of the channels of a movement with these further ones."""
    floors = np.concatenate([MOVEMENT_FLOORS, np.zeros(len(names))])
    return (*MOVEMENT_CHANNELS, *names), floors, np.concatenate([MOVEMENT_HANDICAPS, np.full(len(names), FEEL_HANDICAP)])


class Horizon(NamedTuple):
    """A channel that asks what has happened since a place some ticks ago."""

    channel: int
    evidence: Evidence
    ticks: int
    """Since the place."""
    offsets: IntArray
    """Ticks of the points that it looks at, relative to the place; the last is now."""


class TrajectoryModel:
    """What is expected of executions of one primitive, factorised once.

    Parameters
    ----------
    whole : the Gaussian over paths and learned channels.
    """

    def __init__(self, whole: PathModel) -> None:
        self._whole, self.model = whole, whole.of_movement()
        model, self._n_dof = self.model, self.model.means.shape[1]
        self.feel = tuple(ChannelStatistic(whole, signal) for signal in range(self._n_dof, whole.means.shape[1]))
        """One statistic for each learned channel."""
        self.position, self.displacement = Position(model), Displacement(model)
        questions = [(evidence, ticks) for evidence in [kind(model) for kind in EVIDENCE] for ticks in evidence.horizons]
        self.horizons = tuple(
            Horizon(channel, evidence, ticks, np.concatenate([-evidence.before, evidence.ahead[evidence.ahead <= ticks]]))
            for channel, (evidence, ticks) in enumerate(questions, start=2)
        )
        """The channels after position and displacement."""

    def values(self, paths: FloatArray, goals: FloatArray) -> FloatArray:
        """Every channel at every tick, NaN where there is no evidence.

        Parameters
        ----------
        paths : (n, T, S) array, displacements from the start and channels as fractions of the range; NaN where not seen.
        goals : (n, D) array, likewise; NaN where not told.

        Returns
        -------
        (n, T, C) array in the order of `channels_for`; the larger, the more suspicious.
        """
        whole, (n, length, _) = self._whole.means_for(goals), paths.shape
        ticks, n_movement = np.arange(length), len(MOVEMENT_CHANNELS)
        values = np.full((n, length, n_movement + len(self.feel)), np.nan)
        for channel, statistic in enumerate(self.feel, start=n_movement):
            values[..., channel] = statistic.judge(ticks, gather(paths, ticks, statistic.offsets), whole)
        means, paths = whole[..., : self._n_dof], paths[..., : self._n_dof]
        values[..., 0] = self.position.judge(ticks, gather(paths, ticks, Position.offsets), means)
        squares = self.displacement.judge(ticks, gather(paths, ticks, Displacement.offsets), means)
        values[..., 1] = relative_to_sloppiness(squares)
        for evidence, horizons in groupby(self.horizons, key=attrgetter("evidence")):
            places = np.arange(max(min(length, evidence.last + 1) - evidence.horizons[0], 0))
            found = evidence.judge(places, gather(paths, places, np.concatenate([-evidence.before, evidence.ahead])), means)
            for horizon in horizons:
                judged = max(min(length, evidence.last + 1) - horizon.ticks, 0)
                point = len(horizon.offsets) - len(evidence.before) - 1
                values[:, horizon.ticks : horizon.ticks + judged, horizon.channel] = as_suspicion(found[:, :judged, point])
        return values

    def follow(self, goal: FloatArray) -> "TrajectoryFollower":
        """The same for one execution as it happens."""
        return TrajectoryFollower(self, self._whole.means_for(goal[None]))


class TrajectoryFollower:
    """The channels of one execution, tick by tick; remembers `MEMORY` ticks."""

    def __init__(self, trajectory: TrajectoryModel, means: FloatArray) -> None:
        d = trajectory.model.means.shape[1]
        self._trajectory, self._means, self._n_dof = trajectory, means[..., :d], d
        self.means = means[0]
        """(M, S) array, the mean path and what channels should read."""
        self.recent: deque[FloatArray] = deque(maxlen=MEMORY)
        self._tick = -1
        self._squares: deque[float] = deque(maxlen=SLOPPINESS_DELAY)
        self._before = np.zeros(2)

    def update(self, signals: FloatArray) -> FloatArray:
        """Values of all channels at the next tick, (C,) array."""
        self.remember(signals)
        trajectory, here, n_movement = self._trajectory, np.array([self._tick]), len(MOVEMENT_CHANNELS)
        values = np.full(n_movement + len(trajectory.feel), np.nan)
        for channel, statistic in enumerate(trajectory.feel, start=n_movement):
            values[channel] = statistic.judge(here, self.signals(self._tick, statistic.offsets), self.means[None])[0, 0]
        values[0] = trajectory.position.judge(here, self.window(self._tick, Position.offsets), self._means)[0, 0]
        window = self.window(self._tick, Displacement.offsets)
        values[1] = self._relative(float(trajectory.displacement.judge(here, window, self._means)[0, 0]))
        for channel, evidence, ticks, offsets in trajectory.horizons:
            place = self._tick - ticks
            if place >= 0 and self._tick <= evidence.last:
                found = evidence.judge(np.array([place]), self.window(place, offsets), self._means)
                values[channel] = as_suspicion(found[0, 0, -1])
        return values

    def remember(self, signals: FloatArray) -> None:
        """Take in a tick (S,) without judging it."""
        self._tick += 1
        self.recent.append(signals)

    def window(self, place: int, offsets: IntArray) -> FloatArray:
        """(1, 1, P, D) array: displacements at ticks place + offsets."""
        return self.signals(place, offsets)[..., : self._n_dof]

    def signals(self, place: int, offsets: IntArray) -> FloatArray:
        """(1, 1, P, S) array: displacements and channels at ticks place + offsets."""
        oldest = self._tick - len(self.recent) + 1
        ticks = np.maximum(place + offsets, 0) - oldest
        return np.stack([self.recent[int(i)] for i in ticks])[None, None]

    def _relative(self, square: float) -> float:
        if len(self._squares) == SLOPPINESS_DELAY:
            oldest = self._squares[0]
            if not np.isnan(oldest):
                self._before += (oldest, 1.0)
        self._squares.append(square)
        return float(square / sloppiness(*self._before))


def as_suspicion(evidence: FloatArray) -> FloatArray:
    """Nats of evidence as a positive number with a tail like those of squared distances."""
    return np.exp(np.clip(evidence, -LARGEST_LOG_RATIO, LARGEST_LOG_RATIO) / EVIDENCE_SCALE)
