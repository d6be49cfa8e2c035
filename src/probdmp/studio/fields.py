"""Fields of messages from a page, checked; the page may be anybody's."""

import math
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from probdmp.checks import FloatArray, check_choice, check_count, check_number
from probdmp.errors import InputError, InputTypeError
from probdmp.studio.limits import LONGEST_NAME, MOST_POINTS

__all__ = ["FARTHEST", "choice_of", "name_of", "number_of", "optional_name_of", "optional_point_of", "place_of", "points_of"]

FARTHEST = 1e7
"""Units, in whichever a movement is kept."""


def name_of(message: Mapping[str, Any], field: str = "label") -> str:
    """A name: text to be shown as text, of a length that fits."""
    value = message.get(field)
    if not isinstance(value, str):
        raise InputTypeError(f"{field} as text", f"{value!r:.100}")
    name = value.strip()
    if not 0 < len(name) <= LONGEST_NAME or not name.isprintable():
        hint = "Letters, digits, signs and spaces."
        raise InputError(f"{field} of 1 to {LONGEST_NAME} characters that can be printed", f"{value!r:.100}", hint)
    return name


def optional_name_of(message: Mapping[str, Any], field: str = "label") -> str | None:
    """A name, or None."""
    return None if message.get(field) is None else name_of(message, field)


def number_of(message: Mapping[str, Any], field: str, least: float, most: float, default: float | None = None) -> float:
    """A number within bounds."""
    value = message.get(field, default)
    wanted = f"{field} as a number from {least:g} to {most:g}"
    number = check_number(value, wanted)
    if not least <= number <= most:
        raise InputError(wanted, f"{value!r:.50}")
    return number


def place_of(message: Mapping[str, Any], field: str, count: int) -> int:
    """A place in a list of so many."""
    return check_count(message.get(field), f"{field}, one of {count}", least=0, most=count - 1)


def choice_of(message: Mapping[str, Any], field: str, choices: Collection[str]) -> str:
    """One of a few names."""
    return check_choice(message.get(field), field, choices)


def optional_point_of(message: Mapping[str, Any], field: str) -> FloatArray | None:
    """A point [x, y] on or near the canvas, (2,) array, or None."""
    value = message.get(field)
    return None if value is None else _table([value], field, 2)[0]


def points_of(message: Mapping[str, Any], field: str = "points", columns: int = 4, least: int = 1) -> FloatArray:
    """Rows of numbers, (n, columns) array; null is NaN, in the last of four columns only, the pressure."""
    value = message.get(field)
    if not isinstance(value, list):
        raise InputTypeError(f"{field} as a list", f"{value!r:.100}")
    if not least <= len(value) <= MOST_POINTS:
        raise InputError(f"{field} with {least} to {MOST_POINTS} points", f"{len(value)}")
    return _table(value, field, columns)


def _table(rows: list[Any], field: str, columns: int) -> FloatArray:
    """Numbers that are finite and not absurd."""
    wanted = f"{field} of {columns} numbers each"
    for row in rows:
        if not isinstance(row, list) or len(row) != columns:
            raise InputTypeError(wanted, f"{row!r:.100}")
        for k, value in enumerate(row):
            absent = value is None and k == 3
            if not absent and (isinstance(value, bool) or not isinstance(value, int | float)):
                raise InputTypeError(wanted, f"{value!r:.100}")
            if not absent and not (abs(value) <= FARTHEST and math.isfinite(value)):
                raise InputError(f"{field} of numbers up to {FARTHEST:g}", f"{value!r:.50}")
    return np.array([[np.nan if value is None else value for value in row] for row in rows], dtype=np.float64)
