"""Values as the text of a message: the one place where numbers are shortened to what a picture needs."""

import json
from typing import Any

__all__ = ["DIGITS", "text_of"]

DIGITS = 5
"""Of each number: a thousandth of a unit on a canvas of a hundred, as fine as a page reports what is drawn on it."""


def text_of(message: dict[str, Any]) -> str:
    """A message of plain values as JSON.

    Raises
    ------
    ValueError
        If a number in it is not finite.
    """
    return json.dumps(_shortened(message), allow_nan=False, separators=(",", ":"))


def _shortened(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}")
    if isinstance(value, dict):
        return {key: _shortened(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_shortened(item) for item in value]
    return value
