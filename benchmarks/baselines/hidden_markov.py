"""Hidden Markov model: running log-likelihood, judged against what the training demonstrations have at that time.

States follow one another from left to right. With the forward variable and its normalizer

    log p(x[0..t]) = sum_{u <= t} log c[u],   c[u] = p(x[u] | x[0..u-1])

the statistic is how far the log-likelihood of all samples, of the recent past and of the newest sample fall below their
mean over the training demonstrations at the same phase, in standard deviations there: a threshold that varies with the
progress of the execution.
Source: Park, Erickson, Bhattacharjee & Kemp, "Multimodal execution monitoring for anomaly detection during robot
manipulation", ICRA 2016; the model is learned by the package `hmmlearn`.
"""

import logging
from collections.abc import Sequence

import numpy as np
from hmmlearn.hmm import GaussianHMM
from scipy.ndimage import gaussian_filter1d
from scipy.stats import multivariate_normal

from baselines.alignment import STEP, Path, displacements
from baselines.array_types import FloatArray
from baselines.method import GridMethod, extended

__all__ = ["HiddenMarkovLikelihood", "running_log_likelihoods"]

# With a prior on covariances the likelihood alone may fall from one iteration to the next, which hmmlearn reports each time.
logging.getLogger("hmmlearn").setLevel(logging.ERROR)

SMOOTHING = 2.0
"""Mean and std over the training demonstrations are smoothed over so many % of the duration (std of the kernel)."""


class HiddenMarkovLikelihood(GridMethod):
    """Log-likelihood under a left-right Gaussian hidden Markov model."""

    def __init__(
        self,
        n_states: int = 20,
        floor: float = 0.03,
        phase: float = 1.0,
        windows: Sequence[int] = (1, 10),
        lag: int = 4,
        n_iterations: int = 5,
    ) -> None:
        """
        Parameters
        ----------
        n_states : each lasts 1 / n_states of the duration on average.
        floor : least standard deviation within a state, extents.
        phase : weight of the phase beside positions in extents; 0: the model alone knows how far the movement has come.
        windows : the log-likelihood of so many % of the duration is judged beside all of it.
        lag : displacements over so many % of the duration are observed beside positions.
        """
        self.n_states, self.floor, self.phase, self.windows, self.lag, self.n_iterations = (
            n_states,
            floor,
            phase,
            windows,
            lag,
            n_iterations,
        )

    def fit_paths(self, paths: Sequence[Path]) -> None:
        self.last_phase = max(len(path.position) for path in paths) - 1
        observed = [self._observed(path) for path in paths]
        self.model = self._learned(observed)
        falls = extended([self._log_likelihoods(o) for o in observed])
        self.mean = gaussian_filter1d(falls.mean(axis=0), SMOOTHING, axis=0, mode="nearest")
        variance = gaussian_filter1d(falls.var(axis=0, ddof=1), SMOOTHING, axis=0, mode="nearest")
        self.std = np.sqrt(variance + 1.0)

    def trace_path(self, path: Path) -> FloatArray:
        phase = np.minimum(np.arange(len(path.position)), len(self.mean) - 1)
        fallen = (self.mean[phase] - self._log_likelihoods(self._observed(path))) / self.std[phase]
        return np.sqrt(np.maximum(fallen, 0))  # squared distances become distances

    def _observed(self, path: Path) -> FloatArray:
        places = [path.position, path.to_goal, displacements(path.position, self.lag)]
        phase = STEP * np.minimum(np.arange(len(path.position)), self.last_phase)
        return np.column_stack([*places, self.phase * phase] if self.phase else places)

    def _learned(self, observed: Sequence[FloatArray]) -> GaussianHMM:
        n, n_features = self.n_states, observed[0].shape[1]
        state = [np.minimum(np.arange(len(o)) * n // len(o), n - 1) for o in observed]
        rows, states = np.concatenate(observed), np.concatenate(state)
        spread = self.floor**2 * np.eye(n_features)
        # The prior is divided by the number of samples in a state.
        prior = spread * len(rows) / n
        model = GaussianHMM(n, "full", covars_prior=prior, n_iter=self.n_iterations, params="tmc", init_params="")
        stay = 1 - n / np.mean([len(o) for o in observed])
        model.startprob_ = np.eye(n)[0]
        model.transmat_ = stay * np.eye(n) + (1 - stay) * np.eye(n, k=1)
        model.transmat_[-1, -1] = 1.0
        model.means_ = np.stack([rows[states == s].mean(axis=0) for s in range(n)])
        model.covars_ = np.stack([np.cov(rows[states == s].T) + spread for s in range(n)])
        return model.fit(rows, [len(o) for o in observed])

    def _log_likelihoods(self, observed: FloatArray) -> FloatArray:
        """Of each window and of all samples so far, (N, C) array, nats."""
        total = running_log_likelihoods(self.model, observed)
        return np.column_stack([total, *(displacements(total[:, None], window)[:, 0] for window in self.windows)])


def running_log_likelihoods(model: GaussianHMM, observed: FloatArray) -> FloatArray:
    """log p(x[0..t]) at each t: the forward algorithm, whose last value alone `GaussianHMM.score` returns.

    Parameters
    ----------
    observed : (N, F) array.

    Returns
    -------
    (N,) array, nats.
    """
    emission = np.column_stack(
        [multivariate_normal(m, c).logpdf(observed) for m, c in zip(model.means_, model.covars_, strict=True)]
    )
    predicted, total = model.startprob_, []
    for frame in emission:
        with np.errstate(divide="ignore"):
            joint = np.log(predicted) + frame
        largest = joint.max()
        alpha = np.exp(joint - largest)
        total.append(largest + np.log(alpha.sum()))
        predicted = alpha / alpha.sum() @ model.transmat_
    return np.cumsum(total)
