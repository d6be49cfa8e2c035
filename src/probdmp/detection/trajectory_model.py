"""All channels of the trajectory together, over recordings side by side or tick by tick."""

from collections.abc import Callable
from functools import cached_property
from itertools import groupby, pairwise, starmap
from operator import attrgetter
from typing import Protocol

import numpy as np

from probdmp.checks import BoolArray, FloatArray, IntArray
from probdmp.detection.channel_statistics import ChannelStatistic
from probdmp.detection.evidence import EVIDENCE
from probdmp.detection.movement_channels import (
    LARGEST_LOG_RATIO,
    MEMORY,
    MOVEMENT_CHANNELS,
    MOVEMENT_FLOORS,
    MOVEMENT_HANDICAPS,
    Horizon,
    as_suspicion,
    as_values,
    channels_for,
)
from probdmp.detection.path_model import PathModel
from probdmp.detection.trajectory_follower import Gathering, Statistics, TrajectoryFollower
from probdmp.detection.trajectory_statistics import Displacement, Position, make_relative
from probdmp.detection.window_maps import Needed, WindowInputs
from probdmp.detection.windows import gather

__all__ = [
    "LARGEST_LOG_RATIO",
    "MEMORY",
    "MOVEMENT_CHANNELS",
    "MOVEMENT_FLOORS",
    "MOVEMENT_HANDICAPS",
    "TrajectoryFollower",
    "TrajectoryModel",
    "as_suspicion",
    "as_values",
    "channels_for",
]

SIDE_BY_SIDE = 520
"""Executions that are judged side by side, about: so many that calls do not count, so few that their numbers stay at hand. Not
a power of two, or the numbers of one window would all compete for the same few places of the cache."""


WhatMatters = Callable[[FloatArray], Needed]
"""Given the highest evidence of each channel so far, (C, n), NaN where it is not known."""


