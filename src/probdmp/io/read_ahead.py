"""Reading what comes next while what came before is in use."""

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

__all__ = ["read_ahead"]

Item = TypeVar("Item")


def read_ahead(items: Iterator[Item]) -> Iterator[Item]:
    """The items, the next of which is made in another thread while one is in use."""
    end = object()
    with ThreadPoolExecutor(1) as reader:
        upcoming: Future[Any] = reader.submit(next, items, end)
        while (item := upcoming.result()) is not end:
            upcoming = reader.submit(next, items, end)
            yield item
