"""How surprising a reading is, in gates: as rare as one number beyond them, whatever the number of outputs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2, norm
from strategies import random_covariance, seeds

from probdmp.execution.gating import REPORTED_GATE, gate_ratios


@given(st.floats(-100, 100), st.floats(0.1, 10), st.floats(0.01, 100))
def test_of_one_output_it_is_the_square_over_gate_squared_and_variance(error, gate, variance):
    ratio = gate_ratios(np.array([error]), np.array([[variance]]), gate)
    np.testing.assert_allclose(ratio, error**2 / (gate**2 * variance), rtol=1e-12)


@pytest.mark.parametrize("gate", [0.5, 3.0, 5.0, 8.0, 30.0])
@pytest.mark.parametrize("n_outputs", [2, 3, 7])
def test_the_limit_is_a_quantile_of_chi_square(gate, n_outputs):
    limit = chi2.isf(2 * norm.sf(gate), n_outputs)
    error = np.zeros(n_outputs)
    error[0] = np.sqrt(limit)
    np.testing.assert_allclose(gate_ratios(error, np.eye(n_outputs), gate), 1.0, rtol=1e-9)


@pytest.mark.parametrize("n_outputs", [1, 2, 5])
def test_good_readings_are_rejected_as_rarely_as_said(n_outputs):
    rng = np.random.default_rng(0)
    covariance = random_covariance(rng, (), n_outputs, n_outputs) + 0.1 * np.eye(n_outputs)
    errors = rng.multivariate_normal(np.zeros(n_outputs), covariance, 40_000)
    rejected = np.mean(gate_ratios(errors, covariance, 2.0) > 1)
    assert rejected == pytest.approx(2 * norm.sf(2.0), abs=5 * np.sqrt(0.045 / 40_000))


@given(seeds, st.integers(1, 4))
def test_what_was_not_measured_is_left_out(seed, n_outputs):
    rng = np.random.default_rng(seed)
    covariance = random_covariance(rng, (), n_outputs, n_outputs) + 0.1 * np.eye(n_outputs)
    errors, seen = rng.standard_normal(n_outputs), rng.random(n_outputs) < 0.6
    ratio = gate_ratios(np.where(seen, errors, np.nan), covariance, 3.0)
    if seen.any():
        np.testing.assert_allclose(ratio, gate_ratios(errors[seen], covariance[np.ix_(seen, seen)], 3.0), rtol=1e-9)
    else:
        assert np.isnan(ratio)


def test_without_a_gate_it_is_compared_with_five_standard_deviations():
    assert REPORTED_GATE == 5
    np.testing.assert_allclose(gate_ratios(np.array([[5.0], [np.nan]]), np.ones((2, 1, 1)), None), [1.0, np.nan])


@pytest.mark.parametrize("n_outputs", [1, 2, 4])
def test_a_gate_so_wide_that_nothing_is_that_rare_still_rejects(n_outputs):
    """Beyond 38 standard deviations their share is zero in floating point."""
    near, far = np.full(n_outputs, 1.0), np.full(n_outputs, 1e3)
    ratios = gate_ratios(np.stack([near, far]), np.eye(n_outputs), 40.0)
    assert ratios[0] < 1 < ratios[1]
    # A wider gate is wider, across the place where the share vanishes.
    wider = [float(gate_ratios(far, np.eye(n_outputs), gate)) for gate in np.arange(35.0, 41.0, 0.25)]
    assert np.all(np.diff(wider) < 0)
