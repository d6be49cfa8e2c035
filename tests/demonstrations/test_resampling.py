"""From recordings with their own clock to a constant rate."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from probdmp.demonstrations import Demonstration, channel_from_times, demonstration_from_times, signals_on_phases
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


# --- sensors with a clock of their own --------------------------------------------------------------------------------


def recording(n_samples=11, dt=0.1, **channels):
    positions = np.random.default_rng(0).standard_normal((n_samples, 2))
    return Demonstration(positions, dt, "reach", ("x", "y"), "m", channels)


@given(st.integers(0, 1000), st.integers(1, 20), st.floats(1e-3, 1.0), st.floats(-0.45, 0.45))
def test_each_reading_is_at_the_sample_nearest_to_it(seed, n_readings, dt, jitter):
    rng = np.random.default_rng(seed)
    demonstration = recording(40, dt)
    places = np.sort(rng.choice(np.arange(1, 39), n_readings, replace=False))
    values = rng.standard_normal(n_readings)
    seen = channel_from_times(demonstration, "force", (places + jitter) * dt, values)
    wanted = np.full(40, np.nan)
    wanted[places] = values
    np.testing.assert_array_equal(seen.channels["force"], wanted)


def test_all_else_stays_as_it_is():
    before = recording(heat=np.arange(11.0))
    after = channel_from_times(before, "force", [0.0, 1.0], [1.0, 2.0])
    np.testing.assert_array_equal(after.positions, before.positions)
    np.testing.assert_array_equal(after.channels["heat"], np.arange(11.0))
    assert (after.dt, after.label, after.names, after.units) == (before.dt, "reach", ("x", "y"), "m")
    assert "force" not in before.channels
    again = channel_from_times(after, "force", [0.5], [3.0])  # the same name replaces it
    assert np.isnan(again.channels["force"]).sum() == 10


def test_several_outputs_are_numbered():
    seen = channel_from_times(recording(), "imu", [0.1, 0.3], [[1.0, 2.0, 3.0], [4.0, np.nan, 6.0]])
    assert list(seen.channels) == ["imu_0", "imu_1", "imu_2"]
    np.testing.assert_array_equal([seen.channels[f"imu_{i}"][[1, 3]] for i in range(3)], [[1, 4], [2, np.nan], [3, 6]])
    one = channel_from_times(recording(), "scale", [0.1], [[5.0]])
    assert list(one.channels) == ["scale"]


def test_a_sensor_that_has_measured_nothing():
    assert np.isnan(channel_from_times(recording(), "force", [], []).channels["force"]).all()


@pytest.mark.parametrize(
    ("times", "values", "error", "match"),
    [
        ([0.0, 0.04], [1, 2], InputError, r"at most one reading per sample of 0\.1 s, got several\. Take every second one"),
        (
            [-0.06],
            [1],
            InputError,
            r"readings within the recording, got some from -0\.06 to -0\.06 s\. The recording",
        ),
        ([1.06], [1], InputError, "readings within the recording"),
        ([0.1, 0.2], [1], InputError, r"values of 'force' of shape \(2,\), got \(1,\)"),
        ([0.1], [[1.0], [2.0]], InputError, r"values of 'force' of shape \(1, O\), got \(2, 1\)"),
        ([0.1], [np.inf], InputError, "values of 'force' finite or NaN"),
        ([np.nan], [1.0], InputError, "times finite"),
        (["now"], [1.0], InputTypeError, "times as real numbers"),
        ([0.1], ["much"], InputTypeError, "values of 'force' as real numbers"),
    ],
)
def test_readings_that_cannot_be_placed(times, values, error, match):
    with pytest.raises(error, match=match):
        channel_from_times(recording(), "force", times, values)


def test_a_channel_is_not_named_as_a_degree_of_freedom():
    with pytest.raises(InputError, match="channels named otherwise than the degrees of freedom"):
        channel_from_times(recording(), "x", [0.1], [1.0])


# --- common phases ----------------------------------------------------------------------------------------------------


def test_phases_of_positions_and_channels():
    """From first to last sample of each recording, along straight lines, over what was measured."""
    ramp = np.linspace(0, 1, 11)
    gaps = np.where(np.arange(11) % 5 == 0, 10 * ramp, np.nan)
    long = Demonstration(np.column_stack([ramp, -ramp]), 0.1, channels={"force": gaps, "heat": ramp})
    short = Demonstration(2 * np.column_stack([ramp, -ramp])[::5], 0.1, channels={"force": gaps[::5]})
    paths = signals_on_phases([long, short], 7, ["force"])
    phases = np.linspace(0, 1, 7)
    assert paths.shape == (2, 7, 3)
    np.testing.assert_allclose(paths[0], np.column_stack([phases, -phases, 10 * phases]), atol=1e-12)
    np.testing.assert_allclose(paths[1], np.column_stack([2 * phases, -2 * phases, 10 * phases]), atol=1e-12)
    np.testing.assert_array_equal(signals_on_phases([long], 7), paths[:1, :, :2])


def test_what_was_not_measured_at_an_end_is_as_next_to_it():
    late = np.array([np.nan, np.nan, 2.0, 3.0, np.nan])
    (path,) = signals_on_phases([Demonstration(np.zeros((5, 1)), 0.1, channels={"force": late})], 5, ["force"])
    np.testing.assert_array_equal(path[:, 1], [2, 2, 2, 3, 3])
