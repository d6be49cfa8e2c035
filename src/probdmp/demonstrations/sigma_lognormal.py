"""The sigma-lognormal model of rapid human movement: strokes of lognormal speed along circular arcs, added up as vectors.

Stroke i is commanded at t0 and covers the distance D while it turns from the direction theta_s to theta_e. With z the
logarithm of the time since the command in standard units, phi the standard normal density and Phi its distribution function,

    z(t)     = (ln(t - t0) - mu) / sigma
    |v_i|(t) = D phi(z) / (sigma (t - t0))                     the lognormal speed; 0 until t0
    theta(t) = theta_s + (theta_e - theta_s) Phi(z)            the direction: (1 + erf(z / sqrt 2)) / 2 = Phi(z)
    v(t)     = sum_i |v_i|(t) (cos theta_i(t), sin theta_i(t))

theta advances with the distance covered, so a stroke is a circular arc, and with s = Phi(z), h = (theta_e - theta_s) s / 2
its displacement is the chord D s sin(h) / h in the direction theta_s + h: nothing is integrated numerically.

Sources: R. Plamondon, A kinematic theory of rapid human movements, Biological Cybernetics 72 (1995), 295-320; R. Plamondon &
M. Djioua, A multi-level representation paradigm for handwriting stroke generation, Human Movement Science 25 (2006), 586-607;
C. O'Reilly & R. Plamondon, Development of a Sigma-Lognormal representation for on-line signatures, Pattern Recognition 42
(2009), 3324-3337.
"""

from dataclasses import dataclass, fields

import numpy as np

from probdmp.checks import FloatArray, frozen

__all__ = ["Strokes", "accelerations", "directions", "displacements", "speeds", "strokes_between", "velocities"]


@dataclass(frozen=True, slots=True, eq=False)
class Strokes:
    """N strokes of one movement: what the model's equations need."""

    onsets: FloatArray
    """(N,) array, seconds: t0, when the command is given."""
    log_time_delays: FloatArray
    """(N,) array, ln seconds: mu; after exp(mu) half of the distance is covered."""
    log_response_times: FloatArray
    """(N,) array, > 0: sigma, the spread of the response over logarithmic time."""
    amplitudes: FloatArray
    """(N,) array, data units: D, the distance covered."""
    start_angles: FloatArray
    """(N,) array, radians from the x axis, counterclockwise: theta_s."""
    end_angles: FloatArray
    """(N,) array, radians: theta_e."""

    def __post_init__(self) -> None:
        for name in (field.name for field in fields(self)):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def instants(self, z: float) -> FloatArray:
        """(N,) array, seconds: when each stroke has Phi(z) of its distance behind it."""
        return self.onsets + np.exp(self.log_time_delays + z * self.log_response_times)


def strokes_between(
    targets: FloatArray, bends: FloatArray, onsets: FloatArray, log_time_delays: FloatArray, log_response_times: FloatArray
) -> Strokes:
    """Strokes along arcs from each virtual target to the next.

    Parameters
    ----------
    targets : (N + 1, 2) array, data units; each stroke, left alone, would go from one to the next.
    bends : (N,) array, radians, between -2 pi and 2 pi: theta_e - theta_s, counterclockwise; 0 is straight.
    onsets, log_time_delays, log_response_times : (N,) arrays, as in `Strokes`.
    """
    chords = np.diff(targets, axis=0)
    along = np.arctan2(chords[:, 1], chords[:, 0])
    amplitudes = np.hypot(chords[:, 0], chords[:, 1]) / _chord_per_arc(bends)
    return Strokes(onsets, log_time_delays, log_response_times, amplitudes, along - bends / 2, along + bends / 2)


def speeds(strokes: Strokes, times: FloatArray) -> FloatArray:
    """Speed of each stroke, (T, N) array, data units per second: lognormal, 0 until its onset.

    Parameters
    ----------
    times : (T,) array, seconds.
    """
    return strokes.amplitudes * _response(strokes, times)[1]


def directions(strokes: Strokes, times: FloatArray) -> FloatArray:
    """Direction of each stroke, (T, N) array, radians: from its start angle to its end angle."""
    covered, _, _ = _response(strokes, times)
    return strokes.start_angles + (strokes.end_angles - strokes.start_angles) * covered


def displacements(strokes: Strokes, times: FloatArray) -> FloatArray:
    """How far the movement is from where it began, (T, 2) array, data units."""
    covered, _, _ = _response(strokes, times)
    turned = (strokes.end_angles - strokes.start_angles) * covered
    chords = strokes.amplitudes * covered * _chord_per_arc(turned)
    return _summed(chords, np.zeros_like(chords), strokes.start_angles + turned / 2)


def velocities(strokes: Strokes, times: FloatArray) -> FloatArray:
    """(T, 2) array, data units per second."""
    along = speeds(strokes, times)
    return _summed(along, np.zeros_like(along), directions(strokes, times))


def accelerations(strokes: Strokes, times: FloatArray) -> FloatArray:
    """(T, 2) array, data units per second squared: along each stroke, and across it where it is bent."""
    _, rate, change = _response(strokes, times)
    across = strokes.amplitudes * rate**2 * (strokes.end_angles - strokes.start_angles)
    return _summed(strokes.amplitudes * change, across, directions(strokes, times))


def _response(strokes: Strokes, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The lognormal distribution function, its density and the density's slope, (T, N) arrays: 1, 1 / s, 1 / s^2."""
    from scipy.special import ndtr

    mu, sigma = strokes.log_time_delays, strokes.log_response_times
    since = times[:, None] - strokes.onsets
    log_time = np.log(np.where(since > 0, since, 1.0))  # 1: anything, the result is 0 there
    z = (log_time - mu) / sigma
    # Divided by the time in the exponent: of a time next to nothing the reciprocal alone would overflow.
    density = np.exp(-(z**2) / 2 - log_time) / (np.sqrt(2 * np.pi) * sigma)
    slope = -np.exp(-(z**2) / 2 - 2 * log_time) * (1 + z / sigma) / (np.sqrt(2 * np.pi) * sigma)
    return np.where(since > 0, ndtr(z), 0.0), np.where(since > 0, density, 0.0), np.where(since > 0, slope, 0.0)


def _chord_per_arc(turned: FloatArray) -> FloatArray:
    """Length of the chord over that of a circular arc which turns by so many radians; 1 for a straight one."""
    return np.asarray(np.sinc(turned / (2 * np.pi)))


def _summed(along: FloatArray, across: FloatArray, angles: FloatArray) -> FloatArray:
    """(T, 2) array: vectors with components along and to the left of each stroke's direction, (T, N) arrays, added up."""
    cos, sin = np.cos(angles), np.sin(angles)
    return np.column_stack([(along * cos - across * sin).sum(axis=1), (along * sin + across * cos).sum(axis=1)])
