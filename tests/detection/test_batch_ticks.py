"""Recordings put on the phase clock side by side, and sample by sample: the same ticks at the same samples."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import seeds

from probdmp.detection.phase_clock import PhaseClock
from probdmp.detection.profile import ExecutionProfile
from probdmp.detection.recorded_sensors import NEVER, Sensing, watch_recordings
from probdmp.detection.recorded_ticks import record_ticks
from probdmp.detection.sensor_watch import CAUSES, SensorWatch
from probdmp.errors import InputError

DURATION, DT = 1.0, 0.013
RANGES = np.array([2.0, 0.5, 3.0])
N_DOF = 2


def sensing(usual_gaps=(DT, DT, DT)):
    """Of two positions and a channel."""
    profile = ExecutionProfile(np.asarray(0.1), np.full(3, 1e-3), np.zeros(3), 0.002 * RANGES, np.array(usual_gaps))
    return Sensing(profile, RANGES, N_DOF)


def recordings(rng, n, n_samples):
    phases = np.linspace(0, 1, n_samples)[:, None]
    sizes = rng.uniform(0.8, 1.2, (n, 1, 3))
    return RANGES * (sizes * np.sin(np.pi * phases * [1, 2, 3] / 2) + 1e-3 * rng.standard_normal((n, n_samples, 3)))


DAMAGES = ("none", "lost", "repeats", "spikes", "jump", "silence", "late", "slow", "never", "all_repeat")


def damage(values, kind, rng):
    """One recording (T, S) as a bad sensor shows it."""
    values, at, s = np.array(values), int(rng.integers(1, len(values))), int(rng.integers(3))
    if kind == "lost":
        values[rng.random(values.shape) < 0.3] = np.nan
    elif kind == "repeats":
        values[at : at + int(rng.integers(1, 30)), s] = values[at - 1, s]
    elif kind == "spikes":
        values[rng.integers(0, len(values), int(rng.integers(1, 6))), s] += RANGES[s] * rng.uniform(-2, 2)
    elif kind == "jump":
        values[at:, s] += RANGES[s]
    elif kind == "silence":
        values[at : at + int(rng.integers(1, 60)), s] = np.nan
    elif kind == "late":
        values[:at, s] = np.nan
    elif kind == "slow":
        values[np.arange(len(values)) % int(rng.integers(2, 9)) > 0, s] = np.nan
    elif kind == "never":
        values[:, s] = np.nan
    elif kind == "all_repeat":
        values[at:] = values[at - 1]
    return values


def one_by_one(own, values, goal, duration, dt):
    """Ticks with their samples, goal, and what the watch said after every sample."""
    watch = SensorWatch(own.profile, RANGES, N_DOF, duration, dt)
    clock, start = PhaseClock(own.profile.usual_gaps, duration, dt), np.array([np.nan, np.nan, 0.0])
    ticks, ahead, said = [], np.full(N_DOF, np.nan), []
    for t, row in enumerate(values):
        believed = watch.believe(row)
        start = np.where(np.isnan(start), believed, start)
        new = clock.advance(t * dt, (believed - start) / RANGES)
        if new and not ticks:
            ahead = (goal - start[:N_DOF]) / RANGES[:N_DOF]
        ticks += [(tick.values, t) for tick in new]
        said.append((watch.cause, float(watch.ratio), watch.shares, bool(watch.is_stale), float(watch.staleness)))
    return ticks, ahead, said


cases = st.lists(st.sampled_from(DAMAGES), min_size=1, max_size=4)
gaps = st.sampled_from([(DT, DT, DT), (DT, DT, 6 * DT), (DT, DT, np.inf), (np.inf, DT, DT)])


@given(seeds, cases, gaps, st.sampled_from([3, 40, 90, 150]), st.booleans())
def test_side_by_side_is_sample_by_sample(seed, kinds, usual_gaps, n_samples, alike):
    """Ticks, the samples with which they come, goals, and what is wrong with which sensor since when."""
    rng, n, own = np.random.default_rng(seed), len(kinds), sensing(usual_gaps)
    signals = np.stack([damage(v, kind, rng) for v, kind in zip(recordings(rng, n, n_samples), kinds, strict=True)])
    lengths = np.full(n, n_samples) if alike else rng.integers(1, n_samples + 1, n)
    durations = np.full(n, DURATION) if alike else rng.uniform(0.3, 2.0, n)
    dts = np.full(n, DT) if alike else rng.uniform(0.5, 1.5, n) * DT
    goals = rng.standard_normal((n, N_DOF))
    found = record_ticks(own, signals, lengths, goals, durations, dts)
    for k in range(n):
        ticks, ahead, said = one_by_one(own, signals[k, : lengths[k]], goals[k], durations[k], dts[k])
        assert found.counts[k] == len(ticks)
        np.testing.assert_array_equal(found.steps[k, : len(ticks)], [t for _, t in ticks])
        np.testing.assert_array_equal(found.steps[k, len(ticks) :], NEVER)
        if ticks:
            np.testing.assert_allclose(found.paths[k, : len(ticks)], [v for v, _ in ticks], rtol=1e-13, atol=1e-15)
        np.testing.assert_array_equal(found.goals[k], ahead)
        sensors = found.sensors
        faults = [t for t, now in enumerate(said) if now[0]]
        assert sensors.faulty_from[k] == (faults[0] if faults else NEVER)
        if faults:
            cause, ratio, shares, *_ = said[faults[0]]
            assert (CAUSES[sensors.causes[k]], sensors.fault_ratios[k]) == (cause, ratio)
            np.testing.assert_array_equal(sensors.fault_shares[k], shares)
        stale = [t for t, now in enumerate(said) if now[3]]
        assert sensors.stale_from[k] == (stale[0] if stale else NEVER)
        assert sensors.is_stale[k] == said[-1][3]
        if stale:
            assert sensors.staleness[k] == said[stale[0]][4]


@given(seeds, st.sampled_from(DAMAGES))
def test_what_is_whole_has_nothing_to_be_looked_into(seed, kind):
    """Whatever passes for whole is believed as it is, and only that."""
    rng, own = np.random.default_rng(seed), sensing()
    signals = damage(recordings(rng, 1, 80)[0], kind, rng)[None]
    record = watch_recordings(own, signals, np.array([80]), np.array([DURATION]), np.array([DT]))
    _, _, said = one_by_one(own, signals[0], np.zeros(N_DOF), DURATION, DT)
    if record.is_whole[0]:
        np.testing.assert_array_equal(record.believed, signals)
        assert not any(cause or stale for cause, _, _, stale, _ in said)
    elif kind == "none":
        pytest.fail("a smooth movement is whole")


def test_a_recording_far_longer_than_the_movement_is_refused():
    """Its ticks would take all memory there is; more likely its times are in another unit."""
    rng, one = np.random.default_rng(0), np.ones(1)
    told, samples = np.full((1, N_DOF), np.nan), np.array([20])
    for dt, is_refused in ((40.0, False), (60.0, True)):
        arguments = (sensing(), recordings(rng, 1, 20), samples, told, DURATION * one, dt * one)
        if is_refused:
            with pytest.raises(InputError, match="at most 1000 times as long"):
                record_ticks(*arguments)
        else:
            record_ticks(*arguments)
