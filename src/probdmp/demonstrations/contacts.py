"""Wiping a yielding surface: a movement that has to feel right, with its truth, for trying sensor channels.

A hand comes down on a soft table, wipes along it with a certain firmness and lifts off. Movements are of least jerk. While in
contact the surface gives way by d and pushes back with a force proportional to it:

    z = height of the surface - d,    force = stiffness d + noise

Executions differ in where the surface is, in how firmly it is wiped, and in tempo. How deep the hand is says little of the
force, since the height of the surface is not known to a millimetre; how it has changed since the touch says more.
"""

from dataclasses import dataclass

import numpy as np

from probdmp.checks import FloatArray, freeze_arrays
from probdmp.demonstrations.demonstration import Demonstration
from probdmp.demonstrations.minimum_jerk import minimum_jerk_spline
from probdmp.demonstrations.synthesis import check_stds, check_synthesis
from probdmp.errors import InputTypeError

__all__ = ["Contact", "ContactVariation", "synthetic_contacts"]

DURATION = 1.6
"""Seconds."""
PHASES = np.array([0.0, 0.25, 0.35, 0.7, 0.8, 1.0])
"""Start, touch, firm, firm, leave, end; fractions of the duration."""
LENGTH, HEIGHT = 0.25, 0.06
"""Metres: of the way along the surface, and above it at start and end."""
DEPTH = 0.004
"""Metres by which the surface gives way."""
STIFFNESS = 2500.0
"""Newtons per metre."""


@dataclass(frozen=True, slots=True)
class ContactVariation:
    """How much executions differ: standard deviations, each >= 0."""

    surface: float = 0.001
    """Of the height of the surface, metres."""
    firmness: float = 0.15
    """Of the logarithm of the depth."""
    place: float = 0.004
    """Of start and end along the surface, metres."""
    tempo: float = 0.05
    """Of the logarithm of the duration."""
    position_noise: float = 0.0001
    """White noise of the position sensors, metres."""
    force_noise: float = 0.1
    """White noise of the force sensor, newtons."""

    def __post_init__(self) -> None:
        check_stds(self, firmness=0.5, tempo=0.5)


@dataclass(frozen=True, slots=True, eq=False)
class Contact:
    """One execution, and what is behind the recording."""

    demonstration: Demonstration
    """The recording: x, z in metres, and the channel "force" in newtons, with sensor noise."""
    positions: FloatArray
    """(T, 2) array, metres, without noise."""
    force: FloatArray
    """(T,) array, newtons, without noise."""

    def __post_init__(self) -> None:
        freeze_arrays(self)


def synthetic_contacts(
    n_demonstrations: int = 20, seed: int = 0, dt: float = 0.01, variation: ContactVariation = ContactVariation()
) -> list[Contact]:
    """Executions with their truth; each depends on the seed and its number alone.

    Parameters
    ----------
    dt : seconds between samples.

    Raises
    ------
    InputError, InputTypeError
        If a number is out of range.
    """
    n_demonstrations, seed, dt = check_synthesis(n_demonstrations, seed, dt)
    if not isinstance(variation, ContactVariation):
        raise InputTypeError("variation as a ContactVariation", type(variation).__name__)
    return [_execute((seed, k), dt, variation) for k in range(n_demonstrations)]


def _execute(entropy: tuple[int, ...], dt: float, variation: ContactVariation) -> Contact:
    """One execution; the noise is drawn last."""
    rng = np.random.default_rng(entropy)
    n_steps = max(round(DURATION * np.exp(variation.tempo * rng.standard_normal()) / dt), 3)
    depth = DEPTH * np.exp(variation.firmness * rng.standard_normal())
    surface = variation.surface * rng.standard_normal()
    ends = np.array([0.0, LENGTH]) + variation.place * rng.standard_normal(2)
    phases = np.linspace(0.0, 1.0, n_steps + 1)
    along = minimum_jerk_spline(np.array([0.0, 1.0]), ends[:, None])(phases)
    above = minimum_jerk_spline(np.array([0.0, PHASES[1]]), np.array([[HEIGHT], [surface]]))
    leaving = minimum_jerk_spline(np.array([PHASES[4], 1.0]), np.array([[surface], [HEIGHT]]))
    given = _between(phases, PHASES[1], PHASES[2]) * (1 - _between(phases, PHASES[3], PHASES[4])) * depth
    height = np.where(phases < PHASES[1], above(np.minimum(phases, PHASES[1]))[:, 0], surface)
    height = np.where(phases > PHASES[4], leaving(np.maximum(phases, PHASES[4]))[:, 0], height)
    positions, force = np.column_stack([along[:, 0], height - given]), STIFFNESS * given
    noisy = positions + variation.position_noise * rng.standard_normal(positions.shape)
    felt = force + variation.force_noise * rng.standard_normal(force.shape)
    return Contact(Demonstration(noisy, dt, "wipe", ("x", "z"), "m", {"force": felt}), positions, force)


def _between(phases: FloatArray, begin: float, end: float) -> FloatArray:
    """From 0 before `begin` to 1 after `end`, with least jerk."""
    rise = minimum_jerk_spline(np.array([0.0, 1.0]), np.array([[0.0], [1.0]]))
    return np.asarray(rise(np.clip((phases - begin) / (end - begin), 0.0, 1.0))[:, 0])
