"""Validation at the boundary: each `check_*` returns the clean value or raises an error that names the offender.

Code behind the boundary assumes what was checked here and checks nothing again.
"""

import math
import sys
from collections.abc import Collection, Sequence
from typing import TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probdmp.errors import InputError, InputTypeError

__all__ = [
    "LARGEST_MAGNITUDE",
    "MILLISECONDS_HINT",
    "SECONDS",
    "BoolArray",
    "FloatArray",
    "check_array",
    "check_choice",
    "check_count",
    "check_fraction",
    "check_generator",
    "check_names",
    "check_noise_stds",
    "check_number",
    "check_positive",
    "check_seconds",
    "freeze_arrays",
    "frozen",
    "is_plain",
    "shape_text",
]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

LARGEST_MAGNITUDE = 1e100
"""Values beyond this are refused: variances square them, and the square must stay finite."""

SECONDS = (1e-9, 1e9)
"""Shortest and longest times: far beyond any movement, and far from where their powers overflow."""

MILLISECONDS_HINT = "A time in milliseconds? Divide it by 1000."


def shape_text(shape: Sequence[int | str | None]) -> str:
    """How a shape is written in messages: `(T, 2)`."""
    inner = ", ".join("any" if n is None else str(n) for n in shape)
    return f"({inner},)" if len(shape) == 1 else f"({inner})"


def check_array(
    value: ArrayLike,
    name: str,
    shape: Sequence[int | str | None],
    *,
    missing: bool = False,
    hint: str = "",
) -> FloatArray:
    """A float64 array of the asked shape, finite and of a size whose square is finite.

    Parameters
    ----------
    shape : one entry per axis: a number for a fixed length, a letter or None for any length.
    missing : whether NaN is allowed, as a mark for "not measured".
    hint : added to the message when the shape is wrong.

    Raises
    ------
    InputTypeError
        If the values are not real numbers.
    InputError
        If the shape differs, a value is NaN (unless `missing`) or infinite, or larger than `LARGEST_MAGNITUDE`.
    """
    # Without numpy.ma loaded there is no masked array, and loading it would double the time that probdmp takes.
    if "numpy.ma" in sys.modules and isinstance(value, np.ma.MaskedArray) and value.dtype.kind in "fiu":
        value = np.ma.filled(value.astype(np.float64), np.nan)
    try:
        raw = np.asarray(value)
    except ValueError as error:
        raise InputError(f"{name} as a rectangular array", "rows of different lengths", hint) from error
    if raw.dtype.kind not in "fiu":
        raise InputTypeError(f"{name} as real numbers", f"dtype {raw.dtype}", "Convert it with numpy.asarray(..., float).")
    array = np.ascontiguousarray(raw, dtype=np.float64).reshape(raw.shape)
    actual: tuple[int, ...] = array.shape
    if len(actual) != len(shape) or any(isinstance(n, int) and n != m for n, m in zip(shape, actual, strict=True)):
        raise InputError(f"{name} of shape {shape_text(shape)}", shape_text(actual), hint)
    if np.abs(array).max(initial=0.0) <= LARGEST_MAGNITUDE:  # NaN is not
        return array
    bad = ~np.isfinite(array)
    if missing:
        bad &= ~np.isnan(array)
    if bad.any():
        first = np.argwhere(bad)[0].tolist()
        raise InputError(
            f"{name} finite" + (" or NaN for 'not measured'" if missing else ""),
            f"{array[tuple(first)]} at index {first} ({int(bad.sum())} such values)",
            "Drop or interpolate these samples first." if not missing else "Replace infinities by NaN.",
        )
    largest = float(np.max(np.abs(array), initial=0.0, where=~np.isnan(array)))
    if largest > LARGEST_MAGNITUDE:
        raise InputError(
            f"{name} of magnitude at most {LARGEST_MAGNITUDE:g}", f"{largest:g}", "Rescale to usual units, such as metres."
        )
    return array


