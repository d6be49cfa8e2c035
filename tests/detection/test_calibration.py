"""From values to a surprise, from a rate to a threshold: order, exact ranks, and what fresh executions then do."""

from fractions import Fraction
from math import ceil, exp, log

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import betabinom
from strategies import seeds

from probdmp.detection.calibration import ENOUGH, SUSPECT, Calibration
from probdmp.errors import InputError

RATES = ("0.001", "0.003", "0.01", "0.02", "0.05", "0.059", "0.07", "0.1", "0.172", "0.2", "0.3", "0.5", "0.9")


def executions(rng, n, channels=3):
    """Largest values of channels that go together somewhat, with heavy tails."""
    common = rng.standard_normal((n, 1))
    return np.exp(common + rng.standard_normal((n, channels)) * np.arange(1, channels + 1) / 2)


def calibration(maxima, rate=0.05, method="held_out", labels=None):
    return Calibration(maxima, ["a"] * len(maxima) if labels is None else labels, rate, method)


# --- surprise ---------------------------------------------------------------------------------------------------------


@given(seeds, st.integers(2, 80))
def test_a_larger_value_is_never_less_surprising(seed, n):
    rng = np.random.default_rng(seed)
    maxima = executions(rng, n)
    values = np.sort(np.concatenate([[0.0], maxima.ravel(), np.exp(rng.uniform(-5, 9, 200))]))
    surprises = calibration(maxima).surprise(np.repeat(values[:, None], 3, axis=1))
    assert np.all(np.diff(surprises, axis=0) >= 0)
    assert np.all(surprises >= 0)
    assert np.isfinite(surprises).all()


@given(seeds, st.integers(2, 80))
def test_the_tail_begins_where_the_ranks_end(seed, n):
    """Just above the 90 % quantile the surprise is what the ranks say of the executions beyond it; it grows from there."""
    maxima = executions(np.random.default_rng(seed), n)
    starts = np.quantile(maxima, 0.9, axis=0)
    found = calibration(maxima)
    beyond = np.sum(maxima > starts, axis=0)
    np.testing.assert_allclose(found.surprise(starts * (1 + 1e-12)), -np.log((beyond + 1) / (n + 1)), atol=1e-6)
    assert np.all(found.surprise(starts) <= found.surprise(starts * (1 + 1e-12)))
    assert np.all(found.surprise(starts * 2) > found.surprise(starts * 1.5))


@given(seeds, st.integers(11, 80))
def test_before_the_tail_the_surprise_is_the_rank(seed, n):
    maxima = executions(np.random.default_rng(seed), n)
    found, starts = calibration(maxima), np.quantile(maxima, 0.9, axis=0)
    for i, c in np.argwhere(maxima < starts):
        reached = np.sum(maxima[:, c] >= maxima[i, c])
        assert found.surprise(maxima[i])[c] == pytest.approx(-log((reached + 1) / (n + 1)), abs=1e-12)


def test_no_evidence_is_no_surprise():
    found = calibration(executions(np.random.default_rng(0), 30))
    np.testing.assert_array_equal(found.surprise(np.array([np.nan, 0.0, np.nan])), 0)


@given(seeds, st.floats(-3, 3))
def test_the_scale_of_a_channel_does_not_matter(seed, exponent):
    rng = np.random.default_rng(seed)
    maxima, factors = executions(rng, 40), 10 ** np.array([exponent, 0.0, -exponent])
    values = np.exp(rng.uniform(-2, 4, (20, 3)))
    one, other = calibration(maxima), calibration(maxima * factors)
    np.testing.assert_allclose(other.surprise(values * factors), one.surprise(values), rtol=1e-6, atol=1e-9)
    assert other.threshold == pytest.approx(one.threshold, rel=1e-6)


# --- threshold --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", RATES)
def test_where_there_are_enough_executions_the_threshold_is_the_conformal_one(rate):
    """The ceil((n + 1)(1 - alpha))-th smallest, in exact arithmetic."""
    exact, rng = Fraction(rate), np.random.default_rng(0)
    for n in (9, 19, 24, 49, 50, 99, 100, 199, 249, 499, 999):
        found = calibration(executions(rng, n), float(rate))
        assert found.is_conformal == (exact * (n + 1) >= int(ENOUGH))
        if found.is_conformal:
            rank = ceil((n + 1) * (1 - exact))
            assert found.threshold == np.sort(found.statistics)[rank - 1]


@given(seeds, st.integers(2, 150))
def test_a_smaller_rate_has_a_larger_threshold(seed, n):
    maxima = executions(np.random.default_rng(seed), n)
    thresholds = [calibration(maxima, float(rate)).threshold for rate in RATES]
    assert np.all(np.diff(thresholds) <= 0)
    assert thresholds[-1] > 0


