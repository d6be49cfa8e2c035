"""The channels in which a trajectory is judged: their names, and how they are weighed against one another."""

from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.evidence import EVIDENCE, Evidence

__all__ = [
    "LARGEST_LOG_RATIO",
    "MEMORY",
    "MOVEMENT_CHANNELS",
    "MOVEMENT_FLOORS",
    "MOVEMENT_HANDICAPS",
    "Horizon",
    "as_evidence",
    "as_suspicion",
    "as_value",
    "as_values",
    "channels_for",
]

MOVEMENT_CHANNELS = ("position", "displacement", *(f"{kind.name}_{horizon}" for kind in EVIDENCE for horizon in kind.horizons))
MOVEMENT_FLOORS = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0])
"""Values up to which a channel is not suspicious: a standstill has to be likelier than its contrary."""
MOVEMENT_HANDICAPS = np.array([2.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0])
"""Nats of surprise by which a channel stands back behind displacement. What the others are for, a movement that ends elsewhere
or stands still, becomes plain sooner or later; a push passes, and the false alarms that may be had are better spent on it."""
FEEL_HANDICAP = 1.0
"""The same of what learned channels, or sensors of other kinds, say."""
MEMORY = max(int(kind.before.max()) + max(kind.horizons) for kind in EVIDENCE) + 1
"""Ticks that have to be remembered while executing."""

LARGEST_LOG_RATIO = 500.0
WEIGHED = slice(len(MOVEMENT_CHANNELS) - sum(len(kind.horizons) for kind in EVIDENCE), len(MOVEMENT_CHANNELS))
"""The channels that are evidence for one account against another."""
ROUNDING = 1e-12
EVIDENCE_SCALE = 10.0
"""Nats of evidence that multiply the value of a channel by e."""


def channels_for(names: tuple[str, ...]) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Names, floors and handicaps of the channels of a movement with these further ones."""
    floors = np.concatenate([MOVEMENT_FLOORS, np.zeros(len(names))])
    return (*MOVEMENT_CHANNELS, *names), floors, np.concatenate([MOVEMENT_HANDICAPS, np.full(len(names), FEEL_HANDICAP)])


class Horizon(NamedTuple):
    """A channel that asks what has happened since a place some ticks ago."""

    channel: int
    evidence: Evidence
    ticks: int
    """Since the place."""
    offsets: IntArray
    """Ticks of the points that it looks at, relative to the place; the last is now."""

    @property
    def point(self) -> int:
        """The last of them among those after the place."""
        return len(self.offsets) - len(self.evidence.before) - 1


def as_suspicion(evidence: FloatArray) -> FloatArray:
    """Nats of evidence as a positive number with a tail like those of squared distances."""
    suspicion = np.array(evidence)
    np.clip(suspicion, -LARGEST_LOG_RATIO, LARGEST_LOG_RATIO, out=suspicion)
    suspicion /= EVIDENCE_SCALE
    np.exp(suspicion, out=suspicion)
    return suspicion


def as_values(evidence: FloatArray) -> FloatArray:
    """Channels (C, …), of which those that weigh two accounts do so in nats, as positive numbers like the others."""
    values = np.array(evidence)
    values[WEIGHED] = as_suspicion(evidence[WEIGHED])
    return values


def as_value(channel: int, evidence: FloatArray) -> FloatArray:
    """The same of one channel, (…)."""
    return as_suspicion(evidence) if WEIGHED.start <= channel < WEIGHED.stop else evidence


def as_evidence(values: FloatArray) -> FloatArray:
    """The contrary of `as_values`, safely rounded down."""
    evidence = np.array(values)
    with np.errstate(divide="ignore"):
        logarithms = EVIDENCE_SCALE * np.log(np.maximum(values[WEIGHED], 0.0))
    evidence[WEIGHED] = logarithms - ROUNDING * (1 + np.abs(np.nan_to_num(logarithms)))
    return evidence