def is_plain(array: object) -> TypeGuard[FloatArray]:
    """Whether kernels take it as it is; they look at its values themselves, which takes long for many, and for few."""
    if not isinstance(array, np.ndarray) or type(array) not in (
        np.ndarray,
        np.memmap,
    ):  # of a masked one, not all numbers count
        return False
    return array.dtype == np.float64 and array.flags.c_contiguous


def freeze_arrays(value: object) -> None:
    """Make the arrays of a dataclass read-only, in place: they are nobody else's yet."""
    for name in getattr(value, "__dataclass_fields__", ()):
        if isinstance(array := getattr(value, name), np.ndarray):
            array.setflags(write=False)


def frozen(array: FloatArray) -> FloatArray:
    """A read-only copy, for the fields of frozen values."""
    copy = np.array(array, dtype=np.float64)
    copy.setflags(write=False)
    return copy


def check_positive(value: object, name: str, unit: str = "", hint: str = "") -> float:
    """A finite number > 0."""
    wanted = f"{name} > 0" + (f" in {unit}" if unit else "")
    number = check_number(value, f"{wanted}, one number", hint)
    if not 0 < number <= LARGEST_MAGNITUDE:
        raise InputError(wanted, repr(value), hint)
    return number


def check_seconds(value: object, name: str) -> float:
    """A time > 0 of a size that a movement can have."""
    shortest, longest = SECONDS
    number = check_positive(value, name, "seconds", MILLISECONDS_HINT)
    if not shortest <= number <= longest:
        raise InputError(f"{name} from {shortest:g} to {longest:g} seconds", repr(value), MILLISECONDS_HINT)
    return number


def check_fraction(value: object, name: str, most: float = 1.0) -> float:
    """A number from 0 to `most`."""
    number = check_number(value, f"{name} as one number from 0 to {most:g}")
    if not 0 <= number <= most:
        raise InputError(f"{name} as a number from 0 to {most:g}", repr(value))
    return number


def check_number(value: object, wanted: str, hint: str = "") -> float:
    """One real number, of Python or NumPy; infinite if a float cannot hold it.

    Parameters
    ----------
    wanted : what was expected, for the message.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating | np.ndarray):
        raise InputTypeError(wanted, f"{value!r:.100}", hint)
    if isinstance(value, np.ndarray) and (value.ndim != 0 or value.dtype.kind not in "fiu"):
        raise InputTypeError(wanted, f"{value!r:.100}", hint)
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def check_count(value: object, name: str, least: int = 1, most: int | None = None, hint: str = "") -> int:
    """A whole number from `least` to `most`."""
    wanted = f"{name} as a whole number from {least}" + (f" to {most}" if most is not None else " up")
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise InputTypeError(wanted, repr(value), hint)
    if value < least or (most is not None and value > most):
        raise InputError(wanted, repr(value), hint)
    return int(value)


def check_noise_stds(stds: ArrayLike, count: int) -> FloatArray:
    """Standard deviations > 0, (count,) array."""
    checked = check_array(stds, "stds", (count,))
    if np.any(checked <= 0):
        raise InputError("stds > 0", f"{checked.min():g}")
    return checked


def check_generator(random_state: "int | np.random.Generator | None") -> "np.random.Generator":
    """Random numbers from a seed, or the generator itself."""
    try:
        return np.random.default_rng(random_state)
    except (TypeError, ValueError) as error:
        raise InputTypeError("random_state as a whole number >= 0 or a Generator", f"{random_state!r:.100}") from error


def check_names(value: object, name: str) -> list[str]:
    """Different names, in a list or tuple."""
    if not isinstance(value, list | tuple) or not all(isinstance(item, str) for item in value):
        hint = f"Write {name}=[{value!r}]." if isinstance(value, str) else ""
        raise InputTypeError(f"{name} as a list of names", f"{value!r:.100}", hint)
    if len(set(value)) < len(value):
        raise InputError(f"different names in {name}", f"{value!r:.100}")
    return list(value)


def check_choice(value: object, name: str, choices: Collection[str], hint: str = "") -> str:
    """One of a fixed set of names."""
    if not isinstance(value, str) or value not in choices:
        raise InputError(f"{name} to be one of {', '.join(map(repr, choices))}", repr(value), hint)
    return value
