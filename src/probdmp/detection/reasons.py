"""Who is to blame for what a channel has noticed, and why it did: the same while an execution runs and of recordings."""

from collections.abc import Callable, Sequence

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.diagnosis import LOOKED_AT, Diagnosis, diagnose
from probdmp.detection.expectation import Expectation
from probdmp.detection.innovation_watch import watched_sensors
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.trajectory_model import MOVEMENT_CHANNELS, TrajectoryModel

__all__ = ["LOOKED_BACK", "REMEMBERED", "better_fits", "reasons_for", "signal_shares"]

LOOKED_BACK = int(LOOKED_AT.max()) + 1
REMEMBERED = 2 * TICKS
"""Ticks from the start that are compared with other primitives."""
LATE = ("held", "paused", "slow")
"""Causes of a diagnosis by which a movement is late: then its channels are so too."""

Windows = Callable[[IntArray, IntArray], FloatArray]
"""Of some of the executions, by number, at the ticks that are asked about: at (P) offsets from them, (n, P, S)."""


def signal_shares(
    trajectory: TrajectoryModel, channels: IntArray, ticks: IntArray, values: FloatArray, goals: FloatArray, windows: Windows
) -> FloatArray:
    """(n, S) array: how much each signal of n executions contributes to what channels say at ticks, with its sign.

    It is by where the execution is, or else by how it has moved lately; or by what the channel reads.

    Parameters
    ----------
    channels, ticks, values : (n,) arrays: one moment of each execution, and the value there.
    goals : (n, D) array, as displacements; NaN where not told.
    """
    d, n_movement = trajectory.model.means.shape[1], len(MOVEMENT_CHANNELS)
    shares = np.zeros((len(channels), d + len(trajectory.feel)))
    position = MOVEMENT_CHANNELS.index("position")
    for statistic, chosen in (
        (trajectory.position, channels == position),
        (trajectory.displacement, (channels != position) & (channels < n_movement)),
    ):
        some, judge = np.flatnonzero(chosen), statistic.windows
        if len(some):
            unshifted = int(np.flatnonzero(judge.shifts == 0)[0])
            means = trajectory.model.means_at(judge.ticks(ticks[some], unshifted), goals[some])
            deviations = windows(some, statistic.offsets)[..., :d] - means
            shares[some, :d] = judge.shares(ticks[some], unshifted, deviations)
    for k, feel in enumerate(trajectory.feel):
        some = np.flatnonzero(channels == n_movement + k)
        if len(some):
            expected = trajectory.means_at(np.clip(ticks[some, None] + feel.offsets, 0, TICKS), goals[some])
            signs = feel.signs(ticks[some], windows(some, feel.offsets), expected)
            shares[some, d + k] = np.nan_to_num(values[some]) * signs
    return shares


def reasons_for(
    expectation: Expectation, means: FloatArray, recent: FloatArray, ticks: IntArray, channels: IntArray, seen_since: IntArray
) -> list[Diagnosis]:
    """From the last ticks of n executions; what a channel has noticed is about that channel, unless the movement is late.

    Parameters
    ----------
    means : (n, M, D) array, mean path of each execution.
    recent : (n, L, D) array: displacements at the last ticks, `LOOKED_BACK` of them at the most; NaN before the start.
    ticks : (n,) array: the last of them, since the start.
    channels : (n,) array: the one that has raised the alarm.
    seen_since : (n,) array: ticks since then.
    """
    primitive = expectation.primitive
    noise = expectation.profile.noise_stds[: primitive.n_dof] / primitive.ranges
    found = diagnose(expectation.trajectory.model, means, recent, ticks, noise, seen_since)
    further = channels - len(MOVEMENT_CHANNELS)
    return [
        one if channel < 0 or one.cause in LATE else _about_channel(expectation, channel)
        for one, channel in zip(found, further.tolist(), strict=True)
    ]


def _about_channel(expectation: Expectation, further: int) -> Diagnosis:
    names = expectation.primitive.channel_names
    if further >= len(names):
        return Diagnosis("motion", f"unexpected readings of {watched_sensors(expectation.array)[further - len(names)]}")
    return Diagnosis("channel", f"unexpected {names[further]}")


def better_fits(expectation: Expectation, paths: Sequence[FloatArray], durations: FloatArray) -> list[str]:
    """Labels of the primitives of the library that fit paths better, if there are.

    Parameters
    ----------
    paths : n (T, D) arrays from the start, as fractions of the range.
    durations : (n,) array, seconds.
    """
    times = [np.arange(len(path)) * duration / TICKS for path, duration in zip(paths, durations, strict=True)]
    ranges = expectation.primitive.ranges
    return expectation.others.better(expectation.primitive, times, [path * ranges for path in paths])
