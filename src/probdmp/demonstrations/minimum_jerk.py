"""Movements of least jerk: how an arm passes through points at given times when nothing else is asked of it.

Of all paths from rest to rest that are at p[i] at the times t[i], the one that minimises the integral of the squared third
derivative is a spline of quintic pieces with four continuous derivatives at the points between; with the velocity and the
acceleration zero at both ends it is unique. Between two points alone it is p0 + (p1 - p0) (10 s^3 - 15 s^4 + 6 s^5), s = t / T.

Sources: T. Flash & N. Hogan, The coordination of arm movements, Journal of Neuroscience 5 (1985), 1688-1703, who choose the
times of via-points too; I. J. Schoenberg, On interpolation by spline functions and its minimal properties (1964).
"""

from typing import TYPE_CHECKING, Any

from probdmp.checks import FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

__all__ = ["minimum_jerk_spline"]


def minimum_jerk_spline(times: FloatArray, points: FloatArray) -> "BSpline":
    """The path of least integrated squared jerk through points, at rest in the first and the last.

    Parameters
    ----------
    times : (V,) array, seconds, strictly increasing, V >= 2.
    points : (V, D) array, data units.
    """
    from scipy.interpolate import make_interp_spline

    at_rest: Any = [(order, 0.0 * points[0]) for order in (1, 2)]  # pairs of derivative and value, which the stubs do not know
    return make_interp_spline(times, points, k=5, bc_type=(at_rest, at_rest))
