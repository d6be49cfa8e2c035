"""A pen that carries out a planned movement, and that somebody may hold, push or slow down."""

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, check_choice
from probdmp.demonstrations import Demonstration, signals_of
from probdmp.dmp import Primitive, Task
from probdmp.execution.rollout import roll_out

__all__ = ["DISTURBANCES", "SimulatedPen", "planned_recording"]

DISTURBANCES = ("none", "hold", "push", "slow")
"""What may be done to a pen: let go; stopped at a point; pulled towards a point; half as fast."""
RETURN_TIME = 0.15
"""Seconds in which a pen that was let go has gone all but 1/e of the way back."""
PUSH_TIME = 0.2
"""Seconds in which a pen that is pushed has gone all but 1/e of the way to the point."""
SLOWED = 0.5
"""Speed of a slowed pen, as a fraction of its own."""
LONGEST = 3.0
"""Of its own duration, after which a movement that is held or slowed is given up."""


def planned_recording(primitive: Primitive, task: Task, dt: float, rng: np.random.Generator) -> Demonstration:
    """What sensors would record of the mean movement, channels included."""
    planned, d = roll_out(primitive, task, dt), primitive.n_dof
    stds = np.sqrt(primitive.signals.observation_variances)
    positions = planned.positions + rng.standard_normal(planned.positions.shape) * stds[:d]
    channels = {
        name: channel.means + rng.standard_normal(len(channel.means)) * std
        for (name, channel), std in zip(planned.channels.items(), stds[d:], strict=True)
    }
    return Demonstration(positions, dt, names=primitive.names, units=primitive.units, channels=channels)


class SimulatedPen:
    """Goes along a recorded movement, one reading a tick.

    Parameters
    ----------
    recording : where it goes if nobody disturbs it.
    channels : names of the channels that are read with the positions.
    noise_stds : (D,) array, data units: of a pen that is held, whose readings would otherwise repeat exactly.
    """

    def __init__(
        self, recording: Demonstration, channels: tuple[str, ...], noise_stds: FloatArray, rng: np.random.Generator
    ) -> None:
        self._path, self._d, self._dt = signals_of(recording, channels), recording.n_dof, recording.dt
        self._noise_stds, self._rng = noise_stds, rng
        self._at, self._n_ticks = 0.0, 0
        self._offset = np.zeros(self._d)
        self._mode, self._point = "none", np.zeros(self._d)

    @property
    def is_done(self) -> bool:
        """Whether it has arrived, or has taken far too long."""
        return self._at > len(self._path) - 1 or self._n_ticks > LONGEST * len(self._path)

    def disturb(self, mode: str, point: ArrayLike | None = None) -> None:
        """Do something to it from now on.

        Parameters
        ----------
        mode : one of `DISTURBANCES`.
        point : (D,) array, data units, where to hold it, or what to pull it towards.
        """
        check_choice(mode, "mode", DISTURBANCES)
        if mode in ("hold", "push"):
            given = [np.nan] * self._d if point is None else point
            self._point = check_array(given, "the point to hold or push the pen at", (self._d,))
        self._mode = mode

    def read(self) -> FloatArray:
        """(S,) array, units of each: positions and channels now; the pen then goes on."""
        below = min(int(self._at), len(self._path) - 1)
        above, share = min(below + 1, len(self._path) - 1), self._at - int(self._at)
        row = (1 - share) * self._path[below] + share * self._path[above]
        if self._mode == "hold":
            self._offset = self._point - row[: self._d]
            row[: self._d] = self._point + self._noise_stds * self._rng.standard_normal(self._d)
        else:
            wanted = self._point - row[: self._d] if self._mode == "push" else 0.0
            lasts = PUSH_TIME if self._mode == "push" else RETURN_TIME
            self._offset = wanted + (self._offset - wanted) * np.exp(-self._dt / lasts)
            row[: self._d] += self._offset
        self._at += {"hold": 0.0, "slow": SLOWED}.get(self._mode, 1.0)
        self._n_ticks += 1
        return row
