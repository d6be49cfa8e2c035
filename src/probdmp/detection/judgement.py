"""Verdicts on recorded executions side by side: what a `CalibratedMonitor` would say in the end of each of them.

Few executions are suspicious. Of the others only the moment is looked for at which they come nearest to an alarm: surprise
grows with the value of a channel, so the largest values say how large it gets, and what is smaller by far is not looked at.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import BoolArray, FloatArray, IntArray
from probdmp.detection.calibrated_monitor import LOOKED_AT_AGAIN
from probdmp.detection.calibration import Calibration
from probdmp.detection.expectation import Expectation
from probdmp.detection.movement_channels import as_evidence, as_value, as_values
from probdmp.detection.reasons import LOOKED_BACK, REMEMBERED, better_fits, reasons_for, signal_shares
from probdmp.detection.recorded_sensors import NEVER
from probdmp.detection.recorded_ticks import RecordedTicks
from probdmp.detection.sensor_watch import CAUSES
from probdmp.detection.verdict import Verdict
from probdmp.detection.window_maps import Needed
from probdmp.dmp.phase import phases_at

__all__ = ["Standard", "Verdicts", "joined", "judge_recorded"]

EXPLAINED_AT_ONCE = 64
"""Executions whose alarms are explained at once."""
TIE = 1e-12
"""Relative difference up to which surprises are the same."""


class Standard(NamedTuple):
    """What executions of a primitive are held to."""

    calibration: Calibration
    threshold: float
    persistence: int
    channels: tuple[str, ...]
    """(C) names."""


class Verdicts(NamedTuple):
    """Verdicts on N executions; fields as of `probdmp.detection.verdict.Verdict`."""

    failed: BoolArray
    steps: IntArray
    times: FloatArray
    phases: FloatArray
    test_ratios: FloatArray
    contributions: FloatArray
    """(N, W) array."""
    kinds: NDArray[np.object_]
    causes: NDArray[np.object_]
    channels: NDArray[np.object_]
    betters: NDArray[np.object_]
    is_stale: BoolArray
    has_sensor_fault: BoolArray

    def verdict(self, k: int, names: tuple[str, ...]) -> Verdict:
        """On one of them."""
        numbers = int(self.steps[k]), float(self.times[k]), float(self.phases[k]), float(self.test_ratios[k])
        texts = self.kinds[k], self.causes[k], self.channels[k], self.betters[k]
        flags = bool(self.is_stale[k]), bool(self.has_sensor_fault[k])
        return Verdict(bool(self.failed[k]), *numbers, np.array(self.contributions[k]), names, *texts, *flags)


def joined(parts: Sequence[tuple[IntArray, Verdicts]]) -> Verdicts:
    """Judgements of parts of the executions, each with the numbers of these, as one in their order."""
    order = np.argsort(np.concatenate([rows for rows, _ in parts]))
    return Verdicts(*(np.concatenate(values)[order] for values in zip(*(one for _, one in parts), strict=True)))


class _Moments(NamedTuple):
    """One moment of each of N executions, at a tick."""

    ticks: IntArray
    """(N,) array; -1 where nothing is surprising."""
    channels: IntArray
    """(N,) array: the one that is most surprising."""
    ratios: FloatArray
    """(N,) array."""
    is_alarm: BoolArray
    """(N,) array: whether the ratio has been above 1 for long enough; else it is the largest one."""


def judge_recorded(
    expectation: Expectation, standard: Standard, recorded: RecordedTicks, durations: FloatArray, dts: FloatArray
) -> Verdicts:
    """Judge N executions on the phase clock.

    Parameters
    ----------
    durations, dts : (N,) arrays, seconds.
    """
    paths, sensors, n = recorded.paths, recorded.sensors, len(recorded.paths)
    needed = partial(_needed, standard)
    evidence = expectation.trajectory.evidence(paths.transpose(1, 2, 0), recorded.counts, recorded.goals, needed)
    moments = _moments(standard, evidence)
    rows, at = np.arange(n), np.maximum(moments.ticks, 0)
    alarmed_at = np.where(moments.is_alarm, recorded.steps[rows, at], NEVER)
    by_tick = moments.is_alarm & (alarmed_at <= np.minimum(sensors.faulty_from, sensors.stale_from))
    by_sensor = ~by_tick & (sensors.faulty_from < NEVER) & (sensors.faulty_from <= sensors.stale_from)
    by_silence = ~by_tick & ~by_sensor & (sensors.stale_from < NEVER)
    at_tick = ~by_sensor & ~by_silence & (moments.ticks >= 0)
    cases = [at_tick, by_sensor, by_silence]
    steps = np.select(cases, [recorded.steps[rows, at], sensors.faulty_from, sensors.stale_from], 0)
    contributions = np.zeros((n, len(expectation.watched)))
    contributions[at_tick, : paths.shape[2]] = _shares(expectation, recorded, evidence, moments, np.flatnonzero(at_tick))
    contributions[by_sensor, : paths.shape[2]] = sensors.fault_shares[by_sensor]
    channels = np.array([*standard.channels, "sensor", "silence", ""], dtype=object)
    which = np.select(cases, [moments.channels, len(channels) - 3, len(channels) - 2], len(channels) - 1)
    kinds, causes, betters = _reasons(expectation, recorded, moments, by_tick, by_silence, durations)
    return Verdicts(
        by_tick | by_sensor | by_silence,
        steps,
        steps * dts,
        np.where(at_tick | by_sensor | by_silence, phases_at(steps * dts, durations), 1.0),
        np.select(cases, [moments.ratios, sensors.fault_ratios, sensors.staleness], 0.0),
        contributions,
        *(kinds, causes, channels[which], betters),
        sensors.is_stale,
        sensors.faulty_from < NEVER,
    )


def _needed(standard: Standard, highest: FloatArray) -> Needed:
    """Evidence (C, N) that is as surprising as the highest so far, and all that may raise an alarm."""
    calibration = standard.calibration
    known, values = np.flatnonzero(~np.isnan(highest).all(axis=1)).tolist(), as_values(highest)
    nothing = np.zeros(highest.shape[1])
    reached = np.max([nothing, *(calibration.surprise_of(channel, values[channel]) for channel in known)], axis=0)
    surprises = np.append(np.minimum(reached, standard.threshold), standard.threshold)
    least = np.nextafter(_least(calibration, surprises), -np.inf)
    return Needed(least[:, :-1], least[:, -1])


def _least(calibration: Calibration, surprises: FloatArray) -> FloatArray:
    """(C, n) array: evidence below which no channel is as surprising as given (n,), safely rounded down."""
    return as_evidence(calibration.least_values(surprises).T)


def _moments(standard: Standard, evidence: FloatArray) -> _Moments:
    """The first alarm of each execution, or where it comes nearest to one, by evidence (C, T, N)."""
    calibration, (n_channels, _, n) = standard.calibration, evidence.shape
    highest = np.fmax.reduce(evidence, axis=1)
    largest = calibration.surprise(as_values(highest).T).max(axis=-1)
    nothing = np.zeros(n, dtype=np.int64)
    moments = _Moments(nothing, nothing.copy(), largest / standard.threshold, np.zeros(n, dtype=np.bool_))
    suspects = np.flatnonzero(moments.ratios > 1)
    least = np.where(largest > 0, _least(calibration, largest), np.inf)
    least[:, suspects] = np.inf
    first = np.full(n, NEVER)  # by tick, then by channel
    for channel in range(n_channels):
        chosen = np.flatnonzero(highest[channel] >= least[channel])
        ticks, places = np.nonzero(evidence[channel][:, chosen] >= least[channel, chosen])
        k = chosen[places]
        surprises = calibration.surprise_of(channel, as_value(channel, evidence[channel, ticks, k]))
        is_largest = surprises >= largest[k] * (1 - TIE)
        np.minimum.at(first, k[is_largest], ticks[is_largest] * n_channels + channel)
    moments.ticks[:] = np.where(first < NEVER, first // n_channels, -1)
    moments.channels[:] = np.where(first < NEVER, first % n_channels, 0)
    for of_all, some in zip(moments, _alarms(standard, evidence[:, :, suspects]), strict=True):
        of_all[suspects] = some
    return moments


def _alarms(standard: Standard, evidence: FloatArray) -> _Moments:
    """The same of n executions that are above the threshold at some tick, every tick looked at that may be; of (C, T, n)."""
    calibration, (n_channels, n_ticks, n) = standard.calibration, evidence.shape
    surprises, least = np.zeros((n, n_ticks, n_channels)), _least(calibration, np.array([standard.threshold]))
    for channel, alarming in enumerate(evidence >= least[:, None]):
        at = np.nonzero(alarming)
        surprises[at[1], at[0], channel] = calibration.surprise_of(channel, as_value(channel, evidence[channel][at]))
    ratios = surprises.max(axis=-1) / standard.threshold
    ticks, rows = np.arange(ratios.shape[1]), np.arange(len(ratios))
    below = np.maximum.accumulate(np.where(ratios > 1, -1, ticks), axis=1)  # the last tick that was not above
    alarmed = ticks - below >= standard.persistence
    is_alarm = np.asarray(alarmed.any(axis=1))
    at = np.where(is_alarm, np.argmax(alarmed, axis=1), np.argmax(ratios, axis=1))
    return _Moments(at, np.argmax(surprises[rows, at], axis=1), ratios[rows, at], is_alarm)


def _shares(
    expectation: Expectation, recorded: RecordedTicks, evidence: FloatArray, moments: _Moments, chosen: IntArray
) -> FloatArray:
    """Contributions of the signals to what was noticed of the chosen executions, (n, S) array."""
    channels, ticks = moments.channels[chosen], _shown(recorded.steps[chosen], moments.ticks[chosen])

    def windows(some: IntArray, offsets: IntArray) -> FloatArray:
        return recorded.paths[chosen[some, None], np.maximum(ticks[some, None] + offsets, 0)]

    there = evidence[channels, ticks, chosen]
    return signal_shares(expectation.trajectory, channels, ticks, there, recorded.goals[chosen], windows)


def _shown(steps: IntArray, ticks: IntArray) -> IntArray:
    """The last ticks (n,) that come out with the same sample as these, by steps (n, K): a monitor has seen all of them."""
    return np.asarray((steps <= steps[np.arange(len(steps)), ticks][:, None]).sum(axis=1) - 1)


def _reasons(
    expectation: Expectation,
    recorded: RecordedTicks,
    moments: _Moments,
    by_tick: BoolArray,
    by_silence: BoolArray,
    durations: FloatArray,
) -> NDArray[np.object_]:
    """Kind, cause and better-fitting primitive of every execution, (3, N) array of text."""
    texts = np.full((3, len(by_tick)), "", dtype=object)
    texts[0, by_silence], texts[1, by_silence] = "data missing", "nothing measured"
    is_faulty = recorded.sensors.faulty_from < NEVER
    texts[0, is_faulty], texts[1, is_faulty] = "sensor", [CAUSES[c] for c in recorded.sensors.causes[is_faulty]]
    chosen = np.flatnonzero(by_tick & ~is_faulty)
    for begin in range(0, len(chosen), EXPLAINED_AT_ONCE):
        some = chosen[begin : begin + EXPLAINED_AT_ONCE]
        texts[:, some] = _seen_in_movement(expectation, recorded, moments, some, durations[some])
    return texts


def _seen_in_movement(
    expectation: Expectation, recorded: RecordedTicks, moments: _Moments, chosen: IntArray, durations: FloatArray
) -> NDArray[np.object_]:
    """The same of n executions whose ticks have raised an alarm, (3, n) array."""
    paths, later = recorded.paths[chosen, :, : expectation.primitive.n_dof], np.array(LOOKED_AT_AGAIN)
    is_there = moments.ticks[chosen, None] + later < recorded.counts[chosen, None]
    since = np.where(is_there, later, 0).max(axis=1)
    ticks = _shown(recorded.steps[chosen], moments.ticks[chosen] + since)
    back = ticks[:, None] + np.arange(1 - LOOKED_BACK, 1)
    recent = np.where((back >= 0)[..., None], paths[np.arange(len(paths))[:, None], np.maximum(back, 0)], np.nan)
    means = expectation.trajectory.model.means_for(recorded.goals[chosen])
    reasons = reasons_for(expectation, means, recent, ticks, moments.channels[chosen], since)
    motions = [k for k, (kind, _) in enumerate(reasons) if kind == "motion"]
    begun = [paths[k, : min(ticks[k], REMEMBERED) + 1] for k in motions]
    texts = np.array([(*reason, "") for reason in reasons], dtype=object).T
    texts[2, motions] = better_fits(expectation, begun, durations[motions])
    return texts
