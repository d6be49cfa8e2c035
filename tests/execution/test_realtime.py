"""What a control loop relies on: a tick allocates its result and nothing else, and nothing grows while it runs."""

import gc
import tracemalloc

import numpy as np
import pytest

from probdmp import FailureDetector, ProbabilisticDMP
from probdmp.demonstrations import synthetic_letters
from probdmp.dmp import task_for
from probdmp.errors import InputError
from probdmp.execution import SensorArray
from probdmp.execution.step_filters import step_filter
from probdmp.gaussian import kernels

WAYS = ["independent", "joint"]


@pytest.fixture(scope="module")
def letters():
    return synthetic_letters(6, letters="a")


@pytest.fixture(scope="module", params=WAYS)
def learned(request, letters):
    return ProbabilisticDMP(n_basis=15, weight_uncertainty=request.param).fit(letters)


def readings_of(learned, dt):
    """A movement at that control rate."""
    return np.ascontiguousarray(learned.sample(1, dt=dt, random_state=0)[0])


@pytest.fixture
def no_collections():
    """How often the garbage was collected since the start of the test."""
    started = []

    def note(phase, info):
        started.append(phase)

    gc.collect()
    gc.callbacks.append(note)
    yield started
    gc.callbacks.remove(note)


@pytest.mark.parametrize("watched", [False, True])
def test_no_tick_collects_garbage(learned, letters, watched, no_collections):
    detector = FailureDetector(0.05).fit(learned, letters) if watched else None
    dt = 0.002
    readings, execution = readings_of(learned, dt), learned.execute(dt=dt, detector=detector)
    assert len(readings) > 400
    gc.collect()
    no_collections.clear()
    for reading in readings:
        execution.step(reading)
    assert no_collections == []


def test_nothing_grows_while_it_runs(learned):
    dt = 0.0005
    readings, execution = readings_of(learned, dt), learned.execute(dt=dt)
    quarter = len(readings) // 4
    tracemalloc.start()
    try:
        for reading in readings[:quarter]:
            execution.step(reading)
        before = tracemalloc.get_traced_memory()[0]
        for reading in readings[quarter:]:
            execution.step(reading)
        grown = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert grown < 2000, f"{grown} bytes in {3 * quarter} ticks"


def test_a_step_stays_as_it_was(learned):
    """The filter goes on with arrays that a step shows, so nobody may write to them, and it never does."""
    readings = readings_of(learned, 0.01)
    execution, again = learned.execute(dt=0.01), learned.execute(dt=0.01)
    steps = [execution.step(reading) for reading in readings]
    for step, reading in zip(steps, readings, strict=True):
        other = again.step(reading)
        for name in ("position", "velocity", "acceleration", "covariance", "innovations", "contributions", "fused"):
            np.testing.assert_array_equal(getattr(step, name), getattr(other, name))
            with pytest.raises(ValueError, match="read-only"):
                getattr(step, name)[0] = 0


def test_the_buffer_of_a_reading_may_be_used_again(learned, letters):
    readings = readings_of(learned, 0.01)
    for detector in (None, FailureDetector(0.05).fit(learned, letters)):
        buffer, fresh = np.empty(2), learned.execute(dt=0.01, detector=detector)
        reused = learned.execute(dt=0.01, detector=detector)
        for reading in readings:
            buffer[:] = reading
            one, other = reused.step(buffer), fresh.step(reading.copy())
            buffer[:] = 1e6
            np.testing.assert_array_equal(one.position, other.position)
            np.testing.assert_equal(one.test_ratio, other.test_ratio)


def test_what_is_masked_was_not_measured(learned):
    readings = readings_of(learned, 0.01)
    masked, missing = learned.execute(dt=0.01), learned.execute(dt=0.01)
    for t, reading in enumerate(readings[:20]):
        gone = reading.copy()
        gone[1] = np.nan if t % 3 else gone[1]
        one = masked.step(np.ma.masked_array(reading, [False, bool(t % 3)]))
        np.testing.assert_array_equal(one.position, missing.step(gone).position)


@pytest.mark.parametrize("value", [np.inf, -np.inf, 1e150])
def test_a_refused_reading_changes_nothing(learned, value):
    readings = readings_of(learned, 0.01)
    disturbed, undisturbed = learned.execute(dt=0.01), learned.execute(dt=0.01)
    for t, reading in enumerate(readings):
        if t == 10:
            with pytest.raises(InputError, match="observation"):
                disturbed.step(np.array([reading[0], value]))
        np.testing.assert_array_equal(disturbed.step(reading).position, undisturbed.step(reading).position)


def test_how_much_is_prepared_at_a_time_changes_nothing(learned):
    """The movement goes on after its end, where inputs are prepared in smaller chunks."""
    primitive, dt = learned.primitive_, 0.01
    task = task_for(primitive)
    readings = readings_of(learned, dt)
    readings = np.concatenate([readings, np.repeat(readings[-1:], 200, axis=0)])
    filters = [step_filter(primitive, task, dt, chunk, SensorArray(primitive)) for chunk in (20, len(readings) + 1)]
    scale = np.abs(readings).max()
    for reading in readings:
        one, other = (filtering.step(reading) for filtering in filters)
        np.testing.assert_allclose(one.mean, other.mean, rtol=1e-9, atol=1e-9 * scale / dt)
        np.testing.assert_allclose(one.innovations, other.innovations, rtol=1e-9, atol=1e-9 * scale)


@pytest.mark.slow
def test_ten_million_ticks_leave_a_covariance_a_covariance():
    """R and the forcing variance each tiny or large, one after the other through the same covariance."""
    alpha, dt, n, width = 25.0, 0.01, 3, kernels.LANE
    a1, a0 = -alpha, -(alpha**2) / 4
    a = np.array([[0, a1, a0], [0, 1 + a1 * dt, a0 * dt], [0, dt + a1 * dt**2, 1 + a0 * dt**2]])
    system, inputs = np.zeros((n * n + 2 * n + 1, width)), np.zeros((n + 1, width))
    system[:9], system[9:12], system[14] = a.ravel()[:, None], np.array([[1.0], [dt], [dt**2]]), 1.0
    system[15] = np.repeat([1e-12, 1e-2, 1e-12, 1e-2], 2)
    inputs[3] = np.repeat([1e-8, 1e-8, 1.0, 1.0], 2) * 156.25**2
    prepared, rng = kernels.PreparedSteps(system, inputs[None], width), np.random.default_rng(0)
    record = bytes(8 * width * (n + n * n + 3))
    readings = np.where(rng.random((1000, width)) < 0.1, np.nan, 1e-3 * rng.standard_normal((1000, width)))
    for _ in range(10_000):
        for reading in readings:
            record = prepared.take(reading, record, 0)[3]
        rows = np.frombuffer(record).reshape(-1, width)
        covariances = rows[n : n + n * n].T.reshape(width, n, n)
        assert np.array_equal(covariances, covariances.mT)
        stds = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
        scaled = covariances / (stds[:, :, None] * stds[:, None, :])
        assert np.linalg.eigvalsh(scaled).min() > -1e-12
    assert np.all(np.isfinite(rows[: n + n * n]))
