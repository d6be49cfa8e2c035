"""Whether all compute the same numbers on the same model, before anyone is timed."""

from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from types import ModuleType
from typing import NamedTuple

import numpy as np

from peers.system import systems_of
from probdmp.checks import FloatArray
from probdmp.gaussian import LinearGaussianModel, filter_sequence, score_series, shared_gains, smooth_sequence, smooth_series
from speed.twin import Twin
from speed.workload import N_STEPS, model_of, recordings_of

__all__ = ["FILTERS", "TOLERANCE", "Agreement", "agreements", "imported"]

FILTERS = ("statsmodels", "dynamax", "filterpy", "pykalman", "simdkalman")
"""Packages that compute the same filter."""
TOLERANCE = 1e-6
N_RECORDINGS = 3
FINER = 1e-3
"""A unit this much smaller; what a package adds to variances then weighs a millionth."""


class Agreement(NamedTuple):
    """How far someone's numbers are from those of `probdmp.gaussian.filter_sequence` and `smooth_sequence`."""

    name: str
    scores: float | None
    """Largest relative deviation of a log-likelihood; None if it computes none."""
    states: float | None
    """Largest deviation of a smoothed mean or covariance, in standard deviations of the movement without observations."""
    remark: str = ""

    @property
    def within(self) -> bool:
        """Whether all of it is within `TOLERANCE`."""
        return max(self.scores or 0.0, self.states or 0.0) <= TOLERANCE


class Expected(NamedTuple):
    """A model, recordings (N, T, 1) of it, and what is expected of them."""

    model: LinearGaussianModel
    recordings: FloatArray
    scores: FloatArray
    """(N,) array, nats."""
    means: FloatArray
    """(N, T, n) array."""
    covariances: FloatArray
    """(T, n, n) array."""
    stds: FloatArray
    """(T, n) array: of the state without observations; infinite where the state is known."""


def imported(name: str) -> ModuleType | None:
    """What a peer's package is driven by; None if the package is not installed."""
    try:
        return import_module(f"peers.{name}")
    except ImportError:
        return None


def expected_of(model: LinearGaussianModel) -> Expected:
    """By the general filter and smoother of this library, which its tests hold to the dense joint Gaussian."""
    recordings = recordings_of(model, N_RECORDINGS)
    forward = [filter_sequence(model, one[..., None]) for one in recordings]
    smoothed = [smooth_sequence(model, one[..., None]) for one in recordings]
    variances = np.diagonal(filter_sequence(model).filtered.covariances[:, 0], axis1=-2, axis2=-1)
    return Expected(
        model,
        recordings,
        np.array([one.log_likelihoods.sum() for one in forward]),
        np.stack([one.means[:, 0] for one in smoothed]),
        smoothed[0].covariances[:, 0],
        np.where(variances > 0, np.sqrt(variances), np.inf),
    )


def in_finer_units(model: LinearGaussianModel) -> LinearGaussianModel:
    """The same movement in units of which `1 / FINER` make one."""
    factor = 1 / FINER
    return replace(
        model,
        inputs=factor * model.inputs,
        input_covariances=factor**2 * model.input_covariances,
        observation_covariance=factor**2 * model.observation_covariance,
        initial_mean=factor * model.initial_mean,
        initial_covariance=factor**2 * model.initial_covariance,
    )


def agreements(twin: Twin) -> Iterator[Agreement]:
    """This library's fast paths, then the packages that are installed."""
    model = model_of("letter", N_STEPS, 1)
    expected, finer = expected_of(model), expected_of(in_finer_units(model))
    gains = shared_gains(model)
    means, covariances = smooth_series(gains, expected.recordings)
    scores = score_series(gains, expected.recordings)
    yield Agreement("probdmp", _deviation(scores, expected), _deviation_of_states(means[:, :, 0], covariances[:, 0], expected))
    scores = twin.score(("letter", N_STEPS, 1), N_RECORDINGS)
    yield Agreement("probdmp, NumPy twin", _deviation(scores, expected), None)
    for name in FILTERS:
        module = imported(name)
        if module is not None:
            yield compared(name, module, expected, finer)


def compared(name: str, module: ModuleType, expected: Expected, finer: Expected) -> Agreement:
    """One package, in finer units too if it does not agree in those of the data."""
    agreement = _compared(name, module, expected)
    if agreement.within:
        return agreement
    again = _compared(name, module, finer)
    worst = max(again.scores or 0.0, again.states or 0.0)
    reason = getattr(module, "DIFFERS", "")
    return agreement._replace(remark=f"{reason}in units {FINER:g} times as large it is within {worst:.0e}")


def _compared(name: str, module: ModuleType, expected: Expected) -> Agreement:
    (system,) = systems_of(expected.model)
    series = np.ascontiguousarray(expected.recordings[..., 0])
    scores = _deviation(np.asarray(module.score_call(system, series)()), expected)
    states = None
    if hasattr(module, "smooth_call"):
        means, covariances = module.smooth_call(system, series)()
        states = _deviation_of_states(means, covariances, expected)
    return Agreement(name, scores, states)


def _deviation(scores: FloatArray, expected: Expected) -> float:
    return float(np.max(np.abs(scores / expected.scores - 1)))


def _deviation_of_states(means: FloatArray, covariances: FloatArray, expected: Expected) -> float:
    stds = expected.stds
    of_means = np.abs(means - expected.means) / stds
    of_covariances = np.abs(covariances - expected.covariances) / (stds[:, :, None] * stds[:, None, :])
    return float(max(of_means.max(), of_covariances.max()))
