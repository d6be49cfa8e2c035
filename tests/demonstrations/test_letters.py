"""The built-in letters: one writer's, reproducible, with a truth that is exact."""

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from probdmp.demonstrations import LETTERS, WriterVariation, noise_stds, synthetic_letters, written_letters
from probdmp.demonstrations.letter_plans import letter_plan
from probdmp.demonstrations.sigma_lognormal import displacements, speeds
from probdmp.errors import InputError, InputTypeError

STILL = WriterVariation(**{field.name: 0.0 for field in fields(WriterVariation)})


@pytest.fixture(scope="module")
def written():
    return written_letters(4, seed=3)


def test_twenty_two_letters_of_one_stroke():
    assert LETTERS == "abcdefghklmnopqrsuvwyz"


def test_recordings_are_the_truth_and_white_noise(written):
    residuals = np.vstack([w.demonstration.positions - w.positions for w in written])
    n, std = len(residuals), WriterVariation().sensor_noise
    np.testing.assert_allclose(residuals.std(axis=0), std, rtol=5 / np.sqrt(2 * n))
    np.testing.assert_allclose(residuals.mean(axis=0), 0, atol=5 * std / np.sqrt(n))
    assert abs(np.corrcoef(residuals[1:, 0], residuals[:-1, 0])[0, 1]) < 5 / np.sqrt(n)


def test_positions_are_the_strokes_from_where_the_pen_was_set_down(written):
    for w in written:
        np.testing.assert_array_equal(w.positions, w.targets[0] + displacements(w.strokes, w.demonstration.times))
        assert len(w.strokes.onsets) == len(w.targets) - 1


@pytest.mark.parametrize("letter", LETTERS)
def test_velocities_and_accelerations_are_slopes(letter):
    """By the central difference, whose error falls with the square of the step: steps of 1 ms."""
    (w,) = written_letters(1, letters=letter, dt=1e-3)
    for values, slopes in ((w.positions, w.velocities), (w.velocities, w.accelerations)):
        by_difference = (values[2:] - values[:-2]) / 2e-3
        np.testing.assert_allclose(by_difference, slopes[1:-1], atol=2e-3 * np.abs(slopes).max())


@pytest.mark.parametrize("letter", LETTERS)
def test_the_pen_comes_and_goes_nearly_at_rest_and_never_jumps(letter):
    """At the ends 0.13 % of a stroke is missing; in between no stroke accelerates faster than a tenth of a second allows."""
    for w in written_letters(3, letters=letter, dt=1e-3):
        speed = np.linalg.norm(w.velocities, axis=1)
        assert max(speed[0], speed[-1]) < 0.05 * speed.max()
        assert np.linalg.norm(w.positions[0] - w.targets[0]) < 0.005 * w.strokes.amplitudes[0] + 1e-9
        assert np.linalg.norm(w.positions[-1] - w.targets[-1]) < 0.05
        assert np.abs(np.diff(speed)).max() < 0.05 * speed.max()


@pytest.mark.parametrize("letter", LETTERS)
def test_every_stroke_is_seen_in_the_recording(letter):
    for w in written_letters(3, letters=letter):
        times = w.demonstration.times
        assert (w.strokes.instants(-3.0) >= -1e-9).all()
        assert (w.strokes.instants(3.0) <= times[-1] + w.demonstration.dt + 1e-9).all()
        peaks = times[speeds(w.strokes, times).argmax(axis=0)]
        assert (np.diff(peaks) > 0).all()  # in the order of writing


def test_the_same_seed_gives_the_same_letters():
    one, again, other = (synthetic_letters(2, seed=seed, letters="ab") for seed in (1, 1, 2))
    assert [d.fingerprint for d in one] == [d.fingerprint for d in again]
    assert not {d.fingerprint for d in one} & {d.fingerprint for d in other}


@given(st.sets(st.sampled_from(LETTERS), min_size=1, max_size=4), st.integers(1, 3), st.integers(0, 2**64))
def test_a_repetition_depends_on_its_seed_letter_and_number_alone(letters, n, seed):
    together = synthetic_letters(n + 1, seed, "".join(letters), dt=0.05)
    assert [d.label for d in together] == [letter for letter in letters for _ in range(n + 1)]
    for letter in letters:
        alone = synthetic_letters(n, seed, letter, dt=0.05)
        assert [d.fingerprint for d in alone] == [d.fingerprint for d in together if d.label == letter][:n]


def test_letters_and_their_truth_are_the_same_data():
    assert [d.fingerprint for d in synthetic_letters(2, 5, "ks")] == [
        w.demonstration.fingerprint for w in written_letters(2, 5, "ks")
    ]


def test_the_sampling_rate_changes_nothing_but_the_samples():
    (coarse,), (fine,) = (written_letters(1, letters="g", dt=dt) for dt in (0.02, 0.01))
    np.testing.assert_allclose(coarse.positions, fine.positions[::2][: len(coarse.positions)], atol=1e-12)


def test_without_variation_repetitions_are_the_plan_itself():
    first, second = written_letters(2, letters="z", variation=STILL)
    np.testing.assert_array_equal(first.demonstration.positions, second.demonstration.positions)
    plan = letter_plan("z")
    np.testing.assert_allclose(first.strokes.end_angles - first.strokes.start_angles, plan.bends)
    np.testing.assert_allclose(first.targets[:, 1], 10 * plan.targets[:, 1])  # the x-height is 10 mm; slant moves x alone
    assert (first.targets[:, 0] - 10 * plan.targets[:, 0] >= -1e-12).all()


