"""Still ends are cut, and nothing else is."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from probdmp.demonstrations import Demonstration, synthetic_arm_movements, synthetic_letters, trim_still_ends
from probdmp.errors import InputError


def assert_same(one, other):
    np.testing.assert_array_equal(one.positions, other.positions)
    assert (one.dt, one.label, one.names, one.units) == (other.dt, other.label, other.names, other.units)


def held(demonstration, before, after):
    """Standing still before and after, with channels that are a count of samples."""
    path = demonstration.positions
    positions = np.vstack([np.repeat(path[:1], before, 0), path, np.repeat(path[-1:], after, 0)])
    return replace(demonstration, positions=positions, channels={"count": np.arange(float(len(positions)))})


def minimum_jerk(n, n_dof, dt):
    phase = np.linspace(0, 1, n)
    course = 10 * phase**3 - 15 * phase**4 + 6 * phase**5
    return Demonstration(np.outer(course, np.arange(1, n_dof + 1.0)), dt, "a", units="m")


@given(
    st.integers(40, 200), st.integers(1, 3), st.sampled_from([0.001, 0.01, 0.02]), st.integers(0, 90), st.integers(0, 90),
    st.floats(1e-6, 1e6),
)  # fmt: skip
def test_padding_is_cut_to_a_few_samples_and_the_movement_stays(n, n_dof, dt, before, after, scale):
    movement = minimum_jerk(n, n_dof, dt)
    padded = held(replace(movement, positions=movement.positions * scale), before, after)
    trimmed = trim_still_ends(padded)
    window = max(round(0.05 / dt), 1)
    assert trimmed.n_samples <= n + 2 * window
    first, last = trimmed.channels["count"][[0, -1]]
    speeds = np.linalg.norm(np.diff(padded.positions, axis=0), axis=1)
    away = np.concatenate([speeds[: int(first)], speeds[int(last) :]])
    assert away.max(initial=0.0) <= 0.03 * speeds.max() * (1 + 1e-9) * window
    np.testing.assert_array_equal(trimmed.positions, padded.positions[int(first) : int(last) + 1])
    assert_same(trim_still_ends(trimmed), trimmed)


@given(st.integers(0, 2**32 - 1), st.floats(0, 0.3), st.integers(3, 60), st.floats(0, 0.05))
def test_trimming_again_changes_nothing(seed, missing, n, noise):
    rng = np.random.default_rng(seed)
    path = np.cumsum(rng.standard_normal((n, 2)) * rng.integers(0, 2, (n, 1)), axis=0) + noise * rng.standard_normal((n, 2))
    path[rng.uniform(size=path.shape) < missing] = np.nan
    once = trim_still_ends(Demonstration(path, 0.02))
    assert_same(trim_still_ends(once), once)


def test_noise_of_a_sensor_does_not_keep_what_stands_still():
    (letter,) = synthetic_letters(1, letters="a")
    noisy = held(letter, 100, 100)
    noisy = replace(noisy, positions=noisy.positions + 0.01 * np.random.default_rng(0).standard_normal(noisy.positions.shape))
    assert abs(trim_still_ends(noisy).n_samples - letter.n_samples) <= 12


def test_pauses_within_stay():
    first = minimum_jerk(60, 2, 0.01).positions
    second = first + np.array([1.0, 2.0])
    both = Demonstration(np.vstack([first, [first[-1]] * 200, second]), 0.01)
    assert trim_still_ends(held(both, 50, 50)).n_samples >= 300


def test_a_movement_within_a_gap_stays():
    movement = held(minimum_jerk(50, 2, 0.01), 50, 50)
    positions = movement.positions.copy()
    positions[40:110, 1] = np.nan
    trimmed = trim_still_ends(replace(movement, positions=positions))
    assert trimmed.channels["count"][0] <= 39
    assert trimmed.channels["count"][-1] >= 110
    assert not np.isnan(trimmed.positions[[0, -1]]).any()


@pytest.mark.parametrize("positions", [np.ones((50, 2)), np.full((50, 2), np.nan), np.zeros((3, 1)), np.full((9, 1), 1e99)])
def test_what_never_moves_is_returned_as_it_is(positions):
    demonstration = Demonstration(positions, 0.01)
    assert trim_still_ends(demonstration) is demonstration


def test_a_larger_fraction_cuts_more_and_a_wrong_one_is_refused():
    movement = held(minimum_jerk(100, 1, 0.01), 20, 20)
    lengths = [trim_still_ends(movement, slowest).n_samples for slowest in (0.0, 0.03, 0.2, 0.5)]
    assert lengths == sorted(lengths, reverse=True)
    for wrong in (-0.1, 1.5, float("nan")):
        with pytest.raises(InputError, match="slowest as a number from 0 to 1"):
            trim_still_ends(movement, wrong)


def test_movements_that_begin_and_end_at_once_lose_next_to_nothing():
    for demonstration in [m.demonstration for m in synthetic_arm_movements(2)]:
        trimmed = trim_still_ends(demonstration)
        assert trimmed.n_samples >= 0.85 * demonstration.n_samples
