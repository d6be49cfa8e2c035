"""What a sensor cannot have measured does not reach the movement; what it can have measured does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import seeds

from probdmp.detection.profile import ExecutionProfile, repeats
from probdmp.detection.sensor_watch import LEAST_JUMP, LEAST_REPEAT_SHARE, LEAST_REPEATS, MOST_SPIKES, SensorWatch

DURATION, DT = 1.0, 0.01
RANGES = np.array([2.0, 0.5])


def profile(noise=1e-3, longest_repeats=0.0, largest_jumps=0.002, usual_gaps=DT):
    ones = np.ones(2)
    return ExecutionProfile(np.asarray(0.1), noise * ones, longest_repeats * ones, largest_jumps * RANGES, usual_gaps * ones)


def watch(n_dof=2, **shown):
    """Of two signals, both of them positions unless told otherwise."""
    return SensorWatch(profile(**shown), RANGES, n_dof, DURATION, DT)


def movement(rng, n=100):
    """Smooth, over the whole range, with noise."""
    phases = np.linspace(0, 1, n)[:, None]
    return RANGES * (np.sin(np.pi * phases * [1, 2] / 2) + 1e-3 * rng.standard_normal((n, 2)))


def believed(sensors, samples):
    return np.stack([sensors.believe(sample) for sample in samples])


@given(seeds)
def test_a_movement_is_believed(seed):
    samples, sensors = movement(np.random.default_rng(seed)), watch()
    np.testing.assert_array_equal(believed(sensors, samples), samples)
    assert (sensors.cause, sensors.is_stale) == ("", False)


@given(seeds, st.sampled_from([0, 1]), st.floats(0.2, 1e6), st.sampled_from([-1, 1]))
def test_a_spike_never_reaches_the_movement(seed, d, size, sign):
    """And nothing else is lost for it, but the one number."""
    rng = np.random.default_rng(seed)
    samples, at = movement(rng), int(rng.integers(2, 99))
    spiked = np.array(samples)
    spiked[at, d] += sign * size * RANGES[d]
    expected = np.array(samples)
    expected[at, d] = np.nan
    np.testing.assert_array_equal(believed(watch(), spiked), expected)


@given(seeds, st.sampled_from([0, 1]), st.floats(0.2, 10), st.sampled_from([-1, 1]))
def test_a_jump_reaches_the_movement_with_the_second_sample(seed, d, size, sign):
    rng = np.random.default_rng(seed)
    samples, at = movement(rng), int(rng.integers(2, 98))
    samples[at:, d] += sign * size * RANGES[d]
    sensors, expected = watch(), np.array(samples)
    expected[at, d] = np.nan
    np.testing.assert_array_equal(believed(sensors, samples), expected)
    assert sensors.cause == ""
    np.testing.assert_array_equal(sensors.spikes, 0)


@given(seeds, st.floats(0.06, 3.0))
def test_a_movement_that_runs_away_is_believed_in_the_end(seed, speed):
    """Something that moves far between samples, steadily, is no row of spikes: it must not go unseen."""
    rng = np.random.default_rng(seed)
    samples, at = movement(rng), int(rng.integers(5, 80))
    samples[at:] += speed * RANGES * np.arange(1, 101 - at)[:, None]
    seen = ~np.isnan(believed(watch(), samples))
    assert seen[at + 5 :].mean() > 0.9


def test_some_spikes_make_a_sensor_fault():
    rng, sensors = np.random.default_rng(0), watch()
    samples = movement(rng)
    for k in range(MOST_SPIKES + 1):
        assert sensors.cause == ""
        samples[10 * (k + 1), 0] += RANGES[0]
        believed(sensors, samples[10 * k + 2 : 10 * k + 12])
    assert sensors.cause == "spikes"
    assert sensors.ratio > 1


def repeats_until_stuck(sensors, samples):
    """How often the second sensor may say the same until it is not believed any more."""
    for k, sample in enumerate(samples):
        sensors.believe(np.array([sample[0], 0.1]))
        assert (sensors.cause == "stuck") == (sensors.shares[1] > 1)
        assert sensors.shares[0] == 0
        if sensors.cause:
            return k
    return len(samples)


def test_exact_repeats_make_a_stuck_sensor():
    """More than a few, and for more than some part of the duration; more where the demonstrations have shown some."""
    samples = movement(np.random.default_rng(0))
    least = max(LEAST_REPEATS, LEAST_REPEAT_SHARE * DURATION / DT)
    assert repeats_until_stuck(watch(), samples) == int(least + 1e-9) + 1
    found = [repeats_until_stuck(watch(longest_repeats=shown), samples) for shown in (0.0, 0.03, 0.06, 0.1)]
    assert found == sorted(found)
    assert found[-1] > 10


def test_what_is_not_measured_repeats_nothing():
    sensors = watch()
    for k in range(60):
        sensors.believe(np.array([0.1 if k % 2 else np.nan, np.sin(k / 30)]))
        if k == 9:
            assert sensors.repeats[0] == 4  # five values
            assert sensors.cause == ""
    assert sensors.cause == "stuck"


@pytest.mark.parametrize("lost", [0, 1])
def test_silence_is_stale_until_something_is_heard(lost):
    """After a tenth of the duration, of any sensor."""
    sensors, samples = watch(), movement(np.random.default_rng(0))
    samples[30:50, lost] = np.nan
    stale = []
    for sample in samples:
        sensors.believe(sample)
        stale.append(sensors.is_stale)
    np.testing.assert_array_equal(np.flatnonzero(stale), np.arange(40, 50))
    assert sensors.cause == ""


@pytest.mark.parametrize(("usual", "longest"), [(0.01, 10), (0.04, 10), (0.1, 20), (0.2, 40)])
def test_a_slow_sensor_may_be_silent_for_twice_as_long_as_usual(usual, longest):
    """But a tenth of the duration in any case."""
    sensors, samples = watch(usual_gaps=np.array([DT, usual])), movement(np.random.default_rng(0))
    samples[np.arange(100) % round(usual / DT) > 0, 1] = np.nan
    samples[41:, 1] = np.nan
    stale = []
    for sample in samples:
        sensors.believe(sample)
        stale.append(sensors.is_stale)
    np.testing.assert_array_equal(np.flatnonzero(stale), np.arange(41 + longest, 100))


def test_what_was_never_measured_is_not_missed():
    sensors, samples = watch(usual_gaps=np.array([DT, np.inf])), movement(np.random.default_rng(0))
    samples[:, 1] = np.nan
    np.testing.assert_array_equal(believed(sensors, samples), samples)
    assert (sensors.is_stale, sensors.staleness, sensors.cause) == (False, 0.0, "")


def test_a_channel_may_be_constant_for_as_long_as_it_likes():
    """A force rests, or is at its limit; a position that repeats exactly is stuck, even if the force does so too."""
    samples = movement(np.random.default_rng(0))
    samples[:, 1] = 0.1
    sensors = watch(n_dof=1)
    np.testing.assert_array_equal(believed(sensors, samples), samples)
    assert (sensors.cause, sensors.ratio, sensors.shares.tolist()) == ("", 0.0, [0.0, 0.0])
    samples[50:, 0] = samples[49, 0]
    believed(sensors, samples[50:])
    assert sensors.cause == "stuck"
    assert sensors.shares[0] > 1
    assert sensors.shares[1] == 0


def test_spikes_of_a_channel_are_spikes():
    samples, sensors = movement(np.random.default_rng(0)), watch(n_dof=1)
    samples[[20, 40, 60], 1] += RANGES[1]
    found = believed(sensors, samples)
    assert np.flatnonzero(np.isnan(found[:, 1])).tolist() == [20, 40, 60]
    assert sensors.cause == "spikes"
    assert sensors.shares[1] > sensors.shares[0] == 0


def test_after_a_gap_there_is_no_line_to_compare_with():
    samples, sensors = movement(np.random.default_rng(0)), watch()
    samples[30:50] = np.nan
    samples[50:] += RANGES
    np.testing.assert_array_equal(believed(sensors, samples), samples)
    np.testing.assert_array_equal(sensors.spikes, 0)


@given(seeds, st.floats(-6, 6))
def test_units_do_not_matter(seed, exponent):
    rng, unit = np.random.default_rng(seed), 10**exponent
    samples = movement(rng)
    samples[rng.integers(2, 99, 5)] += RANGES * rng.choice([-1, 1]) * 0.5
    scaled = SensorWatch(
        ExecutionProfile(np.asarray(0.1), np.full(2, 1e-3) * unit, np.zeros(2), 0.002 * RANGES * unit, np.full(2, DT)),
        RANGES * unit,
        2,
        DURATION,
        DT,
    )
    np.testing.assert_array_equal(np.isnan(believed(scaled, samples * unit)), np.isnan(believed(watch(), samples)))


def test_small_deviations_are_never_spikes():
    samples, sensors = movement(np.random.default_rng(0)), watch(largest_jumps=0.0)
    samples[::7] += 0.4 * LEAST_JUMP * RANGES
    np.testing.assert_array_equal(believed(sensors, samples), samples)


def test_repeats_are_counted_from_the_second_on():
    column = np.array([[1.0], [1.0], [1.0], [2.0], [np.nan], [np.nan], [2.0], [2.0]])
    np.testing.assert_array_equal(repeats(column)[:, 0], [0, 1, 2, 0, 0, 0, 0, 1])
