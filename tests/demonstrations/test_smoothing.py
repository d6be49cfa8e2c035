"""The smooth path behind a recording, and the noise of its sensor."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from probdmp.demonstrations import Demonstration, noise_stds, smooth_path, synthetic_letters
from probdmp.demonstrations.letters import WriterVariation
from probdmp.errors import InputError

seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=50)
@given(seeds, st.integers(20, 200), st.floats(1e-4, 1.0), st.floats(0.25, 0.5))
def test_cubics_are_left_untouched(seed, n_samples, dt, window):
    coefficients = np.random.default_rng(seed).standard_normal((4, 2))
    phases = np.linspace(-1, 1, n_samples)
    duration = (n_samples - 1) * dt
    powers = phases[:, None] ** np.arange(4)
    slopes = np.column_stack([np.zeros(n_samples), np.ones(n_samples), 2 * phases, 3 * phases**2]) * 2 / duration
    path = smooth_path(Demonstration(powers @ coefficients, dt), window)
    np.testing.assert_allclose(path.positions, powers @ coefficients, atol=1e-11)
    np.testing.assert_allclose(path.velocities * duration, slopes @ coefficients * duration, atol=1e-9)


@pytest.mark.parametrize(("n_samples", "window"), [(3, 0.5), (7, 0.5), (12, 0.05), (79, 0.05), (200, 0.0)])
def test_short_windows_leave_positions_as_they_are(n_samples, window):
    rng = np.random.default_rng(0)
    demo = Demonstration(rng.standard_normal((n_samples, 2)), 0.01)
    np.testing.assert_array_equal(smooth_path(demo, window).positions, demo.positions)
    parabola = Demonstration((np.arange(n_samples) * 0.01)[:, None] ** 2, 0.01)
    np.testing.assert_allclose(smooth_path(parabola, window).velocities[:, 0], 2 * parabola.times, atol=1e-10)


def test_smoothing_removes_noise_and_keeps_the_movement():
    rng, t = np.random.default_rng(0), np.linspace(0, 1, 400)[:, None]
    clean = np.hstack([np.sin(3 * t), t**2])
    path = smooth_path(Demonstration(clean + 0.01 * rng.standard_normal(clean.shape), t[1, 0]), 0.1)
    assert (path.positions - clean).std() < 0.004
    assert (path.velocities[:, 1] - 2 * t[:, 0]).std() < 0.2  # differences of the noisy samples are off by 2.8
    assert np.gradient(clean + 0.01 * rng.standard_normal(clean.shape), t[1, 0], axis=0)[:, 1].std() > 2


def test_the_window_is_a_fraction_of_the_movement():
    """The same movement at another rate is smoothed alike."""
    paths = []
    for n in (101, 401):
        t = np.linspace(0, 1, n)
        paths.append(smooth_path(Demonstration(np.sin(20 * t)[:, None], t[1]), 0.2).positions[:: (n - 1) // 100])
    np.testing.assert_allclose(paths[0], paths[1], atol=0.03)
    assert np.abs(paths[0][:, 0] - np.sin(20 * np.linspace(0, 1, 101))).max() > 0.05


def test_small_gaps_are_filled_along_straight_lines():
    t = np.arange(100.0)[:, None]
    positions = np.hstack([2 * t, 5 - t])
    gaps = positions.copy()
    gaps[10:14, 0], gaps[40, 1], gaps[60:62] = np.nan, np.nan, np.nan
    path = smooth_path(Demonstration(gaps, 1.0), 0.1)
    np.testing.assert_allclose(path.positions, positions, atol=1e-10)
    np.testing.assert_allclose(path.velocities, np.broadcast_to([2, -1], (100, 2)), atol=1e-10)


@pytest.mark.parametrize("rows", [slice(0, 1), slice(-1, None), slice(2, 90)], ids=["first", "last", "most"])
def test_gaps_that_hide_the_task_are_refused(rows):
    positions = np.ones((100, 2))
    positions[rows, 1] = np.nan
    with pytest.raises(InputError, match=r"whose y is measured at the first and last.*got \d+ of 100 samples missing\. Trim"):
        smooth_path(Demonstration(positions, 0.1, names=("x", "y")), 0.1)


# --- noise ------------------------------------------------------------------------------------------------------------


@settings(max_examples=50)
@given(seeds, st.sampled_from([1e-6, 1e-2, 1.0, 1e6]))
def test_white_noise_gives_its_own_standard_deviation(seed, std):
    noise = std * np.random.default_rng(seed).standard_normal((20_000, 1))
    np.testing.assert_allclose(noise_stds(noise), std, rtol=0.08)


def test_it_is_unbiased_at_the_length_of_a_recording():
    rng = np.random.default_rng(0)
    estimates = noise_stds(rng.standard_normal((120, 1000)) * 0.3)
    assert np.mean(estimates) == pytest.approx(0.3, rel=0.03)
    assert np.quantile(estimates, 0.01) > 0.15
    assert np.quantile(estimates, 0.99) < 0.5


@settings(max_examples=20)
@given(seeds)
def test_movement_is_ignored(seed):
    """Polynomials of the third degree do not count at all, and a sharp corner only at the few samples where it is."""
    rng = np.random.default_rng(seed)
    noise, t = 1e-3 * rng.standard_normal((300, 2)), np.linspace(0, 1, 300)[:, None]
    cubic = rng.standard_normal((4, 2))
    np.testing.assert_allclose(noise_stds(noise + t ** np.arange(4) @ cubic), noise_stds(noise), rtol=1e-9)
    corner = np.where(t < 0.5, t, 1 - t) * [100, -100]
    np.testing.assert_allclose(noise_stds(noise + corner), noise_stds(noise), rtol=0.1)


def test_letters_show_the_noise_with_which_they_were_written():
    still = WriterVariation(sensor_noise=0.0)
    for dt in (0.005, 0.01):
        noisy = np.mean([noise_stds(d.positions) for d in synthetic_letters(5, letters="aekz", dt=dt)])
        silent = np.mean([noise_stds(d.positions) for d in synthetic_letters(5, letters="aekz", dt=dt, variation=still)])
        assert noisy == pytest.approx(0.03, rel=0.15)
        assert silent < 0.01


@settings(max_examples=20)
@given(seeds, st.floats(0, 0.2))
def test_missing_samples_only_cost_precision(seed, fraction):
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((5000, 2))
    noise[rng.random(noise.shape) < fraction] = np.nan
    np.testing.assert_allclose(noise_stds(noise), 1, rtol=0.15)


@pytest.mark.parametrize("n_samples", [3, 4])
def test_too_short_to_tell(n_samples):
    np.testing.assert_array_equal(noise_stds(np.random.default_rng(0).standard_normal((n_samples, 2))), [0, 0])


def test_a_degree_of_freedom_that_was_never_measured_has_no_noise():
    positions = np.random.default_rng(0).standard_normal((50, 2))
    positions[:, 1] = np.nan
    stds = noise_stds(positions)
    assert stds[0] > 0.5
    assert stds[1] == 0
