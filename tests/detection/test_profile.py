"""What demonstrations show beside their path."""

from dataclasses import replace

import numpy as np
import pytest

from probdmp.demonstrations import Demonstration
from probdmp.detection.profile import LEAST_TEMPO_STD, ExecutionProfile
from probdmp.errors import InputError, InputTypeError


def recording(positions, dt=0.1):
    return Demonstration(np.asarray(positions, dtype=float), dt)


def test_tempo_is_the_spread_of_log_durations():
    demos = [recording(np.random.default_rng(k).standard_normal((n, 1))) for k, n in enumerate((21, 26, 41))]
    expected = np.std(np.log([2.0, 2.5, 4.0]), ddof=1)
    assert float(ExecutionProfile.of(demos).tempo_std) == pytest.approx(expected, rel=1e-9)


def test_executions_of_equal_length_do_not_vouch_for_the_next():
    demos = [recording(np.random.default_rng(k).standard_normal((21, 1))) for k in range(3)]
    assert float(ExecutionProfile.of(demos).tempo_std) == LEAST_TEMPO_STD
    assert float(ExecutionProfile.of(demos[:1]).tempo_std) > LEAST_TEMPO_STD


def test_repeats_and_jumps_are_the_largest_of_all():
    steady = np.linspace(0, 1, 20)
    still, jumping = np.array(steady), np.array(steady)
    still[8:12] = still[8]
    jumping[10] += 0.7
    profile = ExecutionProfile.of([recording(np.stack([still, steady], 1)), recording(np.stack([steady, jumping], 1))])
    np.testing.assert_allclose(profile.longest_repeats, [0.3, 0.0])
    assert profile.largest_jumps[1] == pytest.approx(1.4, rel=1e-6)
    assert profile.largest_jumps[0] < 0.3


def test_usual_gaps_are_the_longest_of_usual_ones():
    """In seconds, the median of each recording; one that was lost now and then is no slower; infinite if hardly measured."""
    rng = np.random.default_rng(0)
    walks = [np.cumsum(rng.standard_normal((41, 4)), axis=0) for _ in range(2)]
    for every, walk in zip((4, 5), walks, strict=True):
        walk[np.arange(41) % every > 0, 1] = np.nan
        walk[rng.random(41) < 0.2, 2] = np.nan
        walk[1:, 3] = np.nan
    profile = ExecutionProfile.of([recording(walk) for walk in walks])
    np.testing.assert_allclose(profile.usual_gaps, [0.1, 0.5, 0.1, np.inf])
    np.testing.assert_array_equal(ExecutionProfile.from_state(profile.state(), 4).usual_gaps, profile.usual_gaps)
    assert profile.state()["usual_gaps"][3] is None  # JSON knows no infinity
    for name in ("noise_stds", "longest_repeats", "largest_jumps"):
        assert np.isfinite(getattr(profile, name)).all()


def test_signals_may_be_others_than_positions():
    """All that is measured as it is, at the samples of the recording."""
    demos = [recording(np.random.default_rng(k).standard_normal((21, 2))) for k in range(3)]
    felt = [np.column_stack([d.positions, 5 + d.positions[:, 0]]) for d in demos]
    profile, bare = ExecutionProfile.of(demos, felt), ExecutionProfile.of(demos)
    for name in ("noise_stds", "longest_repeats", "largest_jumps", "usual_gaps"):
        np.testing.assert_array_equal(getattr(profile, name)[:2], getattr(bare, name))
        np.testing.assert_allclose(getattr(profile, name)[2], getattr(bare, name)[0])
    assert profile.tempo_std == bare.tempo_std


def test_missing_samples_hide_nothing_else(training):
    lossy = []
    for k, d in enumerate(training["s"]):
        positions = np.array(d.positions)
        positions[np.random.default_rng(k).random(len(positions)) < 0.1] = np.nan
        lossy.append(replace(d, positions=positions))
    whole, found = ExecutionProfile.of(training["s"]), ExecutionProfile.of(lossy)
    np.testing.assert_allclose(found.noise_stds, whole.noise_stds, rtol=0.6)
    assert np.all(found.largest_jumps <= whole.largest_jumps)
    assert np.all(found.largest_jumps > 0)


def test_the_state_is_the_profile(training):
    profile = ExecutionProfile.of(training["s"])
    again = ExecutionProfile.from_state(profile.state(), 2)
    for name in profile.state():
        np.testing.assert_array_equal(getattr(again, name), getattr(profile, name))
    with pytest.raises((InputError, InputTypeError)):
        ExecutionProfile.from_state(profile.state(), 3)
