"""What is asked of an execution: as given, or as learned."""

import numpy as np
import pytest
from strategies import make_primitive

from probdmp.demonstrations import Demonstration
from probdmp.dmp import demonstrated_tasks, task_for
from probdmp.errors import InputError, InputTypeError


@pytest.fixture(scope="module")
def primitive():
    return make_primitive(np.random.default_rng(0))


def test_what_is_not_given_is_as_learned(primitive):
    task = task_for(primitive)
    np.testing.assert_array_equal(task.start, primitive.start)
    np.testing.assert_array_equal(task.goal, primitive.goal)
    assert task.duration == primitive.duration
    assert task.duration.shape == ()
    assert task.start_velocity is None


def test_what_is_given_is_taken(primitive):
    task = task_for(primitive, [1, 2], (3, 4), 5, np.array([6, 7], dtype=np.int8))
    np.testing.assert_array_equal([task.start, task.goal, task.start_velocity], [[1, 2], [3, 4], [6, 7]])
    assert task.duration == 5


@pytest.mark.parametrize("name", ["start", "goal", "start_velocity"])
@pytest.mark.parametrize(
    ("bad", "error", "match"),
    [
        ([1.0], InputError, r"of shape \(2,\), got \(1,\)\. One number for each of q0, q1"),
        (1.0, InputError, r"of shape \(2,\), got \(\)"),
        ([[1.0, 2.0]], InputError, r"of shape \(2,\), got \(1, 2\)"),
        ([1.0, np.nan], InputError, r"finite, got nan at index \[1\]"),
        ([np.inf, 1.0], InputError, r"finite, got inf at index \[0\]"),
        ([1e101, 1.0], InputError, "of magnitude at most 1e"),
        (["1", "2"], InputTypeError, "as real numbers, got dtype <U1"),
        ([1j, 2], InputTypeError, "as real numbers, got dtype complex128"),
        ([None, 2], InputTypeError, "as real numbers, got dtype object"),
    ],
)
def test_bad_points_are_refused_by_name(primitive, name, bad, error, match):
    with pytest.raises(error, match=f"Expected {name} {match}"):
        task_for(primitive, **{name: bad})


@pytest.mark.parametrize(
    ("bad", "error"),
    [
        (0, InputError),
        (-1.0, InputError),
        (np.nan, InputError),
        (np.inf, InputError),
        ("1", InputTypeError),
        ([1], InputTypeError),
    ],
)
def test_bad_durations_are_refused(primitive, bad, error):
    with pytest.raises(error, match="Expected duration > 0 in seconds"):
        task_for(primitive, duration=bad)


def test_demonstrations_show_their_own_tasks():
    rng = np.random.default_rng(0)
    demos = [Demonstration(rng.standard_normal((n, 2)), dt) for n, dt in ((5, 0.1), (11, 0.01))]
    tasks = demonstrated_tasks(demos)
    np.testing.assert_array_equal(tasks.start, [d.positions[0] for d in demos])
    np.testing.assert_array_equal(tasks.goal, [d.positions[-1] for d in demos])
    np.testing.assert_allclose(tasks.duration, [0.4, 0.1])
