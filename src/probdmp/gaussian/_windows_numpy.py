"""The kernels for windows of recordings in NumPy, a part of `_kernels_numpy`.

All arrays are C-contiguous; the last ones are written to.
"""

import numpy as np

from probdmp.checks import FloatArray, IntArray

__all__ = ["least_squares", "split_sums", "window_evidence", "window_ratios", "window_sums"]

FEW = 16
"""Executions up to which all places are multiplied at once: then the calls cost more than the numbers."""


def least_squares(
    values: FloatArray,
    rows: IntArray,
    maps: FloatArray,
    which: IntArray,
    ends: IntArray,
    reach: IntArray,
    wanted: IntArray,
    penalties: FloatArray,
    found: FloatArray,
) -> None:
    """Squared length of windows after linear maps, up to several of their outputs: the least over accounts of a place.

    Parameters
    ----------
    values : (M, n) array: all numbers that may be in a window, of each execution.
    rows : (G, K) which of them make up the window at each of G places.
    maps : (U, R, K) array: R outputs of a window.
    which : (P, A) the maps of each place, for A accounts of it; a place beyond the last has those of the last.
    ends : (J) increasing; sums run over outputs 0, 1, ..., end - 1.
    reach : (R) how many inputs, the first ones of a window, an output depends on; not decreasing.
    wanted : (J) at how many places, the first ones, each of the sums is asked for; not increasing.
    penalties : (A) what is added to the squares of each account.
    found : written: J arrays (wanted, n), one after the other.
    """
    sums = _squares(values, rows, maps, which, ends, reach, wanted)
    for squares, least in zip(sums, split_sums(found, wanted, values.shape[1]), strict=True):
        np.add(squares, penalties[:, None], out=squares)
        np.minimum.reduce(squares, axis=1, out=least)


def _squares(
    values: FloatArray,
    rows: IntArray,
    maps: FloatArray,
    which: IntArray,
    ends: IntArray,
    reach: IntArray,
    wanted: IntArray,
) -> list[FloatArray]:
    """J arrays (wanted, A, n)."""
    n, n_accounts = values.shape[1], which.shape[1]
    sums = [np.empty((count, n_accounts, n)) for count in wanted.tolist()]
    if n <= FEW:
        _look_at_all_places(values, rows, maps, which, ends, sums)
        return sums
    window = np.empty((maps.shape[2], n))
    outputs = np.empty((int(np.diff(ends, prepend=0).max()) * n_accounts, n))
    for place in range(int(wanted[0])):
        np.take(values, rows[place], axis=0, out=window, mode="clip")
        at_place, begin = maps[which[min(place, len(which) - 1)]], 0
        for j, (end, used) in enumerate(zip(ends, reach[ends - 1], strict=True)):
            if place >= wanted[j]:
                break
            white = outputs[: (end - begin) * n_accounts]
            np.matmul(at_place[:, begin:end, :used].reshape(len(white), used), window[:used], out=white)
            np.multiply(white, white, out=white)
            np.add.reduce(white.reshape(n_accounts, end - begin, n), axis=1, out=sums[j][place])
            if j:
                sums[j][place] += sums[j - 1][place]
            begin = end
    return sums


def window_sums(
    maps: FloatArray, which: IntArray, reach: IntArray, window: FloatArray, ends: IntArray, sums: FloatArray
) -> None:
    """Squared lengths of the outputs of one window, from each of several ends to the next.

    Parameters
    ----------
    maps, reach : as for `least_squares`.
    which : (A,) the maps of the place, for A accounts of it.
    window : its first numbers, as many as the outputs reach.
    ends : (J + 1) increasing.
    sums : written, (J, A).
    """
    begin, end = ends[0], ends[-1]
    for account, number in enumerate(which):
        outputs = maps[number, begin:end, : len(window)] @ window
        sums[:, account] = np.add.reduceat(outputs * outputs, ends[:-1] - begin)


