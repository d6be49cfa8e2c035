"""What is costly to compute and was asked for lately, as long as there is room for it."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Generic, Protocol, TypeVar

__all__ = ["Kept"]


class Sized(Protocol):
    """What says how much memory it takes."""

    @property
    def n_bytes(self) -> int: ...


Value = TypeVar("Value", bound=Sized)


class Kept(Generic[Value]):
    """Values by key, those asked for last; any thread may ask.

    Parameters
    ----------
    most_bytes : of all values together; the last one is kept whatever its size.
    """

    def __init__(self, most_bytes: int) -> None:
        self._most_bytes, self._lock = most_bytes, Lock()
        self._values: OrderedDict[Hashable, Value] = OrderedDict()

    def get(self, key: Hashable, compute: Callable[[], Value]) -> Value:
        """The value of a key, computed where it is not there."""
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
                return self._values[key]
        value = compute()
        with self._lock:
            self._values[key] = value
            while len(self._values) > 1 and sum(kept.n_bytes for kept in self._values.values()) > self._most_bytes:
                self._values.popitem(last=False)
        return value
