"""What a model file holds, as values."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from datetime import UTC, datetime
from types import MappingProxyType
from typing import Any

from probdmp import __version__
from probdmp.dmp import Primitive
from probdmp.errors import InputError, InputTypeError
from probdmp.io.canonical_json import dump_json

__all__ = ["ModelContents", "provenance_here"]


def provenance_here() -> dict[str, str]:
    """The version of probdmp and the time, UTC."""
    return {"probdmp": __version__, "created": datetime.now(UTC).isoformat(timespec="seconds")}


@dataclass(frozen=True, slots=True, eq=False)
class ModelContents:
    """Labelled primitives, how they were learned, and the detector that was calibrated on them.

    Raises
    ------
    InputError, InputTypeError
        If there is no primitive, a label is not text, or the rest is not plain JSON.
    """

    primitives: Mapping[str, Primitive]
    """By label; a single primitive may have the label ""."""
    settings: Mapping[str, Any]
    """By label, constructor arguments of the estimator: numbers, text, booleans, None, and lists and dicts of these."""
    detector: Mapping[str, Any] | None = None
    """State of the detector, of the same kinds."""
    provenance: Mapping[str, str] = field(default_factory=provenance_here)
    """Where the model comes from; unless given, the version of probdmp and the time, UTC; perhaps the `"command"`."""

    def __post_init__(self) -> None:
        for name in (own.name for own in fields(self)):
            value = getattr(self, name)
            if name == "detector" and value is None:
                continue
            if not isinstance(value, Mapping):
                raise InputTypeError(f"{name} as a mapping", type(value).__name__)
            _check_plain(dict.fromkeys(value) if name == "primitives" else dict(value), name)
            object.__setattr__(self, name, MappingProxyType(dict(value)))
        if not self.primitives:
            raise InputError("at least one primitive", "none")
        for kind, mapping in ((Primitive, self.primitives), (str, self.provenance)):
            for key, value in mapping.items():
                if not isinstance(value, kind):
                    raise InputTypeError(f"{key!r:.100} as {kind.__name__}", type(value).__name__)


def _check_plain(value: dict[str, Any], name: str) -> None:
    """Refuse what JSON cannot hold or would give back as something else, such as tuples and keys that are numbers."""
    expected, hint = f"{name} as plain JSON", "Use finite numbers, text, booleans, None, lists, and dicts with text keys."
    try:
        restored = json.loads(dump_json(value))
    except (TypeError, ValueError, RecursionError) as error:
        raise InputTypeError(expected, str(error), hint) from error
    if restored != value:
        raise InputTypeError(expected, f"{value!r:.200}", hint)
