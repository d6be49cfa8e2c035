"""Via-points of one execution, wherever it starts and ends."""

import numpy as np
import pytest

from probdmp import ProbabilisticDMP, synthetic_letters
from probdmp.dmp import task_for
from probdmp.errors import InputError, InputTypeError
from probdmp.execution import via_points_for

TASKS = ({}, {"start": [20.0, 5.0]}, {"goal": [14.0, 12.0], "duration": 2.0}, {"start": [-4.0, 3.0], "goal": [9.0, -2.0]})


@pytest.fixture(scope="module")
def learned():
    return ProbabilisticDMP(n_basis=12).fit(synthetic_letters(6, letters="a", dt=0.02))


@pytest.mark.parametrize("given", TASKS)
@pytest.mark.parametrize("points", [[(0.5, [8.0, 8.0])], [(0.3, [6.0, 9.0]), (0.7, [10.0, np.nan])]])
def test_executions_pass_through_the_points_whatever_their_task(learned, given, points):
    task = task_for(learned.primitive_, **given)
    planned = learned.condition(via_points_for(learned.primitive_, task, points)).rollout(**given, dt=0.01)
    for part, position in points:
        there = planned.positions[round(part * (len(planned.times) - 1))]
        seen = ~np.isnan(position)
        assert np.all(np.abs(there - position)[seen] < 0.05 * learned.primitive_.ranges[seen])


def test_points_that_are_none_are_refused(learned):
    task = task_for(learned.primitive_)
    for wrong in ([(0, [1, 2])], [(1.5, [1, 2])], [("a", [1, 2])], [(0.5, [1, 2, 3])], [(0.5, [1, np.inf])]):
        with pytest.raises((InputError, InputTypeError)):
            via_points_for(learned.primitive_, task, wrong)
