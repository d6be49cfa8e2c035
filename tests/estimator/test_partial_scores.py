"""Which movement a drawing is one of, while it is still being drawn."""

from dataclasses import replace

import numpy as np
import pytest

from probdmp import PrimitiveLibrary, ProbabilisticDMP, synthetic_letters
from probdmp.demonstrations import Demonstration
from probdmp.estimator.partial_scores import log_densities_so_far

DT = 0.02
LETTERS = "amsv"


@pytest.fixture(scope="module")
def library():
    written = synthetic_letters(6, letters=LETTERS, dt=DT)
    return PrimitiveLibrary.fit({letter: [d for d in written if d.label == letter] for letter in LETTERS}, n_basis=12)


@pytest.fixture(scope="module")
def fresh():
    return synthetic_letters(5, seed=7, letters=LETTERS, dt=DT)


def likeliest(scores):
    return max(scores, key=scores.__getitem__)


def test_letters_are_recognised_when_they_are_drawn_and_most_before(library, fresh):
    done = [likeliest(log_densities_so_far(library, d, is_complete=True)) == d.label for d in fresh]
    half = [replace(d, positions=d.positions[: d.n_samples // 2]) for d in fresh]
    begun = [likeliest(log_densities_so_far(library, d)) == d.label for d in half]
    assert np.mean(done) >= 0.95
    assert np.mean(begun) >= 0.7


def test_slow_writers_are_recognised_too(library, fresh):
    slow = [replace(d, dt=1.5 * DT) for d in fresh]
    assert np.mean([likeliest(log_densities_so_far(library, d)) == d.label for d in slow]) >= 0.9


def test_it_is_the_log_likelihood_of_a_recording_of_known_duration(library, fresh):
    short = Demonstration(fresh[0].positions[:30], DT)
    scores = log_densities_so_far(library, short, is_complete=True)
    for label, learned in library.items():
        moved = short.positions - short.positions[0] + learned.primitive_.start
        assert scores[label] == pytest.approx(learned.score_samples([moved], DT)[0] / 30, rel=1e-9)


def test_where_it_is_drawn_does_not_matter(library, fresh):
    moved = replace(fresh[0], positions=fresh[0].positions + 40)
    before, after = log_densities_so_far(library, fresh[0], True), log_densities_so_far(library, moved, True)
    assert after == pytest.approx(before, rel=1e-6)


def test_movements_of_other_axes_are_left_out(library, fresh):
    line = ProbabilisticDMP(n_basis=5).fit([d.positions[:, :1] for d in fresh[:3]], DT)
    assert set(log_densities_so_far({**library, "line": line}, fresh[0])) == set(LETTERS)
