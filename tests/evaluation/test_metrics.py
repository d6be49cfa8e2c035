"""Rates with exact intervals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import beta

from probdmp.evaluation import published_summary, rate_of
from probdmp.evaluation.metrics import rate_over_classes


@pytest.mark.parametrize(
    ("count", "n", "low", "high"),
    [
        (2, 220, 0.0011, 0.0325),  # the paper's false alarms
        (220, 220, 0.98337, 1.0),  # the paper's detections
        (0, 220, 0.0, 0.0166),
        (1, 10, 0.0025, 0.4450),
        (5, 10, 0.1871, 0.8129),
        (0, 1, 0.0, 0.975),
    ],
)
def test_known_intervals(count, n, low, high):
    rate = rate_of(count, n)
    assert (rate.count, rate.n, rate.rate) == (count, n, count / n)
    assert rate.low == pytest.approx(low, abs=5e-5)
    assert rate.high == pytest.approx(high, abs=5e-5)


@given(st.integers(1, 2000), st.data())
def test_clopper_and_pearson(n, data):
    count = data.draw(st.integers(0, n))
    rate = rate_of(count, n)
    low = beta.ppf(0.025, count, n - count + 1) if count else 0.0
    high = beta.ppf(0.975, count + 1, n - count) if count < n else 1.0
    assert rate.low == pytest.approx(low, rel=1e-6, abs=1e-12)
    assert rate.high == pytest.approx(high, rel=1e-6, abs=1e-12)
    assert 0 <= rate.low <= rate.rate <= rate.high <= 1


@given(st.integers(1, 300), st.data())
def test_the_other_outcome_has_the_mirrored_interval(n, data):
    count = data.draw(st.integers(0, n))
    one, other = rate_of(count, n), rate_of(n - count, n)
    assert one.low == pytest.approx(1 - other.high, abs=1e-9)
    assert one.high == pytest.approx(1 - other.low, abs=1e-9)


def test_in_words():
    assert str(rate_of(2, 220)) == "2/220 (0.9 %, 0.1–3.2 %)"
    assert str(rate_of(220, 220)) == "220/220 (100.0 %, 98.3–100.0 %)"
    assert rate_of(2, 220).in_percent == "0.9 (0.1–3.2)"


def test_the_papers_own_figures():
    published = published_summary()
    assert (published.false_alarms.count, published.false_alarms.n) == (2, 220)
    hold = published.faults["hold"]
    assert (hold.ever.count, hold.ever.n) == (220, 220)
    assert hold.ever.low >= 0.983
    assert hold.detected is None  # the paper gives neither onset nor latency
    assert (hold.latency_median, hold.latency_p95) == (None, None)


# --- over classes -----------------------------------------------------------------------------------------------------

seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.integers(1, 12), st.integers(1, 20), st.integers(2, 5))
def test_the_interval_over_classes_contains_the_rate(seed, n_classes, n_tests, n_splits):
    rng = np.random.default_rng(seed)
    labels = np.tile(np.repeat([f"{k}" for k in range(n_classes)], n_tests), n_splits)
    happened = rng.random(len(labels)) < rng.random()
    rate = rate_over_classes(happened, labels, n_splits)
    assert (rate.count, rate.n, rate.rate) == (happened.sum(), len(labels), happened.mean())
    assert 0 <= rate.low <= rate.rate <= rate.high <= 1
    assert rate == rate_over_classes(happened, labels, n_splits)
    order = rng.permutation(len(labels))
    assert rate == rate_over_classes(happened[order], labels[order], n_splits)


def test_the_bootstrap_is_that_of_scipy():
    from scipy.stats import bootstrap

    rng = np.random.default_rng(0)
    by_class = rng.random((20, 50)) < rng.uniform(0, 0.4, (20, 1))
    rate = rate_over_classes(by_class.ravel(), np.repeat(np.arange(20).astype(str), 50), 5)
    theirs = bootstrap((by_class.mean(axis=1),), np.mean, n_resamples=20_000, method="percentile", rng=1).confidence_interval
    assert (rate.low, rate.high) == pytest.approx(tuple(theirs), abs=0.01)


@pytest.mark.parametrize("count", [0, 10])
def test_classes_that_all_agree_leave_the_uncertainty_of_one_split(count):
    labels = np.tile(np.repeat(["a", "b"], 5), 4)
    rate, one = rate_over_classes([count > 0] * 40, labels, 4), rate_of(count, 10)
    assert (rate.count, rate.n) == (4 * count, 40)
    assert (rate.low, rate.high) == (one.low, one.high)
