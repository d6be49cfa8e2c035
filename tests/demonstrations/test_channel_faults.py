"""What goes wrong with sensor channels, and what becomes of them when the movement goes wrong."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import seeds

from probdmp.demonstrations import (
    CHANNEL_FAULTS,
    FAILURE,
    FAULTS,
    Demonstration,
    fault_generator,
    fault_named,
    noise_stds,
    perturb_executions,
    synthetic_letters,
)
from probdmp.errors import InputError, TooFewDemonstrationsError

NOISE = np.array([0.05, 0.002])
"""Of the two channels of these recordings."""
KEPT = sorted(name for name, fault in FAULTS.items() if not fault.takes_channels_along)
NAN = np.nan


def generator(seed=0):
    return np.random.default_rng(seed)


def truth(n):
    """Of a force that rises, stays and falls, and of a temperature that goes down; (n, 2)."""
    s = np.linspace(0, 1, n)
    return np.column_stack([2 + 3 * np.sin(np.pi * s) ** 2, 0.5 - 0.1 * s**2])


def felt(n=200, seed=1):
    """(n, 2) channels as they are recorded."""
    return truth(n) + NOISE * generator(seed).standard_normal((n, 2))


def with_gaps(channels, seed):
    lossy = np.array(channels)
    lossy[generator(seed).random(channels.shape) < 0.1] = NAN
    return lossy


def others(seed=0):
    """Channels of two other movements, of other lengths."""
    return [10 + felt(n, seed) for n in (150, 260)]


def changed(name, channels, onset, seed=0, other=None):
    return fault_named(name)(channels, onset, generator(seed), others() if other is None else other)


names = st.sampled_from(sorted(CHANNEL_FAULTS))


# --- laws of all faults of channels -----------------------------------------------------------------------------------


@given(seeds, names, st.floats(0, 1), st.booleans())
def test_before_the_onset_channels_are_as_recorded_and_what_was_missing_stays_missing(seed, fault, place, gaps):
    channels = with_gaps(felt(80), seed) if gaps else felt(80)
    before, onset = channels.copy(), 1 + int(place * 78)
    faulty = changed(fault, channels, onset, seed)
    assert faulty.shape == channels.shape
    np.testing.assert_array_equal(np.isnan(faulty), np.isnan(channels))
    if fault != "wrong_channel":  # which is that of another movement from the start
        np.testing.assert_array_equal(faulty[:onset], channels[:onset])
    np.testing.assert_array_equal(channels, before)  # a pure function
    assert not np.shares_memory(faulty, channels)


@pytest.mark.parametrize("fault", CHANNEL_FAULTS)
def test_from_the_onset_on_something_is_different(fault):
    channels = felt()
    assert np.all(changed(fault, channels, 100)[100:] != channels[100:])


@pytest.mark.parametrize("unit", [1e-6, 1e6])
@pytest.mark.parametrize("fault", CHANNEL_FAULTS)
def test_faults_scale_with_the_units(fault, unit):
    scaled = changed(fault, felt() * unit, 60, other=[one * unit for one in others()])
    np.testing.assert_allclose(scaled, changed(fault, felt(), 60) * unit, rtol=1e-7)


@pytest.mark.parametrize("fault", CHANNEL_FAULTS)
def test_the_seed_decides(fault):
    """Nothing else; pressing draws nothing."""
    one, again, other = (changed(fault, felt(), 60, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert np.array_equal(one, other) == (fault == "press")


@pytest.mark.parametrize("fault", CHANNEL_FAULTS)
def test_channels_do_not_hear_of_each_other(fault):
    """In another place one is changed alike, but for its noise."""
    channels = felt()
    channels[:, 1] = NAN  # never measured
    faulty = changed(fault, channels, 60)
    assert np.isnan(faulty[:, 1]).all()
    np.testing.assert_array_equal(faulty[:, 0], changed(fault, felt(), 60)[:, 0])


@pytest.mark.parametrize("n", [3, 4, 8])
@pytest.mark.parametrize("fault", CHANNEL_FAULTS)
def test_very_short_recordings(fault, n):
    faulty = changed(fault, felt(n), n - 1)
    assert faulty.shape == (n, 2)
    assert np.isfinite(faulty).all()


# --- each of them -----------------------------------------------------------------------------------------------------


def test_lifted_channels_end_at_rest():
    """Where they were at the first sample, on average over what the sensor says."""
    channels, onset = felt(), 100
    ends = np.stack([changed("lift", channels, onset, seed)[onset + 10 :] for seed in range(100)])
    deviations = (ends.mean(axis=(0, 1)) - channels[0]) / NOISE
    assert np.abs(deviations).max() < 5 / np.sqrt(ends[..., 0].size)


def test_lifted_channels_have_the_noise_of_their_sensor():
    """Neither exact repeats nor noise that sets in may give it away."""
    channels, onset = felt(), 100
    draws = np.stack([changed("lift", channels, onset, seed)[onset + 10 :] for seed in range(100)]) - channels[0]
    np.testing.assert_allclose(draws.std(axis=(0, 1)), noise_stds(channels), rtol=0.05)
    force = draws[..., 0]
    assert abs(np.mean(force[:, 1:] * force[:, :-1])) < 0.03 * force.var()  # white
    assert len(np.unique(force)) == force.size


def test_lifted_channels_go_to_rest_within_a_twentieth_of_the_movement():
    channels, onset = truth(200), 100  # in the middle, where the force is largest
    lifted = changed("lift", channels, onset)[:, 0]
    assert lifted[onset] < channels[onset, 0]
    fall = lifted[onset - 1 : onset + 10]
    assert np.all(np.diff(fall) < 0)
    np.testing.assert_allclose(lifted[onset + 9 :], 2.0, atol=1e-3)
    assert fall[3] > 2.5


def test_a_resting_level_is_the_first_that_was_measured():
    late = felt()
    late[:7, 0] = NAN
    ends = np.mean([changed("lift", late, 100, seed)[110:, 0] for seed in range(50)])
    assert ends == pytest.approx(late[7, 0], abs=5 * NOISE[0] / np.sqrt(50 * 90))


@given(seeds, st.sampled_from([None, 0.1, 0.8, 3]))
def test_pressed_channels_are_higher_by_their_size(seed, size):
    """Times the range of each channel in this recording; the noise stays its own."""
    channels, onset = with_gaps(felt(), seed), 100
    name, wanted = ("press", CHANNEL_FAULTS["press"].size) if size is None else (f"press:{size}", size)
    added = (changed(name, channels, onset, seed) - channels) / (np.nanmax(channels, axis=0) - np.nanmin(channels, axis=0))
    np.testing.assert_allclose(added[110:][~np.isnan(added[110:])], wanted, rtol=1e-9)
    rise = added[onset : onset + 10]
    np.testing.assert_allclose(rise, np.where(np.isnan(rise), NAN, wanted * np.arange(0.1, 1.05, 0.1)[:, None]), rtol=1e-9)


def test_the_channel_of_another_movement_has_the_length_of_this_one():
    """Stretched from its first sample to its last, with the noise of this sensor."""
    channels, taken = felt(), set()
    for seed in range(20):
        faulty = changed("wrong_channel", channels, 0, seed)
        assert faulty.shape == channels.shape
        errors = faulty - 10 - truth(200)  # stretched, both others are the same
        assert np.all(errors.std(axis=0) < 1.5 * NOISE)
        assert np.all(errors.std(axis=0) > 0.8 * NOISE)
        one = changed("wrong_channel", channels, 0, seed, [felt() + 10, felt() + 20])
        taken.add(round(float(one[:, 0].mean() - channels[:, 0].mean()), -1))
    assert taken == {10.0, 20.0}


def test_another_channel_needs_another_movement():
    with pytest.raises(TooFewDemonstrationsError, match=r"executions of another class .*'wrong_channel'.*one class alone"):
        CHANNEL_FAULTS["wrong_channel"](felt(), 0, generator())


# --- names ------------------------------------------------------------------------------------------------------------


def test_faults_of_channels_are_known_by_name():
    assert list(CHANNEL_FAULTS) == ["lift", "press", "wrong_channel"]
    assert not set(CHANNEL_FAULTS) & set(FAULTS)
    for name, fault in CHANNEL_FAULTS.items():
        assert (fault.name, fault.nature, fault.of_channels) == (name, FAILURE, True)
        assert fault_named(name) is fault
    assert not any(fault.of_channels for fault in FAULTS.values())
    assert fault_named("press:0.7").size == 0.7
    assert fault_named("press:0.7").of_channels
    with pytest.raises(InputError, match="fault 'lift' without a size, got 'lift:1'"):
        fault_named("lift:1")


# --- executions with channels -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def letters():
    """Three of each of two letters, with a force that goes with the height of the pen and a temperature."""
    return [
        replace(d, channels={"force": 3 + d.positions[:, 1], "heat": felt(d.n_samples, seed=k)[:, 1]})
        for k, d in enumerate(synthetic_letters(3, letters="sv", dt=0.02))
    ]


@pytest.fixture(scope="module")
def executions(letters):
    return [d for d in letters if d.label == "s"]


@pytest.fixture(scope="module")
def other_letters(letters):
    return [d for d in letters if d.label == "v"]


def perturbed(name, executions, others, seed=0, onset=None):
    fault = fault_named(name)
    return perturb_executions(fault, executions, others, fault_generator(seed, "s", fault), onset)


@pytest.mark.parametrize("fault", CHANNEL_FAULTS)
def test_faults_of_channels_leave_positions_alone(executions, other_letters, fault):
    faulty, onsets = perturbed(fault, executions, other_letters)
    for one, original, onset in zip(faulty, executions, onsets, strict=True):
        np.testing.assert_array_equal(one.positions, original.positions)
        assert (one.label, one.dt, one.names, list(one.channels)) == ("s", original.dt, original.names, ["force", "heat"])
        assert (onset == 0) == (fault == "wrong_channel")
        for name, channel in one.channels.items():
            np.testing.assert_array_equal(channel[:onset], original.channels[name][:onset])
            assert np.any(channel != original.channels[name])


@pytest.mark.parametrize("fault", CHANNEL_FAULTS)
def test_faults_of_channels_need_channels(executions, other_letters, fault):
    bare = [replace(executions[0], channels={})]
    match = rf"executions with sensor channels for the fault '{fault}', got one without.* such as forces"
    with pytest.raises(InputError, match=match):
        perturbed(fault, bare, other_letters)
    with pytest.raises(InputError, match=match):
        perturbed(fault, [executions[1], *bare], other_letters)


@pytest.mark.parametrize("fault", FAULTS)
def test_channels_do_not_change_what_is_drawn_for_positions(executions, other_letters, fault):
    bare = [[replace(d, channels={}) for d in given] for given in (executions, other_letters)]
    for given_others in (other_letters, bare[1]):
        (with_them, onsets), (without, same_onsets) = (
            perturbed(fault, executions, given_others),
            perturbed(fault, bare[0], given_others),
        )
        assert onsets == same_onsets
        for one, other in zip(with_them, without, strict=True):
            np.testing.assert_array_equal(one.positions, other.positions)
            assert not other.channels
            assert {name: len(channel) for name, channel in one.channels.items()} == dict.fromkeys(
                ("force", "heat"), one.n_samples
            )


@pytest.mark.parametrize("fault", [name for name in KEPT if name != "dropout"])
def test_what_pushes_a_movement_aside_leaves_channels_alone(executions, other_letters, fault):
    for one, original in zip(perturbed(fault, executions, other_letters)[0], executions, strict=True):
        for name, channel in one.channels.items():
            np.testing.assert_array_equal(channel, original.channels[name])


def test_held_movements_hold_their_channels(executions, other_letters):
    """At what was measured last, with the noise of the sensor."""
    (faulty, *_), (onset, *_) = perturbed("hold", executions, other_letters)
    for name, channel in faulty.channels.items():
        original = executions[0].channels[name]
        np.testing.assert_array_equal(channel[:onset], original[:onset])
        level = noise_stds(original[:, None])[0]
        deviations = (channel[onset:] - original[onset - 1]) / level
        assert np.abs(deviations).max() < 5
        assert 0.5 < deviations.std() < 1.5


def test_a_channel_that_is_let_go_goes_on_where_it_was(executions, other_letters):
    (faulty, *_), (onset, *_) = perturbed("hold_release", executions, other_letters)
    waited = faulty.n_samples - executions[0].n_samples
    assert waited > 5
    for name, channel in faulty.channels.items():
        original = executions[0].channels[name]
        np.testing.assert_array_equal(channel[onset + waited :], original[onset:])
        assert np.ptp(channel[onset : onset + waited]) < 15 * noise_stds(original[:, None])[0]


def test_slowed_movements_slow_their_channels():
    """A force that is a function of the position is the same function of the position at half the speed."""
    t = np.linspace(0, 1, 201)
    positions = np.column_stack([t, t**2])
    execution = Demonstration(positions, 0.01, channels={"force": 3 * t**2})
    (faulty,), (onset,) = perturbed("slow", [execution], [])
    assert faulty.n_samples == onset + 2 * (201 - onset)
    np.testing.assert_allclose(faulty.channels["force"], 3 * faulty.positions[:, 1], atol=1e-4)
    np.testing.assert_allclose(np.diff(faulty.positions[onset:, 0]), 0.5 * (t[1] - t[0]), rtol=1e-5)


def test_another_movement_brings_its_own_channels(executions, other_letters):
    """Of the very execution that its positions are of; what that one did not measure was not measured."""
    partly = [replace(d, channels={"force": d.channels["force"]}) for d in other_letters]
    seen = set()
    for seed in range(6):
        for one in perturbed("wrong_class", executions, other_letters, seed)[0]:
            (source,) = [
                k
                for k, d in enumerate(other_letters)
                if d.n_samples == one.n_samples
                and np.allclose(d.positions - d.positions[0], one.positions - one.positions[0], atol=1e-9)
            ]
            for name, channel in one.channels.items():
                np.testing.assert_array_equal(channel, other_letters[source].channels[name])
            seen.add(source)
    assert seen == {0, 1, 2}
    for one in perturbed("wrong_class", executions, partly)[0]:
        assert np.isnan(one.channels["heat"]).all()
        assert np.isfinite(one.channels["force"]).all()


def test_samples_that_are_lost_are_lost_in_all_channels(executions, other_letters):
    gap = {name: np.where(np.arange(executions[0].n_samples) == 3, NAN, c) for name, c in executions[0].channels.items()}
    (faulty,), (onset,) = perturbed("dropout", [replace(executions[0], channels=gap)], other_letters)
    lost = np.isnan(faulty.positions).all(axis=1)
    assert lost.sum() > 5
    assert not lost[:onset].any()
    for name, channel in faulty.channels.items():
        np.testing.assert_array_equal(channel, np.where(lost, NAN, gap[name]))


def test_positions_that_were_not_measured_lose_no_channel():
    """A sample with a force and no position was none, and is none that is lost."""
    positions = np.column_stack([np.linspace(0, 1, 100)] * 2)
    positions[::2] = NAN
    execution = Demonstration(positions, 0.01, channels={"force": np.arange(100.0)})
    for fault in ("push", "drift", "stuck_sensor"):
        (faulty,), _ = perturbed(fault, [execution], [])
        np.testing.assert_array_equal(faulty.channels["force"], np.arange(100.0))


@given(seeds, st.sampled_from(sorted({*FAULTS, *CHANNEL_FAULTS})), st.floats(0, 1))
def test_every_fault_gives_a_recording(seed, fault, onset):
    """Whatever is missing; channels are as long as the movement."""
    rng = generator(seed)
    made = []
    for n in (20, 25, 31):
        channels = felt(n, seed)
        channels[rng.random(n) < 0.2] = NAN
        channels[:, rng.integers(2)] = NAN if rng.random() < 0.3 else channels[:, 0]
        positions = np.cumsum(rng.standard_normal((n, 2)), axis=0)
        positions[rng.random(n) < 0.1] = NAN
        made.append(Demonstration(positions, 0.05, channels=dict(zip(("force", "heat"), channels.T, strict=True))))
    (faulty,), _ = perturbed(fault, made[:1], made[1:], seed, onset)
    assert {len(channel) for channel in faulty.channels.values()} == {faulty.n_samples}
