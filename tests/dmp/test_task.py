"""What is asked of an execution: as given, or as learned."""

from dataclasses import fields, replace

import numpy as np
import pytest
from strategies import make_primitive

from probdmp.demonstrations import Demonstration
from probdmp.dmp import Task, demonstrated_tasks, linear_gaussian_model, task_for
from probdmp.errors import InputError, InputTypeError


@pytest.fixture(scope="module")
def primitive():
    return make_primitive(np.random.default_rng(0))


def test_what_is_not_given_is_as_learned(primitive):
    task = task_for(primitive)
    np.testing.assert_array_equal(task.start, primitive.start)
    np.testing.assert_array_equal(primitive.goals(task), primitive.goal)
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
        ([np.inf, 1.0], InputError, r"finite.*, got inf at index \[0\]"),
        ([1e101, 1.0], InputError, "of magnitude at most 1e"),
        (["1", "2"], InputTypeError, "as real numbers, got dtype <U1"),
        ([1j, 2], InputTypeError, "as real numbers, got dtype complex128"),
        ([None, 2], InputTypeError, "as real numbers, got dtype object"),
    ],
)
def test_bad_points_are_refused_by_name(primitive, name, bad, error, match):
    with pytest.raises(error, match=f"Expected {name} {match}"):
        task_for(primitive, **{name: bad})


@pytest.mark.parametrize("weight_uncertainty", ["independent", "joint"])
def test_a_goal_that_is_not_told_is_not_in_the_task(primitive, weight_uncertainty):
    """It is as learned, with joint weights with its learned spread."""
    changed = replace(primitive.configuration, scaling="none", weight_uncertainty=weight_uncertainty)
    p = replace(primitive, configuration=changed)
    task = task_for(p)
    assert np.isnan(task.goal).all()
    np.testing.assert_array_equal(p.goals(task), primitive.goal)
    np.testing.assert_array_equal(p.goals(task_for(p, goal=[1, 2])), [1, 2])


def test_the_model_of_a_goal_that_is_not_told_is_that_of_the_learned_one(primitive):
    silent, told = (linear_gaussian_model(primitive, task_for(primitive, goal=g), 0.01, 20) for g in (None, primitive.goal))
    for field in fields(silent):
        np.testing.assert_array_equal(getattr(silent, field.name), getattr(told, field.name))


def test_a_start_may_be_unknown_and_a_goal_may_not(primitive):
    task = task_for(primitive, [1.0, np.nan], start_velocity=[np.nan, 2.0])
    np.testing.assert_array_equal(task.start, [1.0, np.nan])
    np.testing.assert_array_equal(task.start_velocity, [np.nan, 2.0])
    np.testing.assert_array_equal(primitive.starts(task), [1.0, primitive.start[1]])
    with pytest.raises(InputError, match=r"Expected goal finite, got nan at index \[1\]"):
        task_for(primitive, goal=[1.0, np.nan])


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


@pytest.mark.parametrize("bad", [0.9e-9, 1.1e9, 1e-300, 1e100])
def test_durations_no_movement_has_are_refused(primitive, bad):
    for make in (lambda: task_for(primitive, duration=bad), lambda: Task(np.zeros(2), np.ones(2), np.array(bad))):
        with pytest.raises(InputError, match=r"Expected duration from 1e-09 to 1e\+09 seconds, got"):
            make()
    for good in (1e-9, 1e9):
        assert task_for(primitive, duration=good).duration == good


# --- made by hand -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("batch", [(), (3,), (2, 3)])
def test_a_task_holds_read_only_copies(batch):
    given = {name: np.ones((*batch, 2)) for name in ("start", "goal", "start_velocity")} | {"duration": np.ones(batch)}
    task = Task(**given)
    for name, array in given.items():
        array += 1
        kept = getattr(task, name)
        np.testing.assert_array_equal(kept, np.ones(array.shape))
        with pytest.raises(ValueError, match="read-only"):
            kept[...] = 0


def test_lists_and_numbers_become_arrays():
    task = Task([0, 1], [2, 3], 4)
    assert [array.dtype for array in (task.start, task.goal, task.duration)] == [np.float64] * 3
    assert task.duration.shape == ()


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"goal": [1.0, np.inf]}, r"goal finite or NaN for 'not measured', got inf at index \[1\]"),
        ({"start": [np.inf, 1.0]}, r"start finite or NaN.*, got inf"),
        ({"start_velocity": [-np.inf, 1.0]}, r"start_velocity finite or NaN.*, got -inf"),
        ({"start": [1.0]}, r"start, goal and start_velocity of one shape, got \(1,\) and \(2,\)"),
        ({"start_velocity": [1.0]}, r"start, goal and start_velocity of one shape, got \(1,\) and \(2,\)"),
        ({"goal": 1.0}, r"goal of shape \(D,\), got \(\)"),
        ({"duration": np.ones(2)}, r"start of shape \(2, D\), got \(2,\)"),
        ({"goal": ["a", "b"]}, "goal as real numbers"),
        ({"goal": None}, "goal as real numbers"),
        ({"start": None}, "start as real numbers"),
        ({"duration": np.nan}, "duration"),
        ({"duration": None}, "duration"),
        ({"duration": "1"}, "duration"),
        ({"duration": "x"}, "duration"),
        ({"duration": True}, "duration"),
        ({"duration": {}}, "duration"),
        ({"duration": 10**400}, "duration"),
    ],
    ids=lambda given: f"{given!r:.40}",
)
def test_a_task_checks_itself(changes, match):
    good = {"start": np.zeros(2), "goal": np.ones(2), "duration": np.array(1.0)}
    Task(**good)
    with pytest.raises((InputError, InputTypeError), match=f"Expected {match}"):
        Task(**good | changes)


def test_demonstrations_show_their_own_tasks():
    rng = np.random.default_rng(0)
    demos = [Demonstration(rng.standard_normal((n, 2)), dt) for n, dt in ((5, 0.1), (11, 0.01))]
    tasks = demonstrated_tasks(demos)
    np.testing.assert_array_equal(tasks.start, [d.positions[0] for d in demos])
    np.testing.assert_array_equal(tasks.goal, [d.positions[-1] for d in demos])
    np.testing.assert_allclose(tasks.duration, [0.4, 0.1])
