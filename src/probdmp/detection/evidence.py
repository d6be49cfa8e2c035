"""Evidence that something has happened some ticks ago, against the forecast that the movement goes on.

    standstill_L    Has it stopped L ticks ago?        ln p(the last L ticks | at rest) / p(the last L ticks | all before)
    pace_L          Has it slowed down L ticks ago?    the same with: at half speed

The forecast from all that came before is a multivariate t over the path, mixed over shifts of tempo, so it knows how large,
how slanted, how late and how careless this very execution is.
"""

from math import lgamma, log, pi

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.trajectory_statistics import SHIFT_STD
from probdmp.detection.windows import PathWindows, inverse_of_cholesky

__all__ = ["DEGREES_OF_FREEDOM", "EVIDENCE", "Evidence", "Foreseen", "Pace", "Standstill"]

TEMPO_SHIFTS = np.arange(-8, 9, 4)
DEGREES_OF_FREEDOM = 4.0
"""Of the multivariate t: how much executions differ in their overall sloppiness."""
REST_STD = 0.01
"""How much what is at rest may still move, as a fraction of the range."""
LAST_STANDSTILL = 92
"""After this tick the movement may be coming to its end, and standing still is no evidence."""
SLOWED = 0.5
"""Speed of what is called slow."""


class Foreseen:
    """How likely windows are if an execution goes on as all that came before lets expect.

    Parameters
    ----------
    model : the Gaussian over paths.
    offsets : (P,) ticks of the model at which the points should be, relative to the place.
    shifts : (S,) ticks by which the execution may be ahead.
    n_places : places 0, 1, ….
    """

    def __init__(self, model: PathModel, offsets: IntArray, shifts: IntArray, n_places: int) -> None:
        self._windows = PathWindows(model, offsets, shifts, n_places)
        sizes = np.arange(len(offsets) * model.means.shape[1] + 1)
        gammas = np.array([lgamma((DEGREES_OF_FREEDOM + size) / 2) - lgamma(DEGREES_OF_FREEDOM / 2) for size in sizes])
        self._t_constants = gammas - sizes / 2 * log(DEGREES_OF_FREEDOM * pi)
        prior = np.exp(-((shifts / SHIFT_STD) ** 2) / 2)
        self._log_prior = np.log(prior / prior.sum())

    def log_densities(self, places: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """Of the points of windows (n, T, P, D) up to each one: (n, T, P) array."""
        white = self._windows.whiten(places, windows, means)
        scaled = np.log1p(white.squares / DEGREES_OF_FREEDOM) * (DEGREES_OF_FREEDOM + white.counts) / 2
        densities = self._t_constants[white.counts] + white.log_determinants - scaled + self._log_prior[:, None]
        return np.asarray(np.logaddexp.reduce(densities, axis=2))


class Standstill:
    """Whether an execution has stopped at a place, or gone on."""

    name, horizons = "standstill", (3, 6, 10, 16)
    before, ahead = np.array([36, 26, 18, 12, 8, 4, 0]), np.array([1, 2, 3, 4, 6, 8, 10, 13, 16])
    shifts = TEMPO_SHIFTS
    last = LAST_STANDSTILL

    def __init__(self, model: PathModel) -> None:
        offsets = np.concatenate([-self.before, self.ahead])
        self._going_on = Foreseen(model, offsets, self.shifts, self.last + 1 - self.horizons[0])
        n_ahead = len(self.ahead)
        self._rest_whitening = inverse_of_cholesky(np.ones((n_ahead, n_ahead)) + np.eye(n_ahead))
        self._rest_stds = np.sqrt(REST_STD**2 + model.noise_variances)

    def judge(self, places: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """ln p(at rest since the place) / p(gone on) for every point ahead that windows (n, T, P, D) hold: (n, T, points)."""
        mixed = self._going_on.log_densities(places, windows, means)
        here = len(self.before) - 1
        return self._at_rest(windows[:, :, here:]) - (mixed[..., here + 1 :] - mixed[..., here, None])

    def _at_rest(self, since: FloatArray) -> FloatArray:
        """Log-density of the points after the first, (n, T, 1 + points, D), if they are all where it is; (n, T, points).

        NaN from the first point on that was not seen; what came before it is judged as if the window ended there.
        """
        moved = (since[:, :, 1:] - since[:, :, :1]) / self._rest_stds
        points, dof = moved.shape[2:]
        whitening = self._rest_whitening[:points, :points]
        unseen = np.logical_or.accumulate(np.isnan(moved).any(axis=-1), axis=-1)
        squares = np.cumsum(np.sum(np.matmul(whitening, np.nan_to_num(moved)) ** 2, axis=-1), axis=-1)
        squares[unseen] = np.nan
        scales = np.cumsum(np.log(np.diagonal(whitening))) * dof - np.arange(1, points + 1) * np.log(self._rest_stds).sum()
        return np.asarray(scales - squares / 2 - np.arange(1, points + 1) * dof / 2 * log(2 * pi))


class Pace:
    """Whether an execution has slowed down at a place, or gone on."""

    name, horizons = "pace", (50,)
    before, ahead = np.array([36, 18, 6, 0]), np.array([10, 20, 30, 40, 50])
    shifts = TEMPO_SHIFTS[::2]
    last = TICKS + 50

    def __init__(self, model: PathModel) -> None:
        self._going_on, self._slowed = (
            Foreseen(model, np.concatenate([-self.before, ahead]), self.shifts, TICKS + 1)
            for ahead in (self.ahead, np.rint(SLOWED * self.ahead).astype(int))
        )

    def judge(self, places: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """ln p(slow since the place) / p(gone on) for every point ahead that windows (n, T, P, D) hold: (n, T, points).

        What came before the place is equally likely under both.
        """
        ratios = self._slowed.log_densities(places, windows, means) - self._going_on.log_densities(places, windows, means)
        return ratios[..., len(self.before) :]


Evidence = Standstill | Pace
EVIDENCE: tuple[type[Standstill] | type[Pace], ...] = (Standstill, Pace)
"""What weighs two accounts of the last ticks against one another, in the order of their channels."""
