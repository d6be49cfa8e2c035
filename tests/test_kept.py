"""What is kept is found again, by any thread, and there is no more of it than there is room for."""

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

from probdmp.kept import Kept


class Value(NamedTuple):
    key: int
    n_bytes: int


def test_a_value_is_computed_once():
    kept: Kept[Value] = Kept(100)
    first = kept.get(1, lambda: Value(1, 10))
    assert kept.get(1, lambda: Value(2, 10)) is first


def test_those_asked_for_last_stay():
    kept: Kept[Value] = Kept(30)
    values = {key: kept.get(key, lambda key=key: Value(key, 10)) for key in (1, 2, 3)}
    assert kept.get(1, lambda: Value(0, 10)) is values[1]
    kept.get(4, lambda: Value(4, 10))  # there is no room for all: 2 was asked for before the others
    assert kept.get(1, lambda: Value(0, 10)) is values[1]
    assert kept.get(2, lambda: Value(0, 10)) is not values[2]


def test_one_that_is_too_large_is_kept_alone():
    kept: Kept[Value] = Kept(30)
    kept.get(1, lambda: Value(1, 10))
    large = kept.get(2, lambda: Value(2, 1000))
    assert kept.get(2, lambda: Value(0, 1000)) is large


def test_threads_get_the_value_of_their_key():
    kept: Kept[Value] = Kept(50)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda i: kept.get(i % 9, lambda: Value(i % 9, 10)).key, range(2000)))
    assert found == [i % 9 for i in range(2000)]
