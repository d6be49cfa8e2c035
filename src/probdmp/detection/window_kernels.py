"""The two sums that judging a trajectory spends its time on, over many windows of many executions at once.

Executions are innermost, so that each operation runs along contiguous memory whatever the shape of a window.
"""

import numpy as np

from probdmp.checks import FloatArray, IntArray

__all__ = ["log_mixtures", "whitened_squares"]

FEW = 16
"""Executions up to which all places are multiplied at once: then the calls cost more than the numbers."""


def whitened_squares(
    inputs: FloatArray, rows: IntArray, maps: FloatArray, ends: IntArray, reach: IntArray, wanted: IntArray
) -> list[FloatArray]:
    """Squared length of windows after a linear map, summed up to several of its outputs.

    Parameters
    ----------
    inputs : (M, n) array: all numbers that may be in a window, of each execution.
    rows : (G, K) which of them make up the window at each of G places.
    maps : (P, R, A, K) array: R outputs of each place under A accounts of it; a place beyond the last has its map.
    ends : (J) increasing; sums run over outputs 0, 1, ..., end - 1.
    reach : (J) outputs before each end depend on so many inputs, the first ones of a window.
    wanted : (J) at how many places, the first ones, each of the sums is asked for; not increasing.

    Returns
    -------
    J arrays (wanted, A, n).
    """
    n, (n_accounts, n_inputs) = inputs.shape[1], maps.shape[2:]
    if n <= FEW:
        return _all_places_at_once(inputs, rows, maps, ends, wanted)
    sums = [np.empty((count, n_accounts, n)) for count in wanted]
    window = np.empty((n_inputs, n))
    outputs = np.empty((int(np.diff(ends, prepend=0).max()) * n_accounts, n))
    for place in range(int(wanted[0])):
        np.take(inputs, rows[place], axis=0, out=window, mode="clip")
        at_place, begin = maps[min(place, len(maps) - 1)].reshape(-1, n_inputs), 0
        for j, (end, used) in enumerate(zip(ends, reach, strict=True)):
            if place >= wanted[j]:
                break
            white = outputs[: (end - begin) * n_accounts]
            np.matmul(at_place[begin * n_accounts : end * n_accounts, :used], window[:used], out=white)
            np.multiply(white, white, out=white)
            np.add.reduce(white.reshape(end - begin, n_accounts, n), axis=0, out=sums[j][place])
            if j:
                sums[j][place] += sums[j - 1][place]
            begin = end
    return sums


def log_mixtures(squares: FloatArray, scales: FloatArray, n_halves: int, freedom: float) -> FloatArray:
    """ln sum_a (scale_a (1 + square_a / freedom))^-(n_halves / 2) of squares (G, A, n) and scales (G, A): (G, n) array."""
    mixed = np.empty((len(squares), squares.shape[2]))
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
    return mixed


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


def _all_places_at_once(
    inputs: FloatArray, rows: IntArray, maps: FloatArray, ends: IntArray, wanted: IntArray
) -> list[FloatArray]:
    count, (n_accounts, n_inputs) = int(wanted[0]), maps.shape[2:]
    at = maps[:count] if count <= len(maps) else maps[np.minimum(np.arange(count), len(maps) - 1)]
    at = at[:, : ends[-1]].reshape(count, -1, n_inputs)
    white = np.matmul(at, inputs[rows[:count]])
    np.multiply(white, white, out=white)
    sums = np.add.reduceat(white.reshape(count, ends[-1], n_accounts, -1), [0, *ends[:-1]], axis=1)
    np.cumsum(sums, axis=1, out=sums)
    return [sums[:some, j] for j, some in enumerate(wanted)]
