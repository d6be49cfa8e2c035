"""How a movement should feel: sensor channels that vary with it, an associative skill memory.

A channel, such as a force, is no state of the movement and nobody commands it. But it was recorded along with every
demonstration, and it is a function of the phase like the path, with parameters drawn together with those of the movement:

    c[t] = (1, H[t]) x_c,    (theta, x_c) jointly Gaussian,    o[t] = c[t] + deviation + noise

H is the same as for the path (`probdmp.dmp.responses`): x_c = (c[0], c'[0], where it ends minus where it starts, N weights). So
what one shows is told of the other: a push that the position sensors see changes the force that is expected, and a force that
is not as it should be tells where the movement goes.

Source: Pastor, Kalakrishnan, Meier, Stulp, Buchli, Theodorou & Schaal, From dynamic movement primitives to associative skill
memories, Robotics and Autonomous Systems 61 (2013).
"""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, check_array, frozen
from probdmp.errors import InputError, InputTypeError

__all__ = ["ChannelVariation", "Signals"]


@dataclass(frozen=True, slots=True, eq=False)
class ChannelVariation:
    """F channels of a new execution, and how they vary with its movement; arrays are read-only.

    Raises
    ------
    InputError, InputTypeError
        If shapes disagree, a number is not finite, or a variance is not positive.
    """

    names: tuple[str, ...]
    """(F), those of the demonstrations."""
    means: FloatArray
    """Of x_c, (F, N + 3) array, units of the channel: start, start velocity in phase units, end minus start, weights."""
    covariance: FloatArray
    """(F (N + 3), F (N + 3)) array; the order is that of `means.ravel()`."""
    cross_covariance: FloatArray
    """(F (N + 3), D (N + 2)) array: with theta of the movement."""
    residual_variances: FloatArray
    """(F,) array, units of the channel squared, > 0: of what was recorded around the values that x_c gives."""
    observation_variances: FloatArray
    """R, (F,) array, > 0: of the sensor."""
    forcing_precisions: FloatArray
    """beta, (F,) array, > 0: precision of the noise that drives what the parameters leave over; as for the movement."""
    ranges: FloatArray
    """(F,) array, > 0: mean extent of the channel over a demonstration."""

    def __post_init__(self) -> None:
        if not all(
            isinstance(text, kind) for text, kind in ((self.names, tuple | list), *((name, str) for name in self.names))
        ):
            raise InputTypeError("names of channels as text", f"{self.names!r:.100}")
        f = len(self.names)
        if f < 1 or len(set(self.names)) < f:
            raise InputError("at least one channel, all named differently", repr(self.names))
        object.__setattr__(self, "names", tuple(self.names))
        means = check_array(self.means, "channel means", (f, "N + 3"))
        shapes: dict[str, tuple[int | str, ...]] = {
            "means": (f, "N + 3"),
            "covariance": (means.size, means.size),
            "cross_covariance": (means.size, "D (N + 2)"),
        }
        for field in fields(self):
            if field.name != "names":
                shape = shapes.get(field.name, (f,))
                array = frozen(check_array(getattr(self, field.name), f"channel {field.name}", shape))
                if shape == (f,) and np.any(array <= 0):
                    raise InputError(f"channel {field.name} > 0", f"{array.min():g}")
                object.__setattr__(self, field.name, array)

    def arrays(self) -> dict[str, FloatArray]:
        """All that it holds but the names, by name."""
        return {field.name: getattr(self, field.name) for field in fields(self) if field.name != "names"}


class Signals(NamedTuple):
    """All that can be measured of a movement: its degrees of freedom, then its channels, S of them."""

    names: tuple[str, ...]
    """(S)"""
    ranges: FloatArray
    """(S,) array, > 0."""
    observation_variances: FloatArray
    """R, (S,) array, > 0."""
    forcing_precisions: FloatArray
    """beta, (S,) array, > 0."""
    residual_variances: FloatArray | None
    """(S,) array, > 0; None where the primitive does not know how demonstrations vary."""
