"""What a further demonstration has changed, in numbers and words."""

from dataclasses import replace

import numpy as np
import pytest

from probdmp import ProbabilisticDMP, synthetic_letters
from probdmp.execution import MovementChange, movement_change


def learned(count, shift=0.0):
    letters = [replace(d, positions=d.positions + shift) for d in synthetic_letters(5, letters="a", dt=0.02)]
    return ProbabilisticDMP(n_basis=10).fit(letters[:count]).primitive_


def test_nothing_has_changed():
    change = movement_change(learned(3), learned(3))
    assert (change.shift, change.widening) == (0.0, 1.0)
    assert str(change) == "moved the mean by 0 units and left the band as wide"


def test_a_movement_elsewhere_has_moved_by_that_much():
    change = movement_change(learned(3), learned(3, shift=3.0))
    assert change.shift == pytest.approx(np.sqrt(18), rel=1e-6)
    assert change.widening == pytest.approx(1, rel=1e-6)


@pytest.mark.parametrize(
    ("widening", "words"),
    [(0.82, "narrowed the band by 18 %"), (1.1, "widened the band by 10 %"), (3.0, "made the band 3 times as wide")],
)
def test_it_says_so(widening, words):
    assert str(MovementChange(1.2, widening)) == f"moved the mean by 1.2 units and {words}"
