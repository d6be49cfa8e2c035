"""Faults: pure, seeded, and never visible by the sensor noise alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from probdmp.demonstrations import FAULTS, hold, noise_stds, synthetic_letters

seeds = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def letter():
    return synthetic_letters(1, letters="e", dt=0.01)[0].positions


@given(seeds, st.sampled_from(sorted(FAULTS)), st.floats(0, 1))
def test_every_fault_leaves_what_came_before_it(seed, fault, place):
    positions = synthetic_letters(1, letters="s", dt=0.02)[0].positions
    before, onset = positions.copy(), 1 + int(place * (len(positions) - 2))
    faulty = FAULTS[fault](positions, onset, np.random.default_rng(seed))
    assert faulty.shape == positions.shape
    np.testing.assert_array_equal(faulty[:onset], positions[:onset])
    assert np.isfinite(faulty).all()
    np.testing.assert_array_equal(positions, before)  # a pure function
    assert not np.shares_memory(faulty, positions)


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_is_decided_by_its_seed(letter, fault):
    one, same, other = (FAULTS[fault](letter, 40, np.random.default_rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert np.any(one != other)


def test_hold_stays_at_the_last_free_position(letter):
    onset = len(letter) // 2
    held = np.mean([hold(letter, onset, np.random.default_rng(seed))[onset:] for seed in range(400)], axis=0)
    level = noise_stds(letter)
    assert np.abs((held - letter[onset - 1]) / level).max() < 5 / np.sqrt(400)


def test_hold_has_noise_at_the_recordings_own_level(letter):
    """Neither exact repeats nor the onset of noise may give it away."""
    onset = len(letter) // 3
    draws = np.stack([hold(letter, onset, np.random.default_rng(seed))[onset:] for seed in range(100)]) - letter[onset - 1]
    np.testing.assert_allclose(draws.std(axis=(0, 1)), noise_stds(letter), rtol=0.05)
    flat = draws.reshape(100, -1)
    assert abs(np.mean(flat[:, 2:] * flat[:, :-2])) < 0.02 * flat.var()  # white
    assert len(np.unique(flat)) == flat.size


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_hold_scales_with_the_units(letter, unit):
    one, other = (hold(letter * u, 30, np.random.default_rng(0)) for u in (1.0, unit))
    np.testing.assert_allclose(other, one * unit, rtol=1e-9)


def test_a_still_recording_without_noise_is_held_exactly():
    positions = np.linspace(0, 1, 50)[:, None]
    np.testing.assert_allclose(hold(positions, 20, np.random.default_rng(0))[20:], positions[19, 0], atol=1e-12)


def test_hold_takes_frozen_recordings(letter):
    assert not letter.flags.writeable
    assert hold(letter, 10, np.random.default_rng(0)).flags.writeable


def test_hold_after_a_missing_sample_stays_at_the_last_measured_position(letter):
    gaps = letter.copy()
    gaps[37:40] = np.nan
    held = hold(gaps, 40, np.random.default_rng(0))
    np.testing.assert_allclose(held[40:], np.broadcast_to(letter[36], held[40:].shape), atol=6 * noise_stds(letter).max())
