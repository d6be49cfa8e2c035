"""statsmodels: its compiled filter, one series after the other.

The univariate method is exact for one sensor and faster than the conventional one, and only what the likelihood needs is kept.
A model goes on with the data that it has filtered first, so each series has one of its own, made before the clock runs.
"""

import numpy as np
from statsmodels.tsa.statespace.kalman_filter import FILTER_UNIVARIATE
from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother

from peers.system import Score, Smooth, System
from probdmp.checks import FloatArray

__all__ = ["score_call", "smooth_call"]


def score_call(system: System, observations: FloatArray) -> Score:
    """Observations (N, T)."""
    models = [_bound(system, series) for series in observations]
    for model in models:
        model.set_filter_method(FILTER_UNIVARIATE)
    return lambda: np.array([model.loglike() for model in models])


def smooth_call(system: System, observations: FloatArray) -> Smooth:
    """Observations (N, T)."""
    models = [_bound(system, series) for series in observations]

    def smooth() -> tuple[FloatArray, FloatArray]:
        found = [model.smooth() for model in models]
        return np.stack([one.smoothed_state.T for one in found]), np.moveaxis(found[0].smoothed_state_cov, -1, 0)

    return smooth


def _bound(system: System, series: FloatArray) -> KalmanSmoother:
    """What it indexes by t drives t to t + 1; nothing follows the last of its T columns."""
    n_steps, n = system.n_steps, len(system.transition)
    model = KalmanSmoother(k_endog=1, k_states=n, k_posdef=1, nobs=n_steps)
    intercepts, variances = np.zeros((n, n_steps)), np.zeros((1, 1, n_steps))
    intercepts[:, :-1], variances[0, 0, :-1] = system.drifts.T, system.input_variances
    model["design"], model["obs_cov"] = system.observation_row[None], np.array([[system.observation_variance]])
    model["transition"], model["selection"] = system.transition, system.input_vector[:, None]
    model["state_intercept"], model["state_cov"] = intercepts, variances
    model.initialize_known(system.initial_mean, system.initial_covariance)
    model.tolerance = 0  # nothing converges: the noise depends on time
    model.bind(np.ascontiguousarray(series[:, None]))
    return model
