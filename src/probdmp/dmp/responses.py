"""The path of a movement as a linear function of its parameters.

Of each degree of freedom theta = (v0, g - p0, w): the start velocity in phase units, T_d p'(0), the goal as seen from the
start, and the N weights of the forcing term. A movement without amplitude scaling is linear in them,

    y[t] = p[t] - p0 = H[t] theta,

and so are its velocity and acceleration. A column of H is the response of the discretised transformation system to one
parameter: to a unit velocity at the start, to a unit goal, to each basis function. It is in phase units, in which every
movement lasts 1: T_d^2 p'', T_d p', p. So H depends on dt / T_d alone.
"""

from functools import lru_cache

import numpy as np

from probdmp.checks import FloatArray, frozen
from probdmp.dmp.basis import basis_features
from probdmp.dmp.configuration import Configuration
from probdmp.dmp.phase import phases_at
from probdmp.dmp.transformation_system import DISCRETIZATIONS, spring_matrix

__all__ = ["GOAL", "LONGEST_KEPT", "START_VELOCITY", "WEIGHTS", "continue_responses", "held_features", "parameter_responses"]

START_VELOCITY, GOAL, WEIGHTS = 0, 1, slice(2, None)
"""The order of the parameters theta, in every array that has them."""
LONGEST_KEPT = 4096
"""Steps of a movement up to which what has been computed of it is kept for others like it."""


def held_features(configuration: Configuration, phase_step: float, n_transitions: int, first_step: int = 0) -> FloatArray:
    """What the basis functions hold over each step, (n_transitions, N) array.

    Parameters
    ----------
    phase_step : dt / T_d.
    first_step : how many steps of the movement are over.
    """
    scheme = DISCRETIZATIONS[configuration.discretization]
    starts = first_step + np.arange(n_transitions, dtype=np.float64)

    def held(starts: FloatArray, stencil: tuple[tuple[float, float], ...]) -> FloatArray:
        values = [w * basis_features(phases_at((starts + at) * phase_step, 1.0), configuration.n_basis) for at, w in stencil]
        return np.sum(values, axis=0)

    features = held(starts, scheme.forcing_stencil)
    if first_step == 0:
        features[:1] = held(starts[:1], scheme.first_stencil)
    return features


def parameter_responses(configuration: Configuration, phase_step: float, n_steps: int) -> FloatArray:
    """H from the start of the movement on.

    Parameters
    ----------
    phase_step : dt / T_d; with n_steps > 1 / phase_step + 1 the responses go on after the end.
    n_steps : T, how many states.

    Returns
    -------
    (T, 3, N + 2) array, read-only: responses of acceleration, velocity and position, in phase units.
    """
    compute = _kept_responses if n_steps <= LONGEST_KEPT else _responses
    return compute(configuration, phase_step, n_steps)


def _responses(configuration: Configuration, phase_step: float, n_steps: int) -> FloatArray:
    first = np.zeros((1, 3, configuration.n_basis + 2))
    first[0, 1, START_VELOCITY] = 1.0
    first[0, 0, START_VELOCITY] = spring_matrix(configuration.alpha_z, np.asarray(1.0))[0]
    first[0, 0, GOAL] = configuration.stiffness
    first[0, 0, WEIGHTS] = basis_features(np.ones(1), configuration.n_basis)[0]
    return frozen(np.concatenate([first, continue_responses(configuration, phase_step, n_steps - 1, 0, first[0])]))


_kept_responses = lru_cache(maxsize=64)(_responses)


def continue_responses(
    configuration: Configuration, phase_step: float, n_steps: int, first_step: int, before: FloatArray
) -> FloatArray:
    """H of the n_steps states that follow the state `first_step`.

    Parameters
    ----------
    before : (3, N + 2) array, H of the state `first_step`.

    Returns
    -------
    (n_steps, 3, N + 2) array.
    """
    system = DISCRETIZATIONS[configuration.discretization].step(configuration.alpha_z, np.asarray(1.0), np.asarray(phase_step))
    inputs = np.zeros((n_steps, configuration.n_basis + 2))
    inputs[:, GOAL] = configuration.stiffness
    inputs[:, WEIGHTS] = held_features(configuration, phase_step, n_steps, first_step)
    rows = system.input_vector[:, None] * inputs[:, None, :]
    for t in range(n_steps):  # u[t-1] drives s[t-1] to s[t]
        before = rows[t] = rows[t] + system.transition @ before
    return rows