@pytest.mark.parametrize("name", [field.name for field in fields(WriterVariation)])
def test_each_variation_varies_what_it_says_and_nothing_else(name):
    """One at a time, at its default: what is measured over many repetitions against what is documented."""
    std = getattr(WriterVariation(), name)
    varied = WriterVariation(**{field.name: std if field.name == name else 0.0 for field in fields(WriterVariation)})
    repetitions = written_letters(60, letters="h", variation=varied)
    (plain,) = written_letters(1, letters="h", variation=STILL)
    durations = np.array([w.strokes.instants(3.0).max() for w in repetitions]) / plain.strokes.instants(3.0).max()
    targets = np.array([w.targets for w in repetitions])
    heights = np.ptp(targets[:, :, 1], axis=1) / np.ptp(plain.targets[:, 1])
    bends = np.array([w.strokes.end_angles - w.strokes.start_angles for w in repetitions])
    stem = targets[:, 0] - targets[:, 1]
    measured = {
        "shape": (targets.std(axis=0) / 10).mean(),
        "bend": np.degrees(bends.std(axis=0)).mean(),
        "size": np.log(heights).std(),
        "aspect": 2 * np.log(heights).std(),  # half of it in the height, half in the width
        "slant": np.degrees(np.arctan2(stem[:, 0], stem[:, 1])).std(),
        "position": targets.std(axis=0).mean(),
        "tempo": np.log(durations).std(),
        "timing": np.array([w.strokes.log_response_times for w in repetitions]).std(axis=0).mean() / 0.25,
        "sensor_noise": np.mean([(w.demonstration.positions - w.positions).std() for w in repetitions]),
    }
    assert measured[name] == pytest.approx(std, rel=0.35)
    unmoved = {"bend", "tempo", "timing", "sensor_noise"} - {name}
    for other in unmoved:
        if (name, other) not in {
            ("timing", "tempo"),
            ("shape", "tempo"),
            ("bend", "tempo"),
            ("size", "tempo"),
            ("aspect", "tempo"),
        }:
            assert measured[other] < 0.2 * getattr(WriterVariation(), other)


def test_larger_letters_take_little_longer():
    """Isochrony: of twice the size in 2^0.3 of the time."""
    small, large = (max(written_letters(40, letters="o"), key=lambda w, s=s: s * np.ptp(w.positions[:, 1])) for s in (-1, 1))
    growth = np.ptp(large.positions[:, 1]) / np.ptp(small.positions[:, 1])
    assert growth > 1.15
    ratio = np.exp(large.strokes.log_time_delays).sum() / np.exp(small.strokes.log_time_delays).sum()
    assert ratio < growth


def normalised(w):
    """(60, 2) array, millimetres: evenly over its time, around its mean."""
    grid = np.linspace(0, len(w.positions) - 1, 60)
    path = np.column_stack([np.interp(grid, np.arange(len(w.positions)), column) for column in w.positions.T])
    return path - path.mean(axis=0)


def test_repetitions_are_of_one_hand():
    """At one place and tempo, every repetition is nearer to the mean of its own letter than to that of any other."""
    means = {letter: np.mean([normalised(w) for w in written_letters(10, 1, letter)], axis=0) for letter in LETTERS}
    for w in written_letters(5, 2):
        distances = {letter: np.linalg.norm(normalised(w) - mean) for letter, mean in means.items()}
        assert min(distances, key=distances.__getitem__) == w.demonstration.label


def test_a_letter_is_as_large_as_its_plan_says():
    (w,) = written_letters(1, letters="o", variation=STILL)
    assert np.ptp(w.positions[:, 1]) == pytest.approx(10, abs=0.8)
    assert noise_stds(w.demonstration.positions).max() < 0.01


@pytest.mark.parametrize(
    ("arguments", "error", "match"),
    [
        ({"letters": ""}, InputError, "different letters, at least one, got ''"),
        ({"letters": "aba"}, InputError, "different letters, at least one, got 'aba'"),
        ({"letters": "ai"}, InputError, "each of letters to be one of 'a', .*, got 'i'"),
        ({"letters": ["a"]}, InputTypeError, "letters as one string, got .'a'.*Join them"),
        ({"n_demonstrations": 0}, InputError, "n_demonstrations as a whole number from 1 up, got 0"),
        ({"seed": -1}, InputError, "seed as a whole number from 0 up, got -1"),
        ({"dt": 10}, InputError, "dt from 0.0001 to 0.1 seconds, got 10.*milliseconds"),
        ({"variation": 0.1}, InputTypeError, "variation as a WriterVariation, got float"),
    ],
)
def test_what_cannot_be_written(arguments, error, match):
    for function in (synthetic_letters, written_letters):
        with pytest.raises(error, match=match):
            function(**arguments)


@pytest.mark.parametrize(
    ("variation", "error", "match"),
    [
        ({"shape": -0.1}, InputError, "shape >= 0, a standard deviation, at most 0.5, got -0.1"),
        ({"tempo": 7}, InputError, "tempo >= 0, a standard deviation, at most 0.5, got 7"),
        ({"slant": np.nan}, InputError, "slant finite"),
        ({"size": "big"}, InputTypeError, "size as real numbers"),
    ],
)
def test_what_is_no_variation(variation, error, match):
    with pytest.raises(error, match=match):
        WriterVariation(**variation)


def test_the_wildest_writer_still_writes():
    wild = WriterVariation(0.5, 15, 0.5, 0.5, 15, 1e3, 0.5, 0.5, 1e3)
    for w in written_letters(3, variation=wild, dt=0.05):
        assert all(np.isfinite(a).all() for a in (w.demonstration.positions, w.velocities, w.accelerations))