class Judge(Protocol):
    """A statistic of windows, one at each tick."""

    offsets: IntArray

    def weigh(self, inputs: WindowInputs, length: int) -> FloatArray: ...

    def judge(self, ticks: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray: ...


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
        further = enumerate(self.feel, len(MOVEMENT_CHANNELS))
        self._plain: list[tuple[int, Judge]] = [(0, self.position), (1, self.displacement), *further]
        questions = [(evidence, ticks) for evidence in [kind(model) for kind in EVIDENCE] for ticks in evidence.horizons]
        self.horizons = tuple(
            Horizon(channel, evidence, ticks, np.concatenate([-evidence.before, evidence.ahead[evidence.ahead <= ticks]]))
            for channel, (evidence, ticks) in enumerate(questions, start=2)
        )
        """The channels after position and displacement."""
        self._questions = [(evidence, tuple(own)) for evidence, own in groupby(self.horizons, key=attrgetter("evidence"))]

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
        counts = np.full(len(paths), paths.shape[1])
        return as_values(self.evidence(paths.transpose(1, 2, 0), counts, goals, all_of_it)).transpose(2, 1, 0)

    def evidence(self, paths: FloatArray, counts: IntArray, goals: FloatArray, needed: WhatMatters) -> FloatArray:
        """The same before `as_values`, with executions innermost: from paths (T, S, n) to (C, T, n).

        Parameters
        ----------
        counts : (n,) array: ticks of each execution; there is no evidence after them.
        needed : of what weighs two accounts.
        """
        n = paths.shape[-1]
        evidence = np.empty((len(MOVEMENT_CHANNELS) + len(self.feel), len(paths), n))
        edges = np.linspace(0, n, max(round(n / SIDE_BY_SIDE), 1) + 1).astype(int).tolist()
        for part in starmap(slice, pairwise(edges)):
            self._weigh(paths[..., part], counts[part], goals[part], needed, evidence[..., part])
        return evidence

    def _weigh(self, paths: FloatArray, counts: IntArray, goals: FloatArray, needed: WhatMatters, values: FloatArray) -> None:
        """The same of some of them, into values (C, T, n)."""
        unseen, length = np.asarray(np.isnan(paths)), len(paths)
        is_lossy, is_over = unseen.any(), np.arange(length)[:, None] >= counts
        inputs = WindowInputs.of(np.where(unseen, 0.0, paths) if is_lossy else paths, self._whole.ahead(goals).T)
        means = self._whole.means_for(goals) if is_lossy else None
        for channel, statistic in self._plain:
            values[channel] = statistic.weigh(inputs, length)
        if means is not None:
            self._judge_again(values, paths, unseen, means)
        make_relative(values[1])
        highest = np.full((len(values), len(counts)), np.nan)
        for channel, _ in self._plain:
            values[channel, is_over] = np.nan
            highest[channel] = np.fmax.reduce(values[channel], initial=np.nan)
        least = needed(highest)
        if is_lossy:  # what is found of windows with zeros in place of what was not seen must not hide what is found of others
            least = least._replace(limits=np.full_like(least.limits, -np.inf))
        for evidence, horizons in self._questions:
            wanted = np.maximum(min(length, evidence.last + 1) - np.array(evidence.horizons), 0)
            own = least.of([horizon.channel for horizon in horizons])
            nothing = [np.empty((0, len(counts)))] * len(horizons)
            for horizon, found in zip(horizons, evidence.weigh(inputs, wanted, own) if wanted[0] else nothing, strict=True):
                weighed, until = values[horizon.channel], horizon.ticks + len(found)
                weighed[: horizon.ticks], weighed[horizon.ticks : until], weighed[until:] = np.nan, found, np.nan
        if means is not None:
            self._weigh_again(values, paths, unseen, means)
        values[:, is_over] = np.nan

    def _judge_again(self, values: FloatArray, paths: FloatArray, unseen: BoolArray, means: FloatArray) -> None:
        """Judge windows of which something was not seen by what was seen of them."""
        d, n_movement = self._n_dof, len(MOVEMENT_CHANNELS)
        for k in np.flatnonzero(unseen.any(axis=(0, 1))):
            for channel, statistic in self._plain:
                s = d if channel < n_movement else paths.shape[1]
                path, mean = paths[None, :, :s, k], means[k : k + 1, :, :s]
                at = _places(np.asarray(unseen[:, :s, k].any(axis=1)), statistic.offsets, len(paths))
                values[channel, at, k] = statistic.judge(at, gather(path, at, statistic.offsets), mean)[0]

    def _weigh_again(self, values: FloatArray, paths: FloatArray, unseen: BoolArray, means: FloatArray) -> None:
        """The same of what weighs two accounts."""
        d = self._n_dof
        for k in np.flatnonzero(unseen[:, :d].any(axis=(0, 1))):
            path, mean, moved = paths[None, :, :d, k], means[k : k + 1, :, :d], np.asarray(unseen[:, :d, k].any(axis=1))
            for evidence, horizons in self._questions:
                last, offsets = min(len(paths), evidence.last + 1), np.concatenate([-evidence.before, evidence.ahead])
                at = _places(moved, offsets, max(last - evidence.horizons[0], 0))
                found = evidence.judge(at, gather(path, at, offsets), mean)[0]
                for horizon in horizons:
                    judged = at + horizon.ticks < last
                    values[horizon.channel, at[judged] + horizon.ticks, k] = found[judged, horizon.point]

    def means_at(self, ticks: IntArray, goals: FloatArray) -> FloatArray:
        """What is expected at ticks (n, P) of executions with goals (n, D), of movement and channels: (n, P, S) array."""
        return self._whole.means_at(ticks, goals)

    def prepare(self) -> None:
        """Compute now what the first ticks of an execution would otherwise have to wait for."""
        _ = self._asked
        for evidence, _ in self._questions:
            evidence.prepare()

    def follow(self, goal: FloatArray) -> "TrajectoryFollower":
        """The same for one execution as it happens."""
        return TrajectoryFollower(*self._asked, self._whole, goal)

    @cached_property
    def _asked(self) -> tuple[Statistics, Gathering]:
        statistics = Statistics(self.position, self.displacement, self.feel, self.horizons)
        return statistics, Gathering(statistics, self._n_dof, self._whole.means.shape[1])


def all_of_it(highest: FloatArray) -> Needed:
    """All evidence matters."""
    return Needed(np.full_like(highest, -np.inf), np.full(len(highest), -np.inf))


def _places(lost: BoolArray, offsets: IntArray, count: int) -> IntArray:
    """Which of the first places have a window in which something is lost, out of what is lost of a path, (T,)."""
    return np.flatnonzero(lost[np.clip(np.arange(count)[:, None] + offsets, 0, len(lost) - 1)].any(axis=1))
