"""Weights that another library has learned, as a primitive.

Most DMPs are the same spring-damper system (T_d: the duration, s: 1 or g - p0),

    T_d^2 p'' = alpha_z (alpha_z / 4 (g - p) - T_d p') + s f(x),   f(x) = x sum_i w_i psi_i(x) / sum_i psi_i(x),
    psi_i(x) = exp(-h_i (x - c_i)^2),   x(t) = exp(-decay t / T_d),

but differ in how fast the phase decays and in where, how wide and how many the psi_i are. So weights cannot be taken over.
The forcing term can: as a function of t / T_d it is fitted with the basis functions of this library, more of them than it came
with, and refused if the movement that it makes is another one.

Where these come from:

    movement_primitives 0.9   DMP: forcing_term.weights_, .centers, .widths, decay = forcing_term.alpha_z; with
                              smooth_scaling, alpha_y beta_y (goal_y - start_y) is to be taken from each weight first
    pydmps 0.2                DMPs_discrete: w, c, h, decay = cs.ax, is_scaled=True

Source: their code. Weights say where a movement goes and nothing of how executions differ: the primitive has no variance but
that of its sensors, which is made up. To monitor executions, learn from the recordings instead.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import BoolArray, FloatArray, check_array, check_positive, check_seconds, freeze_arrays
from probdmp.dmp import Configuration, Primitive
from probdmp.dmp.basis import basis_features
from probdmp.dmp.phase import phases_at
from probdmp.dmp.primitive import SCALING_GUARD
from probdmp.dmp.transformation_system import DISCRETIZATIONS, POSITION
from probdmp.errors import InputError

__all__ = ["MOST_DEVIATION", "SENSOR_STD", "ForcingWeights", "primitive_from_weights"]

SENSOR_STD = 0.01
"""Standard deviation of the position sensors, as a fraction of the range: nobody has measured it."""
MOST_DEVIATION = 2e-3
"""How far the movement may be from that of the weights as they came, as a fraction of its range."""
GRID = 2000
"""Steps of a movement at which the forcing term is fitted, and the two movements are compared."""
FEWEST_BASIS = 30


@dataclass(frozen=True, slots=True, eq=False)
class ForcingWeights:
    """A forcing term as another library has it.

    Raises
    ------
    InputError, InputTypeError
        If shapes disagree, a number is not finite, or a width or the decay is not positive.
    """

    weights: FloatArray
    """w, (D, N) array, data units; 1 with `is_scaled`."""
    centers: FloatArray
    """c, (N,) array, phases."""
    widths: FloatArray
    """h, (N,) array, 1 / phase squared, > 0."""
    decay: float
    """How fast the phase decays, per movement: x(t) = exp(-decay t / duration)."""
    is_scaled: bool = False
    """Whether the forcing term is multiplied by g - p0."""

    def __post_init__(self) -> None:
        weights = check_array(self.weights, "weights", ("D", "N"), hint="One row for each degree of freedom.")
        shape = (weights.shape[1],)
        values = {"weights": weights} | {name: check_array(getattr(self, name), name, shape) for name in ("centers", "widths")}
        if weights.size == 0 or np.any(values["widths"] <= 0):
            raise InputError(
                "at least one weight, and widths > 0", f"{weights.shape} weights, widths {values['widths']!r:.100}"
            )
        for name, value in values.items():
            object.__setattr__(self, name, value.copy())
        object.__setattr__(self, "decay", check_positive(self.decay, "decay"))
        freeze_arrays(self)

    def values(self, times: FloatArray) -> FloatArray:
        """f at (T,) times, in units of the duration: (T, D) array."""
        phases = np.exp(-self.decay * times)
        exponents = -self.widths * (phases[:, None] - self.centers) ** 2
        psi = np.exp(exponents - exponents.max(axis=-1, keepdims=True))
        return np.asarray((psi * (phases / psi.sum(axis=-1))[:, None]) @ self.weights.T)


def primitive_from_weights(
    forcing: ForcingWeights,
    start: ArrayLike,
    goal: ArrayLike,
    duration: float,
    dt: float,
    alpha_z: float = 25.0,
    n_basis: int | None = None,
) -> Primitive:
    """The primitive that moves as weights learned elsewhere do.

    Parameters
    ----------
    start, goal : (D,) arrays, data units: of the movement that taught the weights. It starts at rest.
    duration, dt : seconds, of that movement and between its samples.
    alpha_z : spring constant, with beta = alpha_z / 4, which is usual.
    n_basis : basis functions; unless given, three for each weight of a degree of freedom, and at least 30.

    Raises
    ------
    InputError, InputTypeError
        If an argument cannot be used, or with so many basis functions it would be another movement.
    """
    (n_dof, count), shape = forcing.weights.shape, (len(forcing.weights),)
    start, goal = check_array(start, "start", shape), check_array(goal, "goal", shape)
    duration, dt = check_seconds(duration, "duration"), check_seconds(dt, "dt")
    chosen = min(max(FEWEST_BASIS, 3 * count), 1000) if n_basis is None else n_basis
    scaling = "paper" if forcing.is_scaled else "none"
    configuration = Configuration(n_basis=chosen, alpha_z=alpha_z, scaling=scaling, forcing_noise="posterior")
    weights, ranges = _fitted(forcing, start, goal, configuration)
    return Primitive(
        configuration=configuration,
        weight_means=weights,
        weight_covariances=np.zeros((n_dof, configuration.n_basis, configuration.n_basis)),
        weight_precisions=np.ones(n_dof),
        forcing_precisions=np.ones(n_dof),
        observation_variances=(SENSOR_STD * ranges) ** 2,
        goal_displacements=goal - start,
        ranges=ranges,
        start=start,
        goal=goal,
        start_velocities=np.zeros(n_dof),
        start_covariances=np.zeros((n_dof, 2, 2)),
        duration=duration,
        dt=dt,
        phase_step=dt / duration,
        n_demonstrations=1,
        names=tuple(f"dof{d}" for d in range(n_dof)),
    )


def _fitted(
    forcing: ForcingWeights, start: FloatArray, goal: FloatArray, configuration: Configuration
) -> tuple[FloatArray, FloatArray]:
    """Weights of our basis functions, (D, N), and the range of the movement, (D,)."""
    middles = (np.arange(GRID) + 0.5) / GRID
    given = forcing.values(middles) * (goal - start if forcing.is_scaled else 1.0)
    features = basis_features(phases_at(middles, 1.0), configuration.n_basis)
    weights: FloatArray = np.asarray(np.linalg.lstsq(features, given, rcond=None)[0].T, dtype=np.float64)
    ranges: FloatArray = np.ptp(_movement(configuration, configuration.stiffness * (goal - start) + given), axis=0)
    if np.any(ranges == 0):
        raise InputError("weights that move every degree of freedom", f"none of number {int(np.argmin(ranges))}")
    deviation = float((np.abs(_movement(configuration, features @ weights.T - given)).max(axis=0) / ranges).max())
    if deviation > MOST_DEVIATION:
        hint = "Give it more basis functions, n_basis, or learn it anew from the recording."
        expected = f"weights that {configuration.n_basis} basis functions can follow within {MOST_DEVIATION:g} of the range"
        raise InputError(expected, f"a movement {deviation:.2g} away", hint)
    if forcing.is_scaled and np.any(_hardly_moves(goal - start, ranges)):
        hint = "From start to goal it hardly moves, so that its forcing term cannot be scaled by that. Learn it anew."
        raise InputError(f"a goal at least {SCALING_GUARD:g} of the range from the start", f"{goal - start}", hint)
    return weights, ranges


def _hardly_moves(displacements: FloatArray, ranges: FloatArray) -> BoolArray:
    return np.asarray(np.abs(displacements) < SCALING_GUARD * ranges)


def _movement(configuration: Configuration, inputs: FloatArray) -> FloatArray:
    """Positions from rest at 0 under inputs that are held over the steps of `GRID`, (GRID + 1, D) array."""
    system = DISCRETIZATIONS["exact"].step(configuration.alpha_z, np.asarray(1.0), np.asarray(1 / GRID))
    state = np.zeros((3, inputs.shape[1]))
    positions = [state[POSITION]]
    for held in inputs:
        state = system.transition @ state + system.input_vector[:, None] * held
        positions.append(state[POSITION])
    return np.stack(positions)