def window_evidence(
    values: FloatArray,
    rows: IntArray,
    maps: FloatArray,
    which: IntArray,
    ends: IntArray,
    reach: IntArray,
    wanted: IntArray,
    scales: FloatArray,
    n_halves: IntArray,
    stds: FloatArray,
    constants: FloatArray,
    floors: FloatArray,
    limits: FloatArray,
    found: FloatArray,
    freedom: float,
    central: int,
) -> None:
    """Evidence that all that follows the second end is at rest: ln p(all | at rest) - ln p(all) + ln p(what came before).

    p are mixtures sum_a (scale_a (1 + square_a / freedom))^-(n_halves / 2) over the accounts, the last one up to the second
    end; at the first it may be plain that there is no evidence. A window ends with as many numbers as there are outputs, points
    of D numbers; at rest, those after the second end are the last one before it and white noise, which that one has too. What
    is not above its floor is -infinity.

    Parameters
    ----------
    scales : (P, J, A) array, of each place and sum.
    n_halves : (J)
    stds : (D,) array, of the noise.
    constants : (J - 2) logarithms of the density at rest where it is largest.
    floors : (J - 2, n) array; they rise to what is found, from place to place.
    limits : (J - 2) up to which floors rise.
    found : written: J - 2 arrays (wanted, n), one after the other.
    central : the account that is asked first.
    """
    _, here, *together = _mixtures(values, rows, maps, which, ends, reach, wanted, scales, n_halves, freedom)
    n = values.shape[1]
    first, d = rows.shape[1] - maps.shape[1], len(stds)
    since, end = first + int(ends[1]) - d, first + int(ends[-1])
    points = values[rows[: len(here), since:end]].reshape(len(here), (end - since) // d, d, n)
    moved = (points[:, 1:] - points[:, :1]) / stds[:, None]
    n_ahead = (ends[2:] - ends[1]) // d
    of_each = zip(split_sums(found, wanted[2:], n), together, constants, floors, limits, n_ahead, strict=True)
    for some, mixed, constant, floor, limit, n_points in of_each:
        own = moved[: len(some), :n_points]
        squares = np.sum(own * own, axis=1) - np.sum(own, axis=1) ** 2 / (n_points + 1)
        some[:] = constant - squares.sum(axis=1) / 2 + here[: len(some)] - mixed
        _take_above(some, floor, limit)


def _take_above(found: FloatArray, floors: FloatArray, limit: float) -> None:
    """Leave of what is found, (G, n), only what is above its floor, (n,), which rises from place to place."""
    risen = np.minimum(found, limit)
    risen[~(found > floors)] = -np.inf
    risen = np.maximum.accumulate(np.concatenate([floors[None], risen]), axis=0)
    found[~(found > risen[:-1])] = -np.inf
    floors[:] = risen[-1]


def window_ratios(
    values: FloatArray,
    rows: IntArray,
    maps: FloatArray,
    which: IntArray,
    ends: IntArray,
    reach: IntArray,
    wanted: IntArray,
    scales: FloatArray,
    n_halves: IntArray,
    other_maps: FloatArray,
    other_which: IntArray,
    other_reach: IntArray,
    other_scales: FloatArray,
    floors: FloatArray,
    limits: FloatArray,
    found: FloatArray,
    freedom: float,
    central: int,
) -> None:
    """Evidence for other windows: ln p'(all) - ln p(all), mixtures up to the last end; not above its floor it is -infinity.

    Parameters
    ----------
    other_maps, other_which, other_reach, other_scales : of p'.
    floors : (n,) array; they rise to what is found, from place to place.
    limits : (1) up to which floors rise.
    found : written: a single array (wanted, n).
    central : the account that is asked first.
    """
    last, ratios = slice(len(ends) - 1, None), found.reshape(-1, values.shape[1])
    (together,), (other,) = (
        _mixtures(values, rows, own, of_places, ends[last], used, wanted[last], bases[:, last], n_halves[last], freedom)
        for own, of_places, used, bases in (
            (maps, which, reach, scales),
            (other_maps, other_which, other_reach, other_scales),
        )
    )
    np.subtract(other, together, out=ratios)
    _take_above(ratios, floors, limits[0])


def split_sums(found: FloatArray, wanted: IntArray, n: int) -> list[FloatArray]:
    """The J arrays (wanted, n) that are written one after the other."""
    ends = np.cumsum(wanted * n).tolist()
    return [found[end - count * n : end].reshape(count, n) for end, count in zip(ends, wanted.tolist(), strict=True)]


def _mixtures(
    values: FloatArray,
    rows: IntArray,
    maps: FloatArray,
    which: IntArray,
    ends: IntArray,
    reach: IntArray,
    wanted: IntArray,
    scales: FloatArray,
    n_halves: IntArray,
    freedom: float,
) -> list[FloatArray]:
    """ln sum_a (scale_a (1 + square_a / freedom))^-(n_halves / 2) of squares, over the accounts: J arrays (wanted, n)."""
    sums = _squares(values, rows, maps, which, ends, reach, wanted)
    mixtures = [np.empty((len(some), values.shape[1])) for some in sums]
    for j, (some, mixed) in enumerate(zip(sums, mixtures, strict=True)):
        own = scales[np.minimum(np.arange(len(some)), len(scales) - 1), j]
        _mix(some, own, mixed, int(n_halves[j]), freedom)
    return mixtures


def _mix(squares: FloatArray, scales: FloatArray, mixed: FloatArray, n_halves: int, freedom: float) -> None:
    """Mixtures (G, n) of squares (G, A, n) with scales (G, A)."""
    # A few places at a time, which stay close to the processor.
    step = max(1, 16384 // max(squares[0].size, 1)) if len(squares) else 1
    for begin in range(0, len(squares), step):
        part = slice(begin, begin + step)
        bases = squares[part] * (scales[part, :, None] / freedom)
        bases += scales[part, :, None]
        least = bases.min(axis=1)
        np.divide(least[:, None], bases, out=bases)
        np.log(_power(bases, n_halves).sum(axis=1), out=mixed[part])
        mixed[part] -= n_halves / 2 * np.log(least)


def _power(base: FloatArray, n_halves: int) -> FloatArray:
    """base^(n_halves / 2) of numbers from 0 to 1, by squaring: far faster than for any exponent."""
    power, exponent = np.sqrt(base) if n_halves % 2 else None, n_halves // 2
    while exponent:
        if exponent % 2:
            power = base.copy() if power is None else np.multiply(power, base, out=power)
        exponent //= 2
        if exponent:
            np.multiply(base, base, out=base)
    return np.ones_like(base) if power is None else power


def _look_at_all_places(
    values: FloatArray, rows: IntArray, maps: FloatArray, which: IntArray, ends: IntArray, found: list[FloatArray]
) -> None:
    count, n_accounts, end = len(found[0]), which.shape[1], int(ends[-1])
    at = maps[which[np.minimum(np.arange(count), len(which) - 1)], :end]
    white = np.matmul(at.reshape(count, n_accounts * end, maps.shape[2]), values[rows[:count]])
    np.multiply(white, white, out=white)
    sums = np.add.reduceat(white.reshape(count, n_accounts, end, values.shape[1]), [0, *ends[:-1]], axis=2)
    np.cumsum(sums, axis=2, out=sums)
    for j, own in enumerate(found):
        own[:] = sums[: len(own), :, j]
