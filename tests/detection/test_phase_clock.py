"""Ticks of the movement do not depend on how often it is sampled, come once, in order, and never from the future."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import seeds

from probdmp.detection.phase_clock import LONGEST_GAP, TICKS, PhaseClock

DURATION = 1.7


def run(values, dt, usual_gaps=None):
    """All ticks of samples (T, S), which are usually `dt` apart, and the sample at which each came."""
    clock = PhaseClock(np.full(values.shape[1], dt) if usual_gaps is None else np.asarray(usual_gaps), DURATION, dt)
    return [(tick, t) for t, row in enumerate(values) for tick in clock.advance(t * dt, row)]


def numbers(ticks):
    """(n, D) array."""
    return np.stack([tick.values for tick, _ in ticks])


def lossy(rng, n_samples, n_dof, missing):
    values = np.cumsum(rng.standard_normal((n_samples, n_dof)), axis=0)
    values[rng.random(values.shape) < missing] = np.nan
    return values


@given(seeds, st.sampled_from([1, 2, 5, 10]))
def test_any_sampling_rate_of_a_piecewise_linear_path_gives_the_same_ticks(seed, finer):
    """Corners every four ticks, each of them sampled at all rates."""
    rng = np.random.default_rng(seed)
    corners = rng.standard_normal((26, 2))
    coarse = DURATION / 25
    times = np.arange(25 * finer + 1) * coarse / finer
    path = np.stack([np.interp(times, np.arange(26) * coarse, column) for column in corners.T], axis=1)
    ticks = run(path, coarse / finer)
    expected = np.stack([np.interp(np.arange(TICKS + 1) / 4, np.arange(26), column) for column in corners.T], axis=1)
    np.testing.assert_allclose(numbers(ticks), expected[: len(ticks)], atol=1e-9)
    assert len(ticks) == TICKS + 1


@given(seeds, st.floats(0.003, 0.2), st.floats(0, 0.7))
def test_every_tick_comes_once_and_in_order(seed, dt, missing):
    ticks = run(lossy(np.random.default_rng(seed), 60, 2, missing), dt)
    assert [tick.number for tick, _ in ticks] == list(range(len(ticks)))


@given(seeds, st.floats(0.003, 0.2), st.floats(0, 0.7), st.integers(1, 59))
def test_the_ticks_of_a_beginning_are_the_beginning_of_the_ticks(seed, dt, missing, length):
    """Nothing is known before its time."""
    values = lossy(np.random.default_rng(seed), 60, 2, missing)
    whole, begun = run(values, dt), run(values[:length], dt)
    np.testing.assert_array_equal([t for _, t in begun], [t for _, t in whole if t < length])
    for (one, _), (other, _) in zip(begun, whole, strict=False):
        np.testing.assert_array_equal(one.values, other.values)


@given(seeds, st.floats(0.003, 0.05))
def test_a_tick_waits_for_the_next_sample_and_no_longer(seed, dt):
    ticks = run(lossy(np.random.default_rng(seed), 80, 1, 0.0), dt)
    rate = TICKS / DURATION
    for tick, t in ticks:
        assert tick.number <= t * dt * rate + 1e-6
        assert tick.number > (t - 1) * dt * rate + 1e-6 or tick.number == 0


@pytest.mark.parametrize("dt", [DURATION / 1000, DURATION / 500, DURATION / 100])
@pytest.mark.parametrize("gap", [2, 3, 4, 10])
def test_short_gaps_are_bridged_and_long_ones_are_not(dt, gap):
    """A gap of so many ticks between two samples, from tick 40 on."""
    clock, ticks = PhaseClock(np.array([dt]), DURATION, dt), []
    for t in range(round(DURATION / dt) + 1):
        at = t * dt * TICKS / DURATION
        missing = 40 + 1e-9 < at < 40 + gap - 1e-9
        ticks += clock.advance(t * dt, np.array([np.nan if missing else 3 * at]))
    inside = np.concatenate([tick.values for tick in ticks[41 : 40 + gap]])
    if gap <= LONGEST_GAP:
        np.testing.assert_allclose(inside, 3 * np.arange(41, 40 + gap), rtol=1e-9)
    else:
        assert np.isnan(inside).all()
    outside = [tick for tick in ticks if not 40 < tick.number < 40 + gap]
    np.testing.assert_allclose([tick.values[0] for tick in outside], [3 * tick.number for tick in outside], rtol=1e-9)


def test_slow_sampling_is_no_gap():
    """At five ticks between samples, one missing sample is bridged, two are not."""
    values = np.arange(21.0)[:, None] * 5
    values[6] = np.nan
    values[10:12] = np.nan
    found = numbers(run(values, DURATION / 20))[:, 0]
    expected = np.arange(TICKS + 1.0)
    expected[46:60] = np.nan
    np.testing.assert_allclose(found, expected[: len(found)], atol=1e-9)


@given(seeds, st.integers(0, 2))
def test_degrees_of_freedom_do_not_hear_of_each_other(seed, lost):
    """What one sensor misses changes no number of the others."""
    rng = np.random.default_rng(seed)
    values = lossy(rng, 80, 3, 0.2)
    silent = np.array(values)
    silent[:, lost] = np.nan
    one, other = numbers(run(values, 0.02)), numbers(run(silent, 0.02))
    others = [d for d in range(3) if d != lost]
    n = min(len(one), len(other))
    np.testing.assert_array_equal(one[:n, others], other[:n, others])


def test_a_silent_sensor_holds_up_nothing_for_long():
    values = np.column_stack([np.arange(200.0), np.full(200, np.nan)])
    for tick, t in run(values, DURATION / 150):
        assert t / 1.5 - tick.number <= LONGEST_GAP + 1


def test_ticks_go_on_after_the_movement_should_be_over():
    ticks = run(np.arange(300.0)[:, None], DURATION / 100)
    np.testing.assert_allclose(numbers(ticks)[:, 0], np.arange(300), atol=1e-9)


@given(seeds, st.integers(2, 30))
def test_a_slow_sensor_is_waited_for(seed, every):
    """As long as its samples usually are apart, and half as long again: then the path between them is straight too."""
    rng = np.random.default_rng(seed)
    n = 5 * every + 1
    dt, values = DURATION / (n - 1), np.column_stack([np.cumsum(rng.standard_normal((n, 2)), axis=0)])
    slow = np.array(values)
    slow[np.arange(n) % every > 0, 1] = np.nan
    at = np.arange(TICKS + 1) * (n - 1) / TICKS
    found = run(slow, dt, [dt, every * dt])
    expected = np.interp(at, np.arange(0, n, every), values[::every, 1])
    np.testing.assert_allclose(numbers(found)[:, 1], expected[: len(found)], atol=1e-9)
    assert len(found) == TICKS + 1
    for tick, t in found:
        assert t * dt * TICKS / DURATION - tick.number < max(every * dt * TICKS / DURATION, 3) + 1e-6


def test_a_slow_sensor_that_is_late_holds_up_nothing_for_long():
    values = np.column_stack([np.arange(201.0)] * 2)
    values[np.arange(201) % 20 > 0, 1] = np.nan
    values[60:, 1] = np.nan
    found = run(values, DURATION / 200, [DURATION / 200, DURATION / 10])
    assert max(t / 2 - tick.number for tick, t in found) == pytest.approx(15, abs=1)  # one and a half times ten ticks
    np.testing.assert_allclose(numbers(found)[:21, 1], 2 * np.arange(21), atol=1e-9)
    assert np.isnan(numbers(found)[21:, 1]).all()
    np.testing.assert_allclose(numbers(found)[:, 0], 2 * np.arange(len(found)), atol=1e-9)


def test_what_is_never_measured_is_not_waited_for():
    """Every tick comes with the sample that completes it."""
    values = np.column_stack([np.arange(150.0), np.full(150, np.nan)])
    for tick, t in run(values, DURATION / 150, [DURATION / 150, np.inf]):
        assert t == np.ceil(1.5 * tick.number - 1e-6)
    nothing = np.full((101, 2), np.nan)
    found = run(nothing, DURATION / 100, [np.inf, np.inf])
    assert [(tick.number, t) for tick, t in found] == [(t, t) for t in range(101)]
