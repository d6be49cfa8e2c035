"""Evidence that something has happened some ticks ago, against the forecast that the movement goes on.

    standstill_L    Has it stopped L ticks ago?        ln p(the last L ticks | at rest) / p(the last L ticks | all before)
    pace_L          Has it slowed down L ticks ago?    the same with: at half speed

The forecast from all that came before is a multivariate t over the path, mixed over shifts of tempo, so it knows how large,
how slanted, how late and how careless this very execution is.
"""

from collections.abc import Sequence
from functools import cached_property
from math import lgamma, log, pi
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.trajectory_statistics import SHIFT_STD
from probdmp.detection.window_maps import Densities, Needed, Rest, WindowInputs, WindowMaps
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
FIRST_BEFORE = 4
"""Points before after which it mostly is plain how unlikely they are altogether."""
FIRST_AHEAD = 2
"""Points ahead after which it mostly is plain that an execution has not slowed down."""


def central_of(shifts: IntArray) -> int:
    """Which shift of tempo is the likeliest one beforehand."""
    return int(np.argmin(np.abs(shifts)))


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
        self._windows, self._dof = PathWindows(model, offsets, shifts, n_places), model.means.shape[1]
        sizes = np.arange(len(offsets) * model.means.shape[1] + 1)
        gammas = np.array([lgamma((DEGREES_OF_FREEDOM + size) / 2) - lgamma(DEGREES_OF_FREEDOM / 2) for size in sizes])
        self._t_constants = gammas - sizes / 2 * log(DEGREES_OF_FREEDOM * pi)
        prior = np.exp(-((shifts / SHIFT_STD) ** 2) / 2)
        self._log_prior = np.log(prior / prior.sum())
        counts = self._dof * np.arange(1, len(offsets) + 1)
        scales = self._t_constants[counts] + self._windows.log_determinants + self._log_prior[:, None]
        # p^(-2 / halves): what 1 + square / freedom is multiplied with before it is raised to that power
        self._bases = np.exp(scales / (-(DEGREES_OF_FREEDOM + counts) / 2))

    def evidence(
        self, inputs: WindowInputs, offsets: IntArray, points: IntArray, wanted: IntArray, rest: Rest, needed: Needed
    ) -> list[FloatArray]:
        """Nats that speak for rest since the second of the points, of executions side by side.

        Parameters
        ----------
        inputs : of which nothing is unseen.
        offsets : (P) ticks at which the points of windows are seen, relative to the place.
        points, wanted : (J) of so many points, increasing, at so many places, the first ones, not increasing; after the first
            it may be plain that there is nothing.
        needed : of J - 2 channels.

        Returns
        -------
        J - 2 arrays (wanted, n).
        """
        numbers, ends = np.repeat(offsets, self._dof), points * self._dof
        return self._windows.maps.evidence(inputs, numbers, ends, wanted, self._densities(points), rest, needed)

    def ratios(
        self, inputs: WindowInputs, offsets: IntArray, points: IntArray, wanted: int, other: "Foreseen", needed: Needed
    ) -> FloatArray:
        """Nats that speak for what another foresees of the last of the points, (wanted, n) array.

        Parameters
        ----------
        points : (J) increasing: after each of the others it may be plain that there is nothing.
        needed : of one channel.
        """
        numbers, ends = np.repeat(offsets, self._dof), points * self._dof
        contrary, central = (other._windows.maps, other._densities(points)), central_of(self._windows.shifts)
        return self._windows.maps.ratios(inputs, numbers, ends, wanted, self._densities(points), contrary, needed, central)

    def _densities(self, points: IntArray) -> Densities:
        bases = np.ascontiguousarray(self._bases[..., points - 1].swapaxes(1, 2))
        return Densities(bases, int(DEGREES_OF_FREEDOM) + points * self._dof, DEGREES_OF_FREEDOM)

    def looks(self, before: int, ahead: IntArray, places: IntArray) -> "Looks":
        """Ready to be asked about single executions.

        Parameters
        ----------
        before : how many of the points come first, in all windows.
        ahead : (H) how many follow in each of H windows, increasing.
        places : (T, H) where the windows are at each tick.
        """
        points = np.stack([np.full_like(ahead, before), before + ahead], axis=1)
        rows = np.minimum(places, len(self._bases) - 1)[..., None]
        # (T, H, 2, A)
        bases = np.take_along_axis(self._bases[rows[..., 0]].swapaxes(-1, -2), (points - 1)[None, ..., None], axis=2)
        ends = np.concatenate([[0, before], before + ahead]) * self._dof
        powers = (DEGREES_OF_FREEDOM + points * self._dof) / 2
        return Looks(self._windows.maps, places.tolist(), ends, bases, powers)

    def log_densities(self, places: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """Of the points of windows (n, T, P, D) up to each one: (n, T, P) array."""
        white = self._windows.whiten(places, windows, means)
        scaled = np.log1p(white.squares / DEGREES_OF_FREEDOM) * (DEGREES_OF_FREEDOM + white.counts) / 2
        densities = self._t_constants[white.counts] + white.log_determinants - scaled + self._log_prior[:, None]
        return np.asarray(np.logaddexp.reduce(densities, axis=2))


class Looks(NamedTuple):
    """What is computed before to look at single executions fast: H windows at each of T ticks, each longer than the last."""

    maps: WindowMaps
    places: list[list[int]]
    ends: IntArray
    """(H + 2) outputs: none, those of the points that come first, and of all of each window."""
    bases: FloatArray
    """(T, H, 2, A) array."""
    powers: FloatArray
    """(H, 2) array."""

    def log_densities(self, tick: int, windows: Sequence[FloatArray], known: dict[int, FloatArray]) -> FloatArray:
        """Of the first points and of all, (h, 2) array, of the first h windows as in `WindowMaps.look`.

        Parameters
        ----------
        known : of this execution, by place, what the next window there begins with; kept from tick to tick.
        """
        count = len(windows)
        bases, powers = self.bases[tick, :count], self.powers[:count]
        squares = np.empty(bases.shape)
        for h, window in enumerate(windows):
            squares[h] = self._squares(h, self.places[tick][h], window, known)
        squares /= DEGREES_OF_FREEDOM
        squares += 1
        squares *= bases
        least = np.minimum.reduce(squares, axis=-1)
        np.divide(least[..., None], squares, out=squares)
        squares **= powers[..., None]
        return np.asarray(np.log(np.add.reduce(squares, axis=-1)) - powers * np.log(least))

    def _squares(self, h: int, place: int, window: FloatArray, known: dict[int, FloatArray]) -> FloatArray:
        """Squared distances of the first points and of all of window h, (2, A) array.

        Points that have been looked at in the window before, some ticks ago, are not looked at again.
        """
        begun = known.pop(place, None)
        if begun is None:
            sums = self.maps.look(place, window, self.ends[: h + 3])
            begun = sums[:2]
            for later in (sums[0], *sums[2:]):
                begun[1] += later
        else:
            begun[1] += self.maps.look(place, window, self.ends[h + 1 : h + 3])[0]
        if h + 1 < len(self.powers):
            known[place] = begun
        return begun


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
        self._points_at = np.array([np.searchsorted(self.ahead, h, "right") for h in self.horizons])
        self._constants = np.array([self._rest_constants(int(points)) for points in self._points_at])
        self._rest = Rest(self._rest_stds, self._constants, central_of(self.shifts))

    def weigh(self, inputs: WindowInputs, wanted: IntArray, needed: Needed) -> list[FloatArray]:
        """The same for each horizon at so many places, the first ones: J arrays (wanted, n).

        Parameters
        ----------
        inputs : of which nothing is unseen.
        needed : of the J channels.
        """
        before = len(self.before)
        points = np.array([FIRST_BEFORE, before, *(before + self._points_at)])
        offsets = np.concatenate([-self.before, self.ahead])
        places = np.array([wanted[0], wanted[0], *wanted])
        return self._going_on.evidence(inputs, offsets, points, places, self._rest, needed)

    @cached_property
    def _looks(self) -> Looks:
        places = np.maximum(np.arange(self.last + 1)[:, None] - np.array(self.horizons), 0)
        return self._going_on.looks(len(self.before), self._points_at, places)

    @cached_property
    def _compared(self) -> list[tuple[IntArray, IntArray, IntArray]]:
        """For the first J windows: where the numbers after each place are in all of them, and those of the place; and where the
        points begin."""
        dof, first = len(self._rest_stds), 1 + len(self._rest_stds)
        sizes = first + (len(self.before) + self._points_at) * dof
        ahead = [np.arange(end - n * dof, end) for end, n in zip(np.cumsum(sizes), self._points_at, strict=True)]
        here = [np.tile(np.arange(rows[0] - dof, rows[0]), len(rows) // dof) for rows in ahead]
        starts = np.cumsum(self._points_at) - self._points_at
        counts = range(1, len(ahead) + 1)
        return [(np.concatenate(ahead[:j]), np.concatenate(here[:j]), starts[:j]) for j in counts]

    def prepare(self) -> None:
        """Compute now what `look` would when it is first called."""
        _ = self._looks, self._compared

    def look(self, tick: int, windows: Sequence[FloatArray], known: dict[int, FloatArray]) -> FloatArray:
        """The same now of one execution, (j,) array, for the first j horizons.

        Parameters
        ----------
        windows : for each of these as in `WindowMaps.look`.
        known : of this execution; kept from tick to tick.
        """
        count = len(windows)
        here, together = self._looks.log_densities(tick, windows, known).T
        (ahead, place, starts), numbers = self._compared[count - 1], np.concatenate(windows)
        moved = (numbers[ahead] - numbers[place]).reshape(-1, len(self._rest_stds))
        moved /= self._rest_stds
        sums = np.add.reduceat(moved, starts)
        moved *= moved
        points = self._points_at[:count, None] + 1
        distances = (np.add.reduceat(moved, starts) - sums * sums / points).sum(axis=1)
        return np.asarray(self._constants[:count] - distances / 2 - (together - here))

    def _rest_constants(self, points: int) -> float:
        """ln of the density of so many points where it is largest."""
        dof = len(self._rest_stds)
        scale = float(np.log(np.diagonal(self._rest_whitening))[:points].sum()) * dof
        return scale - points * (float(np.log(self._rest_stds).sum()) + dof / 2 * log(2 * pi))

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

    def weigh(self, inputs: WindowInputs, wanted: IntArray, needed: Needed) -> list[FloatArray]:
        """The same for each horizon at so many places, the first ones: J arrays (wanted, n); arguments as for `Standstill`."""
        offsets, before = np.concatenate([-self.before, self.ahead]), len(self.before)
        points = [before + np.array([FIRST_AHEAD, np.searchsorted(self.ahead, h, "right")]) for h in self.horizons]
        return [
            self._going_on.ratios(inputs, offsets, own, int(count), self._slowed, needed.of([j]))
            for j, (own, count) in enumerate(zip(points, wanted, strict=True))
        ]

    @cached_property
    def _looks(self) -> tuple[Looks, Looks]:
        places = np.maximum(np.arange(self.last + 1)[:, None] - np.array(self.horizons), 0)
        ahead = np.array([len(self.ahead)])
        slowed, going_on = (account.looks(len(self.before), ahead, places) for account in (self._slowed, self._going_on))
        return slowed, going_on

    def prepare(self) -> None:
        """Compute now what `look` would when it is first called."""
        _ = self._looks

    def look(self, tick: int, windows: Sequence[FloatArray], known: dict[int, FloatArray]) -> FloatArray:
        """The same now of one execution, (1,) array; arguments as for `Standstill.look`."""
        # There is one horizon, so nothing is known from the ticks before, and nothing is kept.
        slowed, going_on = (looks.log_densities(tick, windows, known) for looks in self._looks)
        return np.asarray(slowed[:, 1] - going_on[:, 1])

    def judge(self, places: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """ln p(slow since the place) / p(gone on) for every point ahead that windows (n, T, P, D) hold: (n, T, points).

        What came before the place is equally likely under both.
        """
        ratios = self._slowed.log_densities(places, windows, means) - self._going_on.log_densities(places, windows, means)
        return ratios[..., len(self.before) :]


Evidence = Standstill | Pace
EVIDENCE: tuple[type[Standstill] | type[Pace], ...] = (Standstill, Pace)
"""What weighs two accounts of the last ticks against one another, in the order of their channels."""