@pytest.mark.parametrize(("n", "rate"), [(99, 0.05), (99, 0.1), (199, 0.05), (199, 0.2)])
def test_fresh_executions_raise_alarms_at_the_rate_that_was_asked_for(n, rate):
    """Conformal: the alarms among m fresh executions are beta-binomial. Ranks of the calibration executions
    depend on themselves, which costs a few of them."""
    rng, m, runs = np.random.default_rng(0), 200, 60
    alarms = []
    for _ in range(runs):
        found = calibration(executions(rng, n), rate)
        alarms.append(int(np.sum(found.surprise(executions(rng, m)).max(axis=1) > found.threshold)))
    k = n + 1 - ceil((n + 1) * (1 - Fraction(str(rate))))  # calibration executions that may lie above, and one to come
    chance = betabinom(m, k, n + 1 - k)
    low, high = chance.ppf(0.001), chance.ppf(0.999)
    assert np.mean([low <= a <= high for a in alarms]) > 0.95
    spread = 3.5 * chance.std() / np.sqrt(runs)
    assert abs(np.mean(alarms) - chance.mean()) < spread + 0.2 * rate * m


def test_below_that_the_tail_is_about_right():
    """At alpha = 1 % of 60 executions."""
    rng = np.random.default_rng(1)
    rates = []
    for _ in range(100):
        found = calibration(executions(rng, 60), 0.01)
        assert not found.is_conformal
        rates.append(np.mean(found.surprise(executions(rng, 500)).max(axis=1) > found.threshold))
    assert 0.002 < np.mean(rates) < 0.025


def test_executions_without_any_evidence_can_be_calibrated_on():
    found = calibration(np.zeros((20, 2)))
    assert found.threshold > 0
    np.testing.assert_array_equal(found.surprise(np.zeros(2)), 0)


# --- what it says of itself -------------------------------------------------------------------------------------------


@given(st.integers(2, 300))
def test_the_attainable_rate_is_one_in_n_plus_one(n):
    assert calibration(np.ones((n, 1))).attainable_rate == pytest.approx(1 / (n + 1))


@pytest.mark.parametrize(
    ("n", "rate", "method", "words"),
    [
        (99, 0.05, "held_out", "conformal"),
        (98, 0.05, "held_out", "model-based, not guaranteed"),
        (99, 0.05, "leave_one_out", "empirical"),
        (20, 0.05, "leave_one_out", "empirical"),
        (18, 0.05, "leave_one_out", "model-based, not guaranteed"),
        (18, 0.05, "held_out", "model-based, not guaranteed"),
    ],
)
def test_the_guarantee_says_what_holds(n, rate, method, words):
    assert calibration(executions(np.random.default_rng(0), n), rate, method).guarantee == words


def test_a_primitive_that_is_really_worse_is_suspected():
    rng = np.random.default_rng(2)
    labels = [letter for letter in "abcdefghij" for _ in range(10)]
    maxima = executions(rng, 100)
    maxima[30:40] *= exp(4)  # d
    found = calibration(maxima, 0.05, labels=labels)
    assert list(found.suspects) == ["d"]
    assert found.suspects["d"] == np.mean(found.statistics[30:40] > np.quantile(found.statistics, 0.9))
    assert found.own_thresholds["d"] == found.threshold_for("d") == found.statistics[30:40].max() > found.threshold
    assert found.threshold_for("a") == found.threshold


def test_a_primitive_that_ranks_higher_throughout_is_suspected_even_if_none_of_its_executions_is_extreme():
    rng = np.random.default_rng(4)
    labels = [letter for letter in "abcdefghij" for _ in range(10)]
    maxima = np.sort(executions(rng, 100), axis=0)
    maxima = np.concatenate([maxima[:60], maxima[80:], maxima[60:80]])[rng.permutation(100)]
    ranked = np.argsort(calibration(maxima, 0.05, labels=labels).statistics)
    maxima[[*range(10), *ranked[75:85]]] = maxima[[*ranked[75:85], *range(10)]]  # a: high, but not among the highest tenth
    found = calibration(maxima, 0.05, labels=labels)
    assert not (found.statistics[:10] > np.quantile(found.statistics, 0.9)).any()
    assert found.suspects["a"] == 0


def test_primitives_that_are_alike_are_rarely_suspected():
    rng, labels = np.random.default_rng(3), [letter for letter in "abcdefghij" for _ in range(10)]
    suspects = [len(calibration(executions(rng, 100), 0.05, labels=labels).suspects) for _ in range(50)]
    assert np.mean(suspects) <= 10 * SUSPECT


@pytest.mark.parametrize(("n", "labels"), [(0, []), (1, ["a"]), (3, ["a"])])
def test_too_few_or_unlabelled_executions(n, labels):
    with pytest.raises(InputError, match="at least two calibration executions, each with a label"):
        calibration(np.ones((n, 2)), labels=labels)
