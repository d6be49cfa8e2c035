"""Random Gaussians over paths, and what they say computed densely, entry by entry."""

import numpy as np
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, multivariate_t
from strategies import random_covariance

from probdmp.detection.evidence import DEGREES_OF_FREEDOM, REST_STD, SLOWED, Pace, Standstill
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.trajectory_statistics import SHIFT_STD

PHASES = np.linspace(0.0, 1.0, TICKS + 1)
WAVES = np.sin(np.pi / 2 * PHASES[:, None] * np.arange(1, 7))
"""(M, 6) smooth functions that begin at zero."""


def random_path_model(rng, n_dof):
    """Smooth paths about one range long, from zero."""
    factors = np.kron(WAVES, np.eye(n_dof)).reshape(TICKS + 1, n_dof, -1)
    spread = random_covariance(rng, (), 6 * n_dof, 6 * n_dof) * 0.05**2
    covariance = np.einsum("mdi,ij,nej->mdne", factors, spread, factors)
    means = WAVES @ rng.standard_normal((6, n_dof)) / 2
    gains = rng.standard_normal((n_dof, n_dof)) * PHASES[:, None, None]
    return PathModel(means, covariance, gains, rng.uniform(0.005, 0.02, n_dof) ** 2)


def random_felt_model(rng, n_dof, n_channels=1):
    """The same with channels, about one range from zero at their start, that vary with the paths."""
    n_signals = n_dof + n_channels
    waves = np.column_stack([np.ones(TICKS + 1), WAVES])
    factors = np.kron(waves, np.eye(n_signals)).reshape(TICKS + 1, n_signals, -1)
    factors[:, :n_dof, :n_signals] = 0.0  # displacements begin at zero
    size = factors.shape[-1]
    covariance = np.einsum("mdi,ij,nej->mdne", factors, random_covariance(rng, (), size, size) * 0.05**2, factors)
    means = np.einsum("mdi,i->md", factors, rng.standard_normal(size) / 2)
    gains = rng.standard_normal((n_signals, n_dof)) * PHASES[:, None, None]
    return PathModel(means, covariance, gains, rng.uniform(0.005, 0.02, n_signals) ** 2)


def random_paths(model, rng, n, length):
    """(n, length, D) executions drawn from the model, with noise; those that go on after the end stay there."""
    m, d = model.means.shape
    drawn = rng.multivariate_normal(model.means.ravel(), model.covariance.reshape(m * d, -1), n, check_valid="ignore")
    ticks = np.minimum(np.arange(length), TICKS)
    noise = rng.standard_normal((n, length, d)) * np.sqrt(model.noise_variances)
    return drawn.reshape(n, m, d)[:, ticks] + noise


def with_gaps(paths, rng, share=0.05):
    """Some numbers lost one by one, and of each path a piece of one degree of freedom."""
    lossy = np.array(paths)
    lossy[rng.random(paths.shape) < share] = np.nan
    for path in lossy:
        begin = int(rng.integers(len(path)))
        path[begin : begin + 20, rng.integers(path.shape[1])] = np.nan
    return lossy


def window_model(model, place, offsets, shift, means, combination=None):
    """Mean (L D,) and covariance of what is compared at a place, if the execution is `shift` ticks ahead."""
    ticks = [0 if place + o <= 0 else min(max(place + o + shift, 0), TICKS) for o in offsets]
    d = len(model.noise_variances)
    combination = np.eye(len(ticks)) if combination is None else combination
    mix = np.kron(combination, np.eye(d))
    size = len(ticks) * d
    covariance = model.covariance[ticks][:, :, ticks].reshape(size, size) + np.diag(np.tile(model.noise_variances, len(ticks)))
    return mix @ means[ticks].ravel(), mix @ covariance @ mix.T


def log_t_mixture(model, place, offsets, window, means, shifts):
    """ln of the mixture over shifts of multivariate t densities of a window (P, D), what was not seen integrated out."""
    x = window.ravel()
    seen = ~np.isnan(x)
    weights = np.exp(-((shifts / SHIFT_STD) ** 2) / 2)
    if not seen.any():
        return 0.0
    terms = []
    for shift, weight in zip(shifts, weights / weights.sum(), strict=True):
        mean, covariance = window_model(model, place, offsets[: len(window)], shift, means)
        density = multivariate_t(mean[seen], covariance[np.ix_(seen, seen)], df=DEGREES_OF_FREEDOM)
        terms.append(np.log(weight) + density.logpdf(x[seen]))
    return float(logsumexp(terms))


def log_at_rest(model, since):
    """ln density of the points (1 + n, D) after the first, if all are where it is, with the noise of both."""
    moved = since[1:] - since[0]
    n = len(moved)
    variances = REST_STD**2 + model.noise_variances
    covariance = np.kron(np.ones((n, n)) + np.eye(n), np.diag(variances))
    return float(multivariate_normal(np.zeros(moved.size), covariance).logpdf(moved.ravel()))


def seen_from(kind, path, place, n_ahead):
    """The window (P, D) of a kind of evidence with the first n_ahead points ahead, and the offsets of its points."""
    offsets = np.concatenate([-kind.before, kind.ahead[:n_ahead]])
    return path[np.maximum(place + offsets, 0)], offsets


def standstill(model, path, place, n_ahead, means):
    """ln p(at rest since the place) / p(gone on | all before) from the first n_ahead points."""
    window, offsets = seen_from(Standstill, path, place, n_ahead)
    n_before = len(Standstill.before)
    together = log_t_mixture(model, place, offsets, window, means, Standstill.shifts)
    before = log_t_mixture(model, place, offsets, window[:n_before], means, Standstill.shifts)
    return log_at_rest(model, window[n_before - 1 :]) - (together - before)


def slowed(model, path, place, n_ahead, means):
    """ln p(at half speed since the place | all before) / p(gone on | all before) from the first n_ahead points."""
    window, offsets = seen_from(Pace, path, place, n_ahead)
    slow = np.where(offsets > 0, offsets * SLOWED, offsets).round().astype(int)
    densities = (log_t_mixture(model, place, model_at, window, means, Pace.shifts) for model_at in (slow, offsets))
    return next(densities) - next(densities)
