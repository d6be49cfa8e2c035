"""All channels of the trajectory together, over recordings side by side or tick by tick."""

from collections import deque

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.path_model import PathModel
from probdmp.detection.trajectory_statistics import (
    AHEAD,
    BEFORE,
    CHANNELS,
    HORIZONS,
    LAST_STANDSTILL,
    MEMORY,
    SLOPPINESS_DELAY,
    Displacement,
    Forecast,
    Position,
    relative_to_sloppiness,
    sloppiness,
)
from probdmp.detection.windows import gather

__all__ = ["TrajectoryFollower", "TrajectoryModel", "as_suspicion"]

LARGEST_LOG_RATIO = 500.0
EVIDENCE_SCALE = 10.0
"""Nats of evidence for a standstill that multiply the value of its channel by e."""
POINTS_AHEAD = tuple(int(np.flatnonzero(horizon == AHEAD)[0]) for horizon in HORIZONS)


class TrajectoryModel:
    """What is expected of executions of one primitive, factorised once.

    Parameters
    ----------
    model : the Gaussian over paths.
    """

    def __init__(self, model: PathModel) -> None:
        self.model = model
        self.position, self.displacement, self.forecast = Position(model), Displacement(model), Forecast(model)

    def values(self, paths: FloatArray, goals: FloatArray) -> FloatArray:
        """Every channel at every tick, NaN where there is no evidence.

        Parameters
        ----------
        paths : (n, T, D) array, displacements from the start as fractions of the range; NaN where not seen.
        goals : (n, D) array, likewise; NaN where not told.

        Returns
        -------
        (n, T, C) array in the order of `CHANNELS`; the larger, the more suspicious.
        """
        means, (n, length, _) = self.model.means_for(goals), paths.shape
        ticks = np.arange(length)
        values = np.full((n, length, len(CHANNELS)), np.nan)
        values[..., 0] = self.position.judge(ticks, gather(paths, ticks, Position.offsets), means)
        squares = self.displacement.judge(ticks, gather(paths, ticks, Displacement.offsets), means)
        values[..., 1] = relative_to_sloppiness(squares)
        places = np.arange(min(length, LAST_STANDSTILL))
        evidence = self.forecast.judge(places, gather(paths, places, Forecast.offsets), means)
        for channel, (horizon, point) in enumerate(zip(HORIZONS, POINTS_AHEAD, strict=True), start=2):
            judged = max(len(places) - horizon, 0)
            values[:, horizon : horizon + judged, channel] = as_suspicion(evidence[:, :judged, point])
        return values

    def follow(self, goal: FloatArray) -> "TrajectoryFollower":
        """The same for one execution as it happens."""
        return TrajectoryFollower(self, self.model.means_for(goal[None]))


class TrajectoryFollower:
    """The channels of one execution, tick by tick; remembers `MEMORY` ticks."""

    def __init__(self, trajectory: TrajectoryModel, means: FloatArray) -> None:
        self._trajectory, self._means = trajectory, means
        self.means = means[0]
        """(M, D) array, the mean path."""
        self.recent: deque[FloatArray] = deque(maxlen=MEMORY)
        self._tick = -1
        self._squares: deque[float] = deque(maxlen=SLOPPINESS_DELAY)
        self._before = np.zeros(2)

    def update(self, displacement: FloatArray) -> FloatArray:
        """Values of all channels at the next tick, (C,) array."""
        self.remember(displacement)
        trajectory, here = self._trajectory, np.array([self._tick])
        values = np.full(len(CHANNELS), np.nan)
        values[0] = trajectory.position.judge(here, self.window(self._tick, Position.offsets), self._means)[0, 0]
        window = self.window(self._tick, Displacement.offsets)
        values[1] = self._relative(float(trajectory.displacement.judge(here, window, self._means)[0, 0]))
        for channel, (horizon, point) in enumerate(zip(HORIZONS, POINTS_AHEAD, strict=True), start=2):
            place = self._tick - horizon
            if place >= 0 and self._tick < LAST_STANDSTILL:
                window = self.window(place, Forecast.offsets[: len(BEFORE) + point + 1])
                evidence = trajectory.forecast.judge(np.array([place]), window, self._means)
                values[channel] = as_suspicion(evidence[0, 0, point])
        return values

    def remember(self, displacement: FloatArray) -> None:
        """Take in a tick (D,) without judging it."""
        self._tick += 1
        self.recent.append(displacement)

    def window(self, place: int, offsets: IntArray) -> FloatArray:
        """(1, 1, P, D) array: displacements at ticks place + offsets."""
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
