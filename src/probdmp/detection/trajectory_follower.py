"""The channels of a trajectory while an execution goes on: the same numbers as of recordings, one tick at a time.

As long as nothing was unseen lately, everything that windows are made of is gathered at once, and multiplied by the same maps.
"""

from bisect import bisect_right
from collections import deque
from math import isnan
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.channel_statistics import ChannelStatistic
from probdmp.detection.evidence import Evidence
from probdmp.detection.movement_channels import MEMORY, MOVEMENT_CHANNELS, Horizon, as_suspicion
from probdmp.detection.path_model import PathModel
from probdmp.detection.trajectory_statistics import SLOPPINESS_DELAY, Displacement, Position, sloppiness

__all__ = ["Gathering", "Statistics", "TrajectoryFollower"]

BEFORE_ANY = -(10**9)


class Statistics(NamedTuple):
    """What is asked of a trajectory."""

    position: Position
    displacement: Displacement
    feel: tuple[ChannelStatistic, ...]
    """One for each learned channel."""
    horizons: tuple[Horizon, ...]
    """One for each further channel of the movement."""


class Gathering:
    """Where the numbers of all windows of a tick are in what is remembered: of each, one, goals ahead, and its points."""

    def __init__(self, statistics: Statistics, n_dof: int, n_signals: int) -> None:
        first, d = 1 + n_dof, n_dof
        plain = [*(np.repeat(x.offsets, d) for x in statistics[:2]), *(f.seen_at for f in statistics.feel)]
        windows = plain + [np.repeat(h.offsets - h.ticks, d) for h in statistics.horizons]
        signals = [np.arange(len(w)) % d for w in windows]
        signals[2 : 2 + len(statistics.feel)] = [f.maps.signals for f in statistics.feel]
        self.ticks = np.concatenate([np.append(np.full(first, BEFORE_ANY), w * n_signals) for w in windows])
        self.rows = np.concatenate([np.append(np.arange(first), first + s) for s in signals])
        self.moves = self.ticks > BEFORE_ANY
        ends = np.cumsum([first + len(w) for w in windows]).tolist()
        self.parts = [slice(end - first - len(w), end) for end, w in zip(ends, windows, strict=True)]


