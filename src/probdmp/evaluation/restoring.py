"""Frozen values from plain ones, by their annotations: the way back from `dataclasses.asdict` and JSON."""

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, get_args, get_origin, get_type_hints

__all__ = ["restored"]


def restored(kind: Any, value: Any) -> Any:
    """A value of a kind: a dataclass, str, int, float, tuple[X, ...], Mapping[K, X], or one of these | None.

    A float may be null, which is NaN, and a key in text; nothing else is converted.

    Raises
    ------
    TypeError, ValueError
        If the value is of another kind.
    """
    if isinstance(kind, UnionType):
        (inner,) = [one for one in get_args(kind) if one is not NoneType]
        return None if value is None else restored(inner, value)
    if is_dataclass(kind):
        return _dataclass(kind, value)
    if get_origin(kind) is tuple:
        return tuple(restored(get_args(kind)[0], item) for item in _checked(list, value))
    if get_origin(kind) is Mapping:
        key_kind, item_kind = get_args(kind)
        return {key_kind(key): restored(item_kind, item) for key, item in _checked(dict, value).items()}
    if kind is float:
        return math.nan if value is None else float(_checked(float | int, value))
    return _checked(kind, value)


def _dataclass(kind: Any, value: Any) -> Any:
    hints, given = get_type_hints(kind), _checked(dict, value)
    names = {field.name for field in fields(kind)}
    if not given.keys() <= names:
        raise ValueError(f"{kind.__name__} has no {', '.join(map(repr, sorted(given.keys() - names)))}")
    return kind(**{name: restored(hints[name], item) for name, item in given.items()})


def _checked(kind: Any, value: Any) -> Any:
    if not isinstance(value, kind) or isinstance(value, bool):
        raise TypeError(f"{value!r:.60} where {getattr(kind, '__name__', kind)} belongs")
    return value
