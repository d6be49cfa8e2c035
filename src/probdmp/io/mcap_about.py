"""What an MCAP file of ours says of its demonstration that its messages cannot: label, unit, and dt to the last digit."""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from probdmp.checks import SECONDS, FloatArray
from probdmp.demonstrations import Demonstration
from probdmp.io.ros_messages import Sample

__all__ = ["RECORD", "About", "about_of"]

RECORD = "probdmp"
"""Name of the metadata record."""
ROUNDED = 2e-9
"""Seconds: what times in whole nanoseconds may miss."""


@dataclass(frozen=True, slots=True)
class About:
    """A demonstration without its samples."""

    topic: str
    label: str
    dt: float
    units: str
    names: tuple[str, ...]
    channels: tuple[str, ...]

    @classmethod
    def of(cls, demonstration: Demonstration, topic: str) -> "About":
        """Of a demonstration that is written to a topic."""
        d = demonstration
        return cls(topic, d.label, d.dt, d.units, d.names, tuple(d.channels))

    @property
    def texts(self) -> dict[str, str]:
        """As metadata has it: text by name, each value in JSON."""
        return {key: json.dumps(value) for key, value in asdict(self).items()}

    def sample(self, sample: Sample) -> Sample:
        """A message with those columns only that the demonstration had."""
        columns = {name: sample.columns[name] for name in (*self.names, *self.channels)}
        return Sample(sample.stamp, columns, self.names, dict.fromkeys(self.names, self.units))

    def clock(self, clock: FloatArray) -> FloatArray:
        """Times as they were before they were rounded, (T,) array, seconds; as they are if they are others."""
        exact = self.dt * np.arange(len(clock), dtype=np.float64)
        return exact if np.abs(exact - clock).max(initial=0.0) <= ROUNDED else clock


def about_of(metadata: Iterable[Any], topic: str) -> About | None:
    """What a file says of the demonstration on a topic; None if nothing, or nothing sensible."""
    for record in metadata:
        if record.name != RECORD:
            continue
        try:
            values = {key: json.loads(text) for key, text in record.metadata.items()}
            names, channels = tuple(values.pop("names")), tuple(values.pop("channels"))
            about = About(**values, names=names, channels=channels)
        except (TypeError, ValueError, KeyError):
            return None
        texts = (about.topic, about.label, about.units, *names, *channels)
        sound = all(isinstance(text, str) for text in texts) and isinstance(about.dt, float)
        return about if sound and about.topic == topic and SECONDS[0] <= about.dt <= SECONDS[1] else None
    return None