class TrajectoryFollower:
    """The channels of one execution, tick by tick; remembers `MEMORY` ticks."""

    def __init__(self, statistics: Statistics, gathering: Gathering, whole: PathModel, goal: FloatArray) -> None:
        self._trajectory, self._n_dof = statistics, whole.goal_gains.shape[-1]
        self.means = whole.means_for(goal[None])[0]
        """(M, S) array, the mean path and what channels should read."""
        self.recent: deque[FloatArray] = deque(maxlen=MEMORY)
        self._tick, self._moved_since, self._seen_since = -1, 0, 0
        self._squares: deque[float] = deque(maxlen=SLOPPINESS_DELAY)
        self._total, self._count = 0.0, 0.0
        self._n_signals = self.means.shape[1]
        self._gathering = gathering
        self._known: dict[Evidence, dict[int, FloatArray]] = {h.evidence: {} for h in statistics.horizons}
        self._affine = np.append(1.0, whole.ahead(goal[None])[0])
        self._remembered = np.zeros(len(self._affine) + 2 * MEMORY * self._n_signals)
        self._remembered[: len(self._affine)] = self._affine
        self._rows, self._oldest = self._gathering.rows, 0

    def update(self, signals: FloatArray) -> FloatArray:
        """Values of all channels at the next tick, (C,) array."""
        self.remember(signals)
        windows = self._windows()
        values = np.full(len(MOVEMENT_CHANNELS) + len(self._trajectory.feel), np.nan)
        (self._look if self._tick >= self._moved_since else self._look_at_seen)(values, windows)
        for k, statistic in enumerate(self._trajectory.feel):
            if self._tick >= self._seen_since:
                value = statistic.look(self._tick, windows[2 + k])
            else:
                window = self.signals(self._tick, statistic.offsets)
                value = float(statistic.judge(np.array([self._tick]), window, self.means[None])[0, 0])
            values[len(MOVEMENT_CHANNELS) + k] = value
        values[1] = self._relative(float(values[1]))
        n_movement = len(MOVEMENT_CHANNELS)
        values[2:n_movement] = as_suspicion(values[2:n_movement])
        return values

    def remember(self, signals: FloatArray) -> None:
        """Take in a tick (S,) without judging it."""
        self._tick += 1
        self.recent.append(signals)
        unseen = np.isnan(signals)
        if unseen.any():  # until all that is looked at was seen
            self._seen_since = self._tick + MEMORY
            if unseen[: self._n_dof].any():
                self._moved_since = self._seen_since
        s, first = self._n_signals, len(self._affine)
        if self._tick - self._oldest == 2 * MEMORY:
            kept = self._remembered[first + (MEMORY + 1) * s :].copy()
            self._remembered[first : first + len(kept)] = kept
            self._oldest += MEMORY + 1
            self._rows = self._gathering.rows - self._oldest * s * self._gathering.moves
        at = first + (self._tick - self._oldest) * s
        self._remembered[at : at + s] = signals

    def window(self, place: int, offsets: IntArray) -> FloatArray:
        """(1, 1, P, D) array: displacements at ticks place + offsets."""
        return self.signals(place, offsets)[..., : self._n_dof]

    def signals(self, place: int, offsets: IntArray) -> FloatArray:
        """(1, 1, P, S) array: displacements and channels at ticks place + offsets."""
        oldest = self._tick - len(self.recent) + 1
        ticks = np.maximum(place + offsets, 0) - oldest
        return np.stack([self.recent[int(i)] for i in ticks])[None, None]

    def _windows(self) -> list[FloatArray]:
        """What is looked at now, in the order of `Gathering`."""
        rows = np.maximum(self._gathering.ticks + self._tick * self._n_signals, 0)
        rows += self._rows
        gathered = self._remembered.take(rows)
        return [gathered[part] for part in self._gathering.parts]

    def _look(self, values: FloatArray, windows: list[FloatArray]) -> None:
        """What channels of the movement say: evidence as it is, displacement not yet relative."""
        position, displacement, feel, horizons = self._trajectory
        values[0], values[1] = position.look(self._tick, windows[0]), displacement.look(self._tick, windows[1])
        first = 0
        while first < len(horizons):
            channel, evidence, ticks, _ = horizons[first]
            if ticks <= self._tick <= evidence.last:
                begin, reached = 2 + len(feel) + first, bisect_right(evidence.horizons, self._tick)
                found = evidence.look(self._tick, windows[begin : begin + reached], self._known[evidence])
                values[channel : channel + reached] = found
            first += len(evidence.horizons)

    def _look_at_seen(self, values: FloatArray, windows: list[FloatArray]) -> None:
        """The same by what was seen, where something was not."""
        position, displacement, _, horizons = self._trajectory
        here, means = np.array([self._tick]), self.means[None, :, : self._n_dof]
        values[0] = position.judge(here, self.window(self._tick, position.offsets), means)[0, 0]
        values[1] = displacement.judge(here, self.window(self._tick, displacement.offsets), means)[0, 0]
        for channel, evidence, ticks, offsets in horizons:
            place = self._tick - ticks
            if place >= 0 and self._tick <= evidence.last:
                values[channel] = evidence.judge(np.array([place]), self.window(place, offsets), means)[0, 0, -1]

    def _relative(self, square: float) -> float:
        if len(self._squares) == SLOPPINESS_DELAY:
            oldest = self._squares[0]
            if not isnan(oldest):
                self._total, self._count = self._total + oldest, self._count + 1.0
        self._squares.append(square)
        return square / float(sloppiness(self._total, self._count))
