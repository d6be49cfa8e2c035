"""From the values of several channels to one surprise, and from a false-alarm rate to its threshold.

    of each calibration execution i and channel c the largest value x_ic over its whole length
    surprise of a value a in channel c   L_c(a) = -ln (share of executions that ever reach a),
                                         by rank up to the 90 % quantile u, beyond it by a Pareto tail: ln(a / u) / z more
    statistic                            T[t] = max_c (L_c(a_c[t]) - handicap_c)
    threshold                            h with a share alpha of executions whose largest T_i exceeds it

Some primitives vary more than the model says and would take more than their share of the false alarms. One with more executions
among the most surprising tenth than chance explains is a suspect, and so is one whose T_i rank higher than chance explains
(rank-sum); its threshold is no lower than its own largest T_i.

alpha counts executions, not ticks. With alpha (n + 1) >= 5 the threshold is an order statistic of the n values T_i
(conformal); below that it lies on an exponential tail fitted to those above their 80 % quantile. n executions can show no
rate below 1 / (n + 1).
Sources: Vovk, Gammerman & Shafer, Algorithmic Learning in a Random World; Hill, Annals of Statistics 3 (1975).
"""

from bisect import bisect_left
from collections.abc import Sequence
from functools import cached_property
from math import log

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import FloatArray
from probdmp.errors import InputError

__all__ = ["CALIBRATIONS", "Calibration"]

CALIBRATIONS = ("leave_one_out", "held_out")
TAIL_SHARE = 0.1
"""Of the executions, in the tail of each channel."""
TAIL_PRIOR, TAIL_PRIOR_COUNT = 0.2, 5
"""Exponent z of so many executions that are taken to lie in the tail of every channel beside those that do: a few of them may
be one wild one."""
STATISTIC_TAIL_SHARE = 0.2
ENOUGH = 5.0
"""Calibration executions expected above a threshold that is one of them."""
ROUNDING = 1e-9
SUSPICIOUS_SHARE = 0.1
"""The most surprising executions of all; those of one primitive should not be many among them."""
SUSPECT = 0.1
"""A primitive is flagged where chance alone would do so less often than this, by either of two tests."""


