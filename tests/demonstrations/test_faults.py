"""Faults: pure, seeded, as large as promised, and never visible by the sensor noise alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from probdmp.demonstrations import (
    BENIGN,
    FAILURE,
    FAULTS,
    SENSOR,
    Demonstration,
    fault_named,
    hold,
    largest_extent,
    noise_stds,
    synthetic_letters,
    without_noise,
)
from probdmp.errors import InputError, TooFewDemonstrationsError

seeds = st.integers(0, 2**32 - 1)
names = st.sampled_from(sorted(FAULTS))

LONGER = {"hold_release", "slow", "wrong_class"}
OTHERS = tuple(d.positions for d in synthetic_letters(2, letters="vo", dt=0.02))


def generator(seed=0):
    return np.random.default_rng(seed)


def inject(name, positions, onset, seed=0):
    return fault_named(name)(positions, onset, generator(seed), OTHERS)


@pytest.fixture(scope="module")
def letter():
    return synthetic_letters(1, letters="e", dt=0.01)[0].positions


@pytest.fixture(scope="module")
def noisy():
    """A slow arc of 600 samples with noise of 0.01 and 0.03."""
    t = np.linspace(0, 1, 600)
    arc = np.column_stack([np.sin(3 * t), np.cos(2 * t)])
    return arc + generator(1).standard_normal(arc.shape) * [0.01, 0.03]


# --- laws of all faults -----------------------------------------------------------------------------------------------


@given(seeds, names, st.floats(0, 1))
def test_every_fault_leaves_what_came_before_it(seed, fault, place):
    positions = synthetic_letters(1, letters="s", dt=0.02)[0].positions
    before, onset = positions.copy(), 1 + int(place * (len(positions) - 2))
    faulty = inject(fault, positions, onset, seed)
    assert (faulty.shape == positions.shape) == (fault not in LONGER)
    if fault != "wrong_class":  # which is another movement from the start
        np.testing.assert_array_equal(faulty[:onset], positions[:onset])
    assert np.isfinite(faulty).all() == (fault != "dropout")
    np.testing.assert_array_equal(positions, before)  # a pure function
    assert not np.shares_memory(faulty, positions)
    assert faulty.flags.writeable


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_is_decided_by_its_seed(letter, fault):
    one, same, *others = (inject(fault, letter, 40, seed) for seed in (1, 1, 2, 3, 4, 5))
    np.testing.assert_array_equal(one, same)
    assert any(one.shape != other.shape or np.any(one != other) for other in others)


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_changes_something(letter, fault):
    faulty = inject(fault, letter, 60)
    assert faulty.shape != letter.shape or np.any(faulty != letter)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
@pytest.mark.parametrize("fault", sorted(set(FAULTS) - {"wrong_class"}))
def test_faults_scale_with_the_units(letter, fault, unit):
    np.testing.assert_allclose(inject(fault, letter * unit, 30), inject(fault, letter, 30) * unit, rtol=1e-7)


@given(seeds, names, st.data())
def test_missing_samples_do_not_spread(seed, fault, data):
    """As many samples are missing as before, twice as many at half speed; and those of one degree of freedom stay its own."""
    positions = np.array(synthetic_letters(1, letters="s", dt=0.02)[0].positions)
    n, onset = len(positions), data.draw(st.integers(1, len(positions) - 1))
    gap = data.draw(st.integers(0, n - 1))
    positions[gap : gap + data.draw(st.integers(1, 8)), 0] = np.nan
    faulty = inject(fault, positions, onset, seed)
    if fault != "dropout":
        assert not np.isnan(faulty[:, 1]).any()
        slower = 2 if fault == "slow" else 1
        never_measured_before = np.isnan(positions[:onset, 0]).all()
        if not never_measured_before:
            assert np.isnan(faulty[:, 0]).sum() <= slower * np.isnan(positions[:, 0]).sum() + slower
    Demonstration(faulty, 0.02)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_sensor_that_never_measured_goes_on_doing_so(letter, fault):
    dead = np.array(letter)
    dead[:, 1] = np.nan
    faulty = inject(fault, dead, 40)
    if fault != "wrong_class":
        assert np.isnan(faulty[:, 1]).all()
    if fault != "dropout":
        assert np.isfinite(faulty[:, 0]).all()


@given(seeds, names, st.integers(3, 12), st.data())
def test_very_short_recordings(seed, fault, n, data):
    positions = generator(seed).standard_normal((n, 2))
    onset = data.draw(st.integers(1, n - 1))
    assert len(inject(fault, positions, onset, seed)) >= (3 if fault == "wrong_class" else n)


# --- held -------------------------------------------------------------------------------------------------------------


def test_hold_stays_at_the_last_free_position(letter):
    onset = len(letter) // 2
    held = np.mean([hold(letter, onset, generator(seed))[onset:] for seed in range(400)], axis=0)
    level = noise_stds(letter)
    assert np.abs((held - letter[onset - 1]) / level).max() < 5 / np.sqrt(400)


def test_hold_has_noise_at_the_recordings_own_level(letter):
    """Neither exact repeats nor the onset of noise may give it away."""
    onset = len(letter) // 3
    draws = np.stack([hold(letter, onset, generator(seed))[onset:] for seed in range(100)]) - letter[onset - 1]
    np.testing.assert_allclose(draws.std(axis=(0, 1)), noise_stds(letter), rtol=0.05)
    flat = draws.reshape(100, -1)
    assert abs(np.mean(flat[:, 2:] * flat[:, :-2])) < 0.02 * flat.var()  # white
    assert len(np.unique(flat)) == flat.size


def test_a_still_recording_without_noise_is_held_exactly():
    positions = np.linspace(0, 1, 50)[:, None]
    np.testing.assert_allclose(hold(positions, 20, generator())[20:], positions[19, 0], atol=1e-12)


def test_hold_takes_frozen_recordings(letter):
    assert not letter.flags.writeable
    assert hold(letter, 10, generator()).flags.writeable


def test_hold_after_a_missing_sample_stays_at_the_last_measured_position(letter):
    gaps = letter.copy()
    gaps[37:40] = np.nan
    held = hold(gaps, 40, generator())
    np.testing.assert_allclose(held[40:], np.broadcast_to(letter[36], held[40:].shape), atol=6 * noise_stds(letter).max())


def test_hold_release_waits_and_goes_on_where_it_was(noisy):
    faulty = inject("hold_release", noisy, 200)
    assert len(faulty) == len(noisy) + 90  # 15 %
    np.testing.assert_array_equal(faulty[290:], noisy[200:])
    held = faulty[200:290] - noisy[199]
    np.testing.assert_allclose(held.std(axis=0), noise_stds(noisy), rtol=0.3)
    assert np.abs(held.mean(axis=0) / noise_stds(noisy)).max() < 0.5


# --- slowed -----------------------------------------------------------------------------------------------------------


def test_slow_takes_twice_as_long_over_the_rest(noisy):
    faulty = inject("slow", noisy, 200)
    assert len(faulty) == 200 + 2 * 400
    t = np.linspace(0, 1, 600)
    there = np.interp(199 + 0.5 * np.arange(1, 801), np.arange(600), t)
    path = np.column_stack([np.sin(3 * there), np.cos(2 * there)])
    assert np.all(np.sqrt(np.mean((faulty[200:] - path) ** 2, axis=0)) < 1.3 * np.array([0.01, 0.03]))
    ends = np.mean([inject("slow", noisy, 200, seed)[-1] for seed in range(100)], axis=0)
    np.testing.assert_allclose(ends, path[-1], atol=0.05)


def test_slow_has_noise_at_the_recordings_own_level(noisy):
    faulty = inject("slow", noisy, 100)
    np.testing.assert_allclose(noise_stds(faulty[100:]), noise_stds(noisy), rtol=0.15)


def test_slow_without_noise_is_the_same_path():
    t = np.linspace(0, 1, 200)
    parabola = np.column_stack([t, t**2])
    faulty = inject("slow", parabola, 100)
    np.testing.assert_allclose(faulty[:, 1], faulty[:, 0] ** 2, atol=1e-5)
    np.testing.assert_allclose(np.diff(faulty[100:, 0]), 0.5 * (t[1] - t[0]), rtol=1e-6)


@pytest.mark.parametrize("fault", ["slow", "wrong_goal", "push", "drift"])
def test_no_corners_give_a_movement_without_noise_away(fault):
    """The largest fourth difference, by which noise is measured, hardly exceeds that of the movement itself."""
    t = np.linspace(0, 3, 300)
    path = np.column_stack([np.sin(2 * t), np.cos(3 * t)])
    assert np.all(noise_stds(inject(fault, path, 150)[151:]) < 2 * noise_stds(path) + 1e-9)


# --- displaced --------------------------------------------------------------------------------------------------------


@given(seeds, st.sampled_from(["push", "drift", "wrong_goal"]), st.sampled_from([None, 0.1, 0.4, 2]))
def test_displacements_are_as_large_as_promised(seed, fault, size):
    t = np.linspace(0, 1, 400)
    positions = np.column_stack([3 * t, t**2, np.ones_like(t)])
    chosen = fault_named(fault if size is None else f"{fault}:{size}")
    faulty = chosen(positions, 200, generator(seed))
    displaced = np.linalg.norm(faulty - positions, axis=1)
    assert np.max(displaced) == pytest.approx(3 * (size or FAULTS[fault].size), rel=1e-3)
    one_direction = (faulty - positions)[201:] / np.maximum(displaced[201:, None], 1e-300)
    moving = displaced[201:] > 1e-6
    np.testing.assert_allclose(one_direction[moving], one_direction[moving][:1].repeat(moving.sum(), 0), atol=1e-6)


def test_a_push_lasts_a_fifth_of_the_movement_and_is_over(letter):
    onset, lasts = 40, round(0.2 * len(letter))
    pushed = inject("push", letter, onset) - letter
    np.testing.assert_allclose(pushed[onset + lasts - 1 :], 0, atol=1e-12)
    assert np.all(np.any(pushed[onset : onset + lasts - 1] != 0, axis=1))
    assert np.argmax(np.abs(pushed).max(axis=1)) == pytest.approx(onset + lasts / 2, abs=1.5)


def test_drift_grows_linearly(letter):
    distance = np.linalg.norm(inject("drift", letter, 40) - letter, axis=1)
    np.testing.assert_allclose(np.diff(distance[39:]), distance[40], rtol=1e-6)
    assert distance[-1] == pytest.approx(0.3 * largest_extent(letter))


def test_a_wrong_goal_is_approached_smoothly(letter):
    distance = np.linalg.norm(inject("wrong_goal", letter, 40) - letter, axis=1)
    assert np.all(np.diff(distance[39:]) > 0)
    speed = np.diff(distance[39:])
    assert np.argmax(speed) == pytest.approx(len(speed) / 2, abs=2)
    assert max(speed[0], speed[-1]) < 0.02 * speed.max()


def test_pushes_go_in_every_direction(letter):
    angles = [np.arctan2(*(inject("push", letter, 40, seed) - letter)[50]) for seed in range(200)]
    assert np.all(np.histogram(angles, bins=4, range=(-np.pi, np.pi))[0] > 25)


def test_another_movement_starts_where_it_was_told(letter):
    faulty = inject("wrong_class", letter, 0)
    np.testing.assert_allclose(faulty[0], letter[0], atol=1e-12)
    assert any(len(faulty) == len(other) and np.allclose(faulty - faulty[0], other - other[0]) for other in OTHERS)


def test_another_movement_needs_one(letter):
    with pytest.raises(
        TooFewDemonstrationsError, match=r"Expected executions of another class .*'wrong_class'.*one class alone"
    ):
        FAULTS["wrong_class"](letter, 0, generator())


# --- sensors ----------------------------------------------------------------------------------------------------------


@given(seeds)
def test_dropout_loses_whole_rows_and_one_gap(seed):
    positions = synthetic_letters(1, letters="e", dt=0.01)[0].positions
    faulty, onset = inject("dropout", positions, 40, seed), 40
    lost = np.isnan(faulty).any(axis=1)
    np.testing.assert_array_equal(lost, np.isnan(faulty).all(axis=1))
    np.testing.assert_array_equal(faulty[~lost], positions[~lost])
    single, gap = round(0.2 * (len(positions) - onset)), round(0.05 * len(positions))
    assert single <= lost.sum() <= single + gap
    longest = max(len(run) for run in "".join("x" if x else " " for x in lost).split())
    assert longest >= gap


def test_jitter_moves_along_the_path_by_half_a_step_at_most():
    line = np.linspace(0, 1, 200)[:, None]
    moved = inject("jitter", line, 50) - line
    step = line[1] - line[0]
    assert np.abs(moved).max() <= 0.5 * step * (1 + 1e-9)
    assert moved[51:-1].std() == pytest.approx(step[0] / np.sqrt(12), rel=0.15)


def test_jitter_keeps_the_noise(noisy):
    np.testing.assert_allclose(noise_stds(inject("jitter", noisy, 1)), noise_stds(noisy), rtol=0.1)


@given(seeds)
def test_a_stuck_sensor_repeats_exactly(seed):
    positions = synthetic_letters(1, letters="e", dt=0.01)[0].positions
    faulty = inject("stuck_sensor", positions, 40, seed)
    stuck = [d for d in range(2) if np.all(faulty[40:, d] == positions[39, d])]
    assert len(stuck) == 1
    np.testing.assert_array_equal(faulty[:, 1 - stuck[0]], positions[:, 1 - stuck[0]])


def test_a_stuck_sensor_repeats_what_it_measured_last(letter):
    gaps = np.array(letter)
    gaps[35:45] = np.nan
    faulty = inject("stuck_sensor", gaps, 40)
    assert np.all(faulty[40:] == letter[34], axis=0).sum() == 1


@given(seeds, st.integers(40, 560))
def test_spikes_are_isolated_and_as_large_as_promised(seed, onset):
    t = np.linspace(0, 1, 600)
    positions = np.column_stack([4 * t, t**2])
    spiked = inject("spikes", positions, onset, seed) - positions
    rows, dofs = np.nonzero(spiked)
    assert len(rows) == max(3, round(0.02 * (600 - onset)))
    assert np.all(np.diff(rows) > 1)
    sizes = np.abs(spiked[rows, dofs]) / 4
    assert np.all((sizes >= 0.2 - 1e-9) & (sizes <= 0.5 + 1e-9))


# --- names ------------------------------------------------------------------------------------------------------------


def test_every_fault_has_a_nature():
    natures = {name: fault.nature for name, fault in FAULTS.items()}
    assert [name for name, nature in natures.items() if nature == BENIGN] == ["dropout", "jitter"]
    assert [name for name, nature in natures.items() if nature == SENSOR] == ["stuck_sensor", "spikes"]
    assert sum(nature == FAILURE for nature in natures.values()) == 7
    assert all(name == fault.name == fault.kind for name, fault in FAULTS.items())


def test_a_size_follows_a_colon(letter):
    big, usual = fault_named("push:0.4"), fault_named("push")
    assert (big.name, big.kind, big.size, usual.size) == ("push:0.4", "push", 0.4, 0.25)
    moved, usually = (fault(letter, 40, generator()) - letter for fault in (big, usual))
    np.testing.assert_allclose(moved, usually * 0.4 / 0.25, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "match"),
    [
        ("fire", "fault to be one of 'hold', .*'spikes', 'lift', 'press', 'wrong_channel', got 'fire'"),
        ("hold:0.3", "fault 'hold' without a size, got 'hold:0.3'. Only push, drift, wrong_goal, press have one"),
        ("push:", "size of a fault as a fraction of the range above 0, such as push:0.25, got 'push:'"),
        ("push:big", "size of a fault"),
        ("push:-1", "size of a fault"),
        ("push:nan", "size of a fault"),
        ("push:inf", "size of a fault"),
        ("", "fault to be one of"),
    ],
)
def test_names_that_are_refused(name, match):
    with pytest.raises(InputError, match=match):
        fault_named(name)


# --- what they are made from ------------------------------------------------------------------------------------------


def test_the_path_without_noise(noisy):
    path = without_noise(noisy)
    t = np.linspace(0, 1, 600)
    error = np.std(path - np.column_stack([np.sin(3 * t), np.cos(2 * t)]), axis=0)
    assert np.all(error < 0.65 * np.array([0.01, 0.03]))
    gaps = noisy.copy()
    gaps[100:130] = np.nan
    assert np.abs(without_noise(gaps) - path).max() < 0.1


def test_the_largest_extent(letter):
    gaps = np.array(letter)
    gaps[3] = np.nan
    assert largest_extent(gaps) == pytest.approx(np.nanmax(np.nanmax(gaps, axis=0) - np.nanmin(gaps, axis=0)))
    assert largest_extent(np.full((4, 2), np.nan)) == 0
