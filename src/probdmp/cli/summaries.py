"""What a primitive is, for people and as a JSON object; `fit` and `inspect` say the same."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from probdmp.dmp import Primitive

__all__ = ["by_name", "channel_noise", "common_units", "name_text", "not_scaled", "primitive_summary"]


def primitive_summary(label: str, primitive: "Primitive") -> dict[str, Any]:
    """Durations in seconds, positions and noise in data units, by degree of freedom where they differ."""
    names = primitive.names
    return {
        "label": label,
        "names": list(names),
        "units": primitive.units,
        "demonstrations": primitive.n_demonstrations,
        "duration": primitive.duration,
        "dt": primitive.dt,
        "start": dict(zip(names, primitive.start, strict=True)),
        "goal": dict(zip(names, primitive.goal, strict=True)),
        "sensor_noise_stds": dict(zip(names, primitive.observation_variances**0.5, strict=True)),
        "channels": _channels(primitive),
        "not_scaled": not_scaled(primitive),
        "configuration": asdict(primitive.configuration),
    }


def _channels(primitive: "Primitive") -> dict[str, dict[str, float]]:
    """By name, in the units of each: noise of its sensor, what the movement does not explain of it, mean extent."""
    learned = primitive.channels
    if learned is None:
        return {}
    stds = {"sensor_noise_std": learned.observation_variances**0.5, "residual_std": learned.residual_variances**0.5}
    figures = stds | {"range": learned.ranges}
    return {name: {key: values[i] for key, values in figures.items()} for i, name in enumerate(learned.names)}


def channel_noise(summary: Mapping[str, Any]) -> str:
    """Standard deviation of the sensor of each learned channel, for a column of a table."""
    return by_name({name: figures["sensor_noise_std"] for name, figures in summary["channels"].items()}) or "–"


def not_scaled(primitive: "Primitive") -> list[str]:
    """Degrees of freedom that the paper's scaling leaves out, since the demonstrations hardly move from start to goal."""
    if primitive.configuration.scaling == "none":
        return []
    return [name for name, scaled in zip(primitive.names, primitive.scaled, strict=True) if not scaled]


def by_name(values: Mapping[str, float], width: int = 0) -> str:
    """Numbers with the names they belong to: `x 1.25, y 0.3` if that fits into the width, else one per line."""
    texts = [f"{name} {value:.3g}" for name, value in values.items()]
    line = ", ".join(texts)
    return line if len(line) <= width else "\n".join(texts)


def common_units(summaries: Sequence[Mapping[str, Any]]) -> str:
    """The unit that all primitives share, for headings; nothing if they differ."""
    units = {summary["units"] for summary in summaries}
    return str(units.pop()) if len(units) == 1 else ""


def name_text(label: str) -> str:
    """A label for people; a primitive may have none."""
    return label or "(no label)"