class Calibration:
    """What is normal for a library of primitives, at one false-alarm rate.

    Parameters
    ----------
    maxima : (n, C) array: largest value of every channel over each calibration execution; NaN where there was no evidence.
    labels : (n) which primitive each execution was of.
    false_alarm_rate : alpha, of executions, in (0, 1).
    method : a name from `CALIBRATIONS`: where the executions come from.
    floors : (C,) array: up to these values nothing is suspicious.
    handicaps : (C,) array, nats: how far each channel stands back behind the others.
    """

    def __init__(
        self,
        maxima: FloatArray,
        labels: Sequence[str],
        false_alarm_rate: float,
        method: str,
        floors: FloatArray | float = 0.0,
        handicaps: FloatArray | float = 0.0,
    ) -> None:
        self.maxima, self.labels = np.nan_to_num(maxima), tuple(labels)
        self.false_alarm_rate, self.method = false_alarm_rate, method
        if len(self.maxima) < 2 or len(self.maxima) != len(self.labels):
            raise InputError("at least two calibration executions, each with a label", f"{len(self.maxima)}")
        self._sorted = np.ascontiguousarray(np.sort(self.maxima, axis=0).T)  # (C, n)
        self._handicaps = np.broadcast_to(handicaps, self.maxima.shape[1:])
        self._floors = np.broadcast_to(floors, self.maxima.shape[1:])
        least = np.maximum(self._floors, np.finfo(float).tiny)
        self._starts = np.maximum(np.quantile(self.maxima, 1 - TAIL_SHARE, axis=0), least)
        beyond = self.maxima > self._starts
        excesses = np.where(beyond, np.log(np.maximum(self.maxima, self._starts) / self._starts), 0.0)
        self._exponents = (excesses.sum(axis=0) + TAIL_PRIOR_COUNT * TAIL_PRIOR) / (beyond.sum(axis=0) + TAIL_PRIOR_COUNT)
        self._tail_surprises = -np.log((beyond.sum(axis=0) + 1) / (self.n + 1))
        by_rank = -np.log(np.arange(self.n + 1, 0, -1) / (self.n + 1))
        self._by_rank = np.minimum(by_rank, self._tail_surprises[:, None])
        """(C, n + 1) array: surprise of what exceeds so many of the maxima."""
        by_channel = self._starts, self._tail_surprises, self._exponents, self._handicaps
        self._known = list(zip(self._sorted.tolist(), *(numbers.tolist() for numbers in by_channel), strict=True))
        """Of each channel, as `_surprise_now` takes it."""
        self.statistics = self.surprise(self.maxima).max(axis=-1)
        self.threshold, self.is_conformal = self._threshold()

    @property
    def n(self) -> int:
        """Calibration executions."""
        return len(self.maxima)

    @property
    def attainable_rate(self) -> float:
        """Least false-alarm rate that n executions can vouch for, 1 / (n + 1)."""
        return 1 / (self.n + 1)

    @property
    def guarantee(self) -> str:
        """How far the false-alarm rate may be trusted, in words."""
        if self.false_alarm_rate < self.attainable_rate:
            return "model-based, not guaranteed"
        if self.method == "leave_one_out":
            return "empirical"
        return "conformal" if self.is_conformal else "model-based, not guaranteed"

    @cached_property
    def suspects(self) -> dict[str, float]:
        """Primitives that may raise more alarms than the others: label to the share of its executions in the common tail."""
        if len(set(self.labels)) < 2:  # nobody takes a share from others
            return {}
        share = max(self.false_alarm_rate, SUSPICIOUS_SHARE)
        in_tail = self.statistics > np.quantile(self.statistics, 1 - share)
        of_each = {label: np.array([own == label for own in self.labels]) for label in sorted(set(self.labels))}
        chances = {
            label: min(self._chance_in_tail(own & in_tail, own, share), self._chance_of_ranks(own))
            for label, own in of_each.items()
        }
        return {label: float(in_tail[own].mean()) for label, own in of_each.items() if chances[label] < SUSPECT / 2}

    @cached_property
    def own_thresholds(self) -> dict[str, float]:
        """Thresholds of the suspects: no lower than what their own calibration executions have reached."""
        own = {label: [t for k, t in zip(self.labels, self.statistics, strict=True) if k == label] for label in self.suspects}
        return {label: max(self.threshold, *map(float, statistics)) for label, statistics in own.items()}

    def threshold_for(self, label: str) -> float:
        """The threshold of a primitive: the common one, unless it is suspected to need a higher one."""
        return self.own_thresholds.get(label, self.threshold)

    def at_rate(self, false_alarm_rate: float) -> "Calibration":
        """The same calibration executions at another false-alarm rate."""
        return Calibration(self.maxima, self.labels, false_alarm_rate, self.method, self._floors, self._handicaps)

    def surprise(self, values: FloatArray) -> FloatArray:
        """-ln of the share of normal executions that ever reach values (…, C), by channel, less its handicap; at least 0."""
        given = np.asarray(values, dtype=np.float64)
        return np.stack([self.surprise_of(channel, given[..., channel]) for channel in range(given.shape[-1])], axis=-1)

    def surprise_of(self, channel: int, values: FloatArray) -> FloatArray:
        """The same for values (…) of one channel."""
        start, tail_surprise = self._starts[channel], self._tail_surprises[channel]
        filled = np.minimum(np.where(np.isnan(values), 0.0, values), np.finfo(float).max)
        by_rank = self._by_rank[channel][np.searchsorted(self._sorted[channel], filled, "left")]
        tail = np.log(np.maximum(filled, start) / start) / self._exponents[channel]
        surprises = np.where(filled > start, tail_surprise + tail, by_rank)
        return np.asarray(np.maximum(surprises - self._handicaps[channel], 0.0))

    def least_values(self, surprises: FloatArray) -> FloatArray:
        """(…, C) array: values below which no channel can be as surprising as given (…), safely rounded down."""
        wanted = np.asarray(surprises)[..., None] * (1 - ROUNDING) - ROUNDING + self._handicaps
        tail = self._starts * np.exp((wanted - self._tail_surprises) * self._exponents) * (1 - ROUNDING)
        # -ln ((ranks + 1) / (n + 1)) >= wanted
        ranks = np.floor((self.n + 1) * np.exp(-wanted) * (1 + ROUNDING)).astype(np.int64) - 1
        places = self.n - 1 - np.clip(ranks, 0, self.n - 1)
        by_rank = self._sorted[np.arange(len(self._sorted)), places]
        least = np.where(wanted > self._tail_surprises, tail, np.minimum(by_rank, self._starts))
        return np.where(ranks >= self.n, -np.inf, least)

    def surprises_now(self, values: FloatArray) -> list[float]:
        """The same for the values (C,) of one moment, fast enough for a control loop."""
        return [self._surprise_now(value, *known) for value, known in zip(values.tolist(), self._known, strict=True)]

    def _surprise_now(
        self, value: float, ranked: list[float], start: float, tail_surprise: float, exponent: float, handicap: float
    ) -> float:
        if value > start:
            surprise = tail_surprise + log(value / start) / exponent
        else:
            above = self.n - (bisect_left(ranked, value) if value > 0 else 0)
            surprise = min(-log((above + 1) / (self.n + 1)), tail_surprise)
        return max(surprise - handicap, 0.0)

    @staticmethod
    def _chance_in_tail(above: NDArray[np.bool_], own: NDArray[np.bool_], share: float) -> float:
        """Probability that so many of the own executions are among the most surprising share of all."""
        from scipy.special import bdtrc

        return float(bdtrc(above.sum() - 1, own.sum(), share)) if above.any() else 1.0

    def _chance_of_ranks(self, own: NDArray[np.bool_]) -> float:
        """Probability that the own executions rank so high among all, by the normal limit of the rank sum."""
        from scipy.special import ndtr

        count, ordered = int(own.sum()), np.sort(self.statistics)
        others = self.n - count
        ranks = (np.searchsorted(ordered, self.statistics, "left") + np.searchsorted(ordered, self.statistics, "right") + 1) / 2
        excess = ranks[own].sum() - count * (self.n + 1) / 2
        return float(ndtr(-excess / np.sqrt(count * others * (self.n + 1) / 12)))

    def _threshold(self) -> tuple[float, bool]:
        alpha, ordered = self.false_alarm_rate, np.sort(self.statistics)
        least = float(np.finfo(float).tiny)
        if alpha * (self.n + 1) >= ENOUGH - ROUNDING:
            above = int(alpha * (self.n + 1) + ROUNDING)  # of the n and the one to come; 0.059 * 1000 < 59
            return max(float(ordered[self.n - above]), least), True
        if self.n >= ENOUGH:
            # Conformal at the least rate that has enough executions; no less for a smaller one.
            least = max(least, float(ordered[-int(ENOUGH)]))
        start = float(np.quantile(ordered, 1 - max(STATISTIC_TAIL_SHARE, alpha)))
        excesses = ordered[ordered > start] - start
        scale = (excesses.sum() + 1.0) / (len(excesses) + 1)  # were the channels one, T would be exponential with scale 1
        return max(start + scale * max(float(np.log(STATISTIC_TAIL_SHARE / alpha)), 0.0), least), False
