"""An arm in the plane: what a camera sees of its tool, from the angles of its joints.

    x = sum_i l_i cos(q_1 + … + q_i),    y = sum_i l_i sin(q_1 + … + q_i)

The base is the origin; q_1 is measured from the x axis, every other joint from the link before it. Source: Spong, Hutchinson &
Vidyasagar, Robot Modeling and Control (2006), the planar elbow manipulator.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, check_names, frozen
from probdmp.dmp import Primitive
from probdmp.errors import InputError
from probdmp.execution.sensors import NonlinearSensor, variances_from_stds

__all__ = ["PlanarArm", "check_planar_arm", "planar_arm_sensor"]

DEGREES = ("deg", "degree", "degrees", "°")
"""Units that are no radians."""


@dataclass(frozen=True, slots=True, eq=False)
class PlanarArm:
    """Forward kinematics of an arm of L links, a function of the angles of its joints.

    Raises
    ------
    InputError, InputTypeError
        If there is no link, or a length is not above zero.
    """

    lengths: FloatArray
    """(L,) array, metres or whatever the tool is measured in, from the base to the tool."""

    def __post_init__(self) -> None:
        lengths = frozen(check_array(self.lengths, "link lengths", ("L",)))
        if not lengths.size or np.any(lengths <= 0):
            raise InputError("at least one link, all of lengths > 0", f"{lengths.tolist()!r:.100}")
        object.__setattr__(self, "lengths", lengths)

    def __call__(self, q: ArrayLike) -> FloatArray:
        """Where the tool is, (*batch, 2) array of x and y, in the units of the lengths.

        Parameters
        ----------
        q : (*batch, L) array, radians.
        """
        angles = self._angles(q)
        return np.stack([np.sum(self.lengths * turn(angles), axis=-1) for turn in (np.cos, np.sin)], axis=-1)

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """How the tool moves with each joint, (*batch, 2, L) array, units of the lengths per radian; `q` as above."""
        angles = self._angles(q)
        # Joint i turns link i and all after it.
        steps = np.stack([-self.lengths * np.sin(angles), self.lengths * np.cos(angles)], axis=-2)
        return np.flip(np.cumsum(np.flip(steps, axis=-1), axis=-1), axis=-1)

    def _angles(self, q: ArrayLike) -> FloatArray:
        """Of each link to the x axis, (*batch, L)."""
        batch = [None] * (np.ndim(q) - 1)
        return np.cumsum(check_array(q, "joint angles", (*batch, len(self.lengths))), axis=-1)


def planar_arm_sensor(
    name: str,
    link_lengths: ArrayLike,
    stds: ArrayLike,
    outputs: Sequence[str] | None = None,
    gate: float | None = None,
    linearization: str = "extended",
) -> NonlinearSensor:
    """A sensor of where the tool of a planar arm is, such as a camera; positions of the movement are the angles of its joints.

    Parameters
    ----------
    link_lengths : (L,) array, one for each degree of freedom, in the units of what is measured.
    stds : standard deviations, a number for both outputs or one for each.
    outputs : names of the columns of recordings that hold x and y of the tool; the sensor's name with _x and _y unless given.
    gate, linearization : as for `NonlinearSensor`.
    """
    arm = PlanarArm(check_array(link_lengths, f"link lengths of sensor {name!r:.50}", ("L",)))
    names = [f"{name}_x", f"{name}_y"] if outputs is None else check_names(outputs, "outputs")
    variances = variances_from_stds(stds, 2, name)
    return NonlinearSensor(name, arm, variances, arm.jacobian, linearization=linearization, outputs=tuple(names), gate=gate)


def check_planar_arm(sensor: NonlinearSensor, primitive: Primitive) -> None:
    """Refuse a sensor of `planar_arm_sensor` whose joints are not the degrees of freedom of a primitive.

    Raises
    ------
    InputError
        If there are more or fewer of them, or the primitive is in degrees.
    """
    arm = sensor.function
    if isinstance(arm, PlanarArm) and len(arm.lengths) != primitive.n_dof:
        expected = f"link lengths of sensor {sensor.name!r:.50}, one for each of {', '.join(primitive.names)}"
        raise InputError(expected, f"{len(arm.lengths)}", "Before each link is a joint, whose angle is a position.")
    if primitive.units.lower() in DEGREES:
        hint = "Convert the recordings, then learn the movement again."
        raise InputError(f"a movement in radians for the arm of sensor {sensor.name!r:.50}", primitive.units, hint)
