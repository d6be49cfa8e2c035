"""JSON of which every value has exactly one spelling, so that no byte of it can change unnoticed."""

import json
from typing import Any

__all__ = ["dump_json", "parse_json"]


def dump_json(value: Any, sort_keys: bool = True) -> str:
    """The one spelling: ASCII, no spaces, no NaN, shortest exact numbers; keys sorted, or as they come.

    Raises
    ------
    TypeError, ValueError, RecursionError
        If the value is not plain, not finite, or nested too deeply.
    """
    return json.dumps(value, sort_keys=sort_keys, separators=(",", ":"), allow_nan=False)


def parse_json(text: str, sort_keys: bool = True) -> Any:
    """The value of a text that `dump_json` wrote.

    Raises
    ------
    ValueError
        If it is not JSON, nested too deeply, or spelled otherwise: repeated keys, spaces, NaN.
    """
    try:
        value = json.loads(text)
        canonical = dump_json(value, sort_keys)
    except RecursionError as error:
        raise ValueError("JSON that is nested too deeply") from error
    if canonical != text:
        raise ValueError("JSON that is not in canonical form")
    return value
