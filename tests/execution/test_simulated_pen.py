"""A pen that carries out a planned movement, and what may be done to it."""

import numpy as np
import pytest

from probdmp import FailureDetector, ProbabilisticDMP, synthetic_letters
from probdmp.dmp import task_for
from probdmp.errors import InputError
from probdmp.execution import SimulatedPen, planned_recording

DT = 0.02


@pytest.fixture(scope="module")
def letters():
    return synthetic_letters(6, letters="a", dt=DT)


@pytest.fixture(scope="module")
def learned(letters):
    return ProbabilisticDMP(n_basis=12).fit(letters)


@pytest.fixture
def planned(learned):
    primitive = learned.primitive_
    return planned_recording(primitive, task_for(primitive), DT, np.random.default_rng(0))


def pen_along(planned, learned):
    return SimulatedPen(planned, (), np.sqrt(learned.primitive_.observation_variances), np.random.default_rng(1))


def readings(pen):
    rows = []
    while not pen.is_done:
        rows.append(pen.read())
    return np.array(rows)


def test_nobody_disturbs_it_and_it_goes_where_it_was_planned(planned, learned):
    np.testing.assert_array_equal(readings(pen_along(planned, learned)), planned.positions)
    stds = np.sqrt(learned.primitive_.observation_variances)
    assert np.all(np.abs(planned.positions - learned.rollout(dt=DT).positions) < 6 * stds)


def test_a_planned_execution_is_fine_and_a_held_one_is_not(planned, learned, letters):
    detector = FailureDetector().fit(learned, letters)
    execution = learned.execute(dt=DT, detector=detector)
    for row in readings(pen_along(planned, learned)):
        execution.step(row)
    assert not execution.failed
    pen, execution = pen_along(planned, learned), learned.execute(dt=DT, detector=detector)
    for _ in range(planned.n_samples // 2):
        row = pen.read()
        execution.step(row)
    pen.disturb("hold", row)
    held = [pen.read() for _ in range(planned.n_samples // 2)]
    for row in held:
        execution.step(row)
    assert execution.failed
    assert 0 < np.std(held) < 10  # the sensor is as noisy as before


def test_after_a_hold_it_goes_on_from_there(planned, learned):
    pen = pen_along(planned, learned)
    before = np.array([pen.read() for _ in range(10)])
    pen.disturb("hold", before[-1])
    for _ in range(20):
        pen.read()
    pen.disturb("none")
    after = readings(pen)
    assert len(after) == planned.n_samples - 10
    np.testing.assert_allclose(after[-1], planned.positions[-1], atol=0.1)


def test_a_slow_pen_takes_twice_as_long(planned, learned):
    pen = pen_along(planned, learned)
    pen.disturb("slow")
    assert len(readings(pen)) == 2 * planned.n_samples - 1


def test_a_pushed_pen_goes_towards_the_point(planned, learned):
    pen, point = pen_along(planned, learned), np.array([50.0, 50.0])
    pen.disturb("push", point)
    distances = np.linalg.norm(readings(pen) - point, axis=1)
    assert distances[-1] < 0.05 * distances[0]


def test_one_that_is_held_for_good_is_given_up(planned, learned):
    pen = pen_along(planned, learned)
    pen.disturb("hold", [0, 0])
    assert len(readings(pen)) < 4 * planned.n_samples


def test_nobody_can_do_what_makes_no_sense(planned, learned):
    for mode, point in (("throw", None), ("hold", None), ("push", [1, np.inf]), ("hold", [1, 2, 3])):
        with pytest.raises(InputError):
            pen_along(planned, learned).disturb(mode, point)


def test_channels_go_along():
    rng = np.random.default_rng(3)
    taught = [
        type(d)(d.positions, d.dt, channels={"force": 1 + 0.1 * rng.standard_normal(d.n_samples)})
        for d in synthetic_letters(4, letters="s", dt=DT)
    ]
    learned = ProbabilisticDMP(n_basis=8, channels=["force"]).fit(taught)
    planned = planned_recording(learned.primitive_, task_for(learned.primitive_), DT, rng)
    assert np.mean(planned.channels["force"]) == pytest.approx(1, abs=0.1)
    pen = SimulatedPen(planned, ("force",), np.zeros(2), rng)
    execution = learned.execute(dt=DT)
    step = execution.step(pen.read())
    assert step.signals.means.shape == (3,)
    np.testing.assert_array_equal(step.signals.means[:2], step.position)
    np.testing.assert_array_equal(step.signals.means[2:], step.channels["force"].means)
    np.testing.assert_array_equal(step.signals.stds[2:], step.channels["force"].stds)
