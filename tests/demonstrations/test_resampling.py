"""From recordings with their own clock to a constant rate."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from probdmp.demonstrations import demonstration_from_times
from probdmp.errors import InputError, InputTypeError

seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.integers(3, 200), st.sampled_from([1e-3, 0.01, 0.1, 1 / 3]), st.sampled_from([0.0, 1.5e9, -17.3]))
def test_a_regular_clock_changes_nothing(seed, n_samples, dt, epoch):
    """Also that of a computer, which counts from 1970."""
    positions = np.random.default_rng(seed).standard_normal((n_samples, 2))
    demo = demonstration_from_times(epoch + np.arange(n_samples) * dt, positions)
    assert demo.n_samples == n_samples
    np.testing.assert_allclose(demo.positions, positions, atol=1e-9 if epoch < 1e9 else 0.01)
    assert demo.dt == pytest.approx(dt, rel=1e-12 if epoch < 1e9 else 1e-3)


@given(seeds, st.floats(0.003, 0.2))
def test_straight_lines_stay_straight_under_jitter(seed, dt):
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.005, 0.02, 100)) + 3
    slopes = rng.standard_normal(3)
    demo = demonstration_from_times(times, times[:, None] * slopes, dt)
    np.testing.assert_allclose(demo.positions, (times[0] + demo.times)[:, None] * slopes, atol=1e-9)
    assert demo.dt == dt
    assert times[-1] - dt < times[0] + demo.duration <= times[-1] * (1 + 1e-9)


@given(seeds, st.integers(3, 200), st.floats(2e-3, 0.5), st.sampled_from([0.0, 1.5e9, 1.9e9]))
def test_the_last_sample_is_kept(seed, n_samples, dt, epoch):
    """Whatever the jitter: dt is that near the median spacing of which the recording is a multiple. Also for Unix times."""
    rng = np.random.default_rng(seed)
    times = epoch + np.cumsum(rng.uniform(0.8, 1.2, n_samples)) * dt
    positions = rng.standard_normal((n_samples, 2))
    demo = demonstration_from_times(times, positions)
    assert demo.duration == pytest.approx(times[-1] - times[0], rel=1e-9)
    np.testing.assert_allclose(demo.positions[[0, -1]], positions[[0, -1]], atol=1e-6)
    median = np.median(np.diff(times))
    assert abs(demo.dt / median - 1) <= 0.5 / (demo.n_samples - 1) + 0.25 / (demo.n_samples - 1) ** 2 + 1e-9


def test_dt_is_the_median_spacing_unless_given():
    times = np.array([0.0, 0.1, 0.2, 0.9, 1.0, 1.1])
    assert demonstration_from_times(times, np.zeros((6, 1))).dt == pytest.approx(0.1)
    demo = demonstration_from_times(times, times[:, None], 0.25, "a", ("x",), "mm")
    assert (demo.dt, demo.label, demo.names, demo.units) == (0.25, "a", ("x",), "mm")
    np.testing.assert_allclose(demo.positions[:, 0], [0, 0.25, 0.5, 0.75, 1.0])


@pytest.mark.parametrize(
    ("times", "match"),
    [
        ([0.0, 2.0, 1.0, 3.0], r"times that increase strictly, got .*2\.0.* s followed by .*1\.0.* s at sample 2\. Sort"),
        ([0.0, 1.0, 1.0, 3.0], r"times that increase strictly, got .*1\.0.* s followed by .*1\.0.* s at sample 2\. Sort"),
        ([3.0, 2.0, 1.0, 0.0], "times that increase strictly, .* at sample 1"),
        ([0.0, np.nan, 1.0, 2.0], r"times finite, got nan at index \[1\]"),
        ([0.0, 1.0, 2.0, np.inf], r"times finite, got inf at index \[3\]"),
        ([0.0, 1.0, 2.0], r"times of shape \(4,\), got \(3,\)\. One time per row"),
        ([[0.0], [1.0], [2.0], [3.0]], r"times of shape \(4,\), got \(4, 1\)"),
        ([0.0, 1e-9, 2e-9, 1.0], r"at most 100000 samples, got 1e\+09\. Choose a larger dt"),
    ],
)
def test_times_that_cannot_be_used(times, match):
    with pytest.raises(InputError, match=f"Expected {match}"):
        demonstration_from_times(times, np.zeros((4, 2)))


@pytest.mark.parametrize("times", [["a", "b", "c", "d"], np.array([0, 1, 2, 3], "M8[s]"), [None] * 4])
def test_times_that_are_no_numbers(times):
    with pytest.raises(InputTypeError, match=r"Expected times as real numbers, got dtype"):
        demonstration_from_times(times, np.zeros((4, 2)))


@pytest.mark.parametrize(
    ("positions", "match"),
    [
        (np.zeros((4, 0)), r"at least one degree of freedom"),
        (np.zeros(4), r"positions of shape \(T, D\), got \(4,\)\. One row per time"),
        (np.full((4, 2), np.nan), r"positions finite, got nan at index \[0, 0\] \(8 such values\)\. Drop or interpolate"),
    ],
)
def test_positions_that_cannot_be_used(positions, match):
    with pytest.raises(InputError, match=match):
        demonstration_from_times(np.arange(4.0), positions)


@pytest.mark.parametrize("n", [0, 1])
def test_too_few_samples(n):
    with pytest.raises(InputError, match=rf"Expected at least two samples.*, got \({n}, 2\)"):
        demonstration_from_times(np.arange(float(n)), np.zeros((n, 2)))


@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan])
def test_dt_that_cannot_be_used(dt):
    with pytest.raises(InputError, match="Expected dt > 0 in seconds"):
        demonstration_from_times(np.arange(4.0), np.zeros((4, 2)), dt)


def test_a_dt_that_leaves_too_few_samples_is_refused():
    with pytest.raises(InputError, match=r"positions with 3 to 100000 samples, got \(1, 2\)"):
        demonstration_from_times(np.arange(4.0), np.zeros((4, 2)), 10.0)
