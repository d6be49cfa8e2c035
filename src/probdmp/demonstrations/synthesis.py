"""What all built-in data are asked with: how many, from which seed, how often sampled, how varied."""

from dataclasses import fields
from typing import Any

from probdmp.checks import LARGEST_MAGNITUDE, MILLISECONDS_HINT, check_array, check_count, check_seconds
from probdmp.errors import InputError

__all__ = ["check_stds", "check_synthesis"]

SAMPLING_INTERVALS = (1e-4, 0.1)
"""Seconds, shortest and longest dt."""


def check_synthesis(n_demonstrations: int, seed: int, dt: float) -> tuple[int, int, float]:
    """The three of them, clean."""
    n_demonstrations = check_count(n_demonstrations, "n_demonstrations")
    seed = check_count(seed, "seed", least=0)
    dt = check_seconds(dt, "dt")
    shortest, longest = SAMPLING_INTERVALS
    if not shortest <= dt <= longest:
        raise InputError(f"dt from {shortest:g} to {longest:g} seconds", repr(dt), MILLISECONDS_HINT)
    return n_demonstrations, seed, dt


def check_stds(variation: Any, **most: float) -> None:
    """Check the fields of a frozen dataclass of standard deviations, and make them floats, in place.

    Parameters
    ----------
    most : the largest allowed, by name, of those that have one: beyond it is no variation of the same movement any more.
    """
    for name in (field.name for field in fields(variation)):
        value = float(check_array(getattr(variation, name), name, ()))
        if not 0 <= value <= most.get(name, LARGEST_MAGNITUDE):
            bound = f", at most {most[name]:g}" if name in most else ""
            raise InputError(f"{name} >= 0, a standard deviation{bound}", repr(value))
        object.__setattr__(variation, name, value)
