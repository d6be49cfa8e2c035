"""How speed is measured and shown; no test asks how fast anything is."""

import gc
import time
from collections.abc import Iterator

import numpy as np
import pytest

from probdmp.gaussian import kernels, score_series, shared_gains
from realtime import paced, tended
from speed.interleaving import Times, clocked, interleaved
from speed.machine import CORES, cores, described, in_step, read_all, versions
from speed.page import CAUSES, misses, table, target_lines
from speed.rows import Row, at_least, at_most, duration_text
from speed.twin import Twin
from speed.workload import model_of, recordings_of


@pytest.fixture(scope="module", autouse=True)
def kept_to_the_end() -> Iterator[None]:
    """As before: contestants leave everything to the collector again."""
    yield
    gc.freeze()


def test_contestants_take_turns_and_garbage_waits() -> None:
    order: list[str] = []

    def contestant(name: str) -> object:
        def run(count: int) -> float:
            order.append(name)
            assert not (order.count(name) > 2 and gc.isenabled())
            return 1.0 * count

        return run

    times = interleaved({"a": contestant("a"), "b": contestant("b")}, rounds=4)  # type: ignore[dict-item]
    assert order[-8:] == ["a", "b"] * 4
    assert {name: list(found) for name, found in times.items()} == {"a": [1.0] * 4, "b": [1.0] * 4}
    assert gc.isenabled()


def test_ratios_are_of_the_same_round() -> None:
    times = Times(a=np.array([2.0, 20.0, 200.0]), b=np.array([1.0, 10.0, 100.0]))
    assert times.ratio("a", "b") == 2
    assert times.typical("a") == 20


def test_short_calls_are_repeated() -> None:
    calls = []
    interleaved({"short": clocked(lambda: calls.append(1))}, rounds=2)
    assert len(calls) > 100


def test_a_target_is_met_or_not() -> None:
    times = Times(slow=np.full(3, 1e-3), fast=np.full(3, 1e-5))
    assert at_least("", times, "slow", "fast", 99).met
    assert at_least("", times, "slow", "fast", 101).met is False
    assert at_most("", 1.0, 1.0, "", "").met
    assert at_most("", 1.1, 1.0, "", "").met is False


def test_what_is_not_installed_is_said() -> None:
    row = at_least("name", Times(fast=np.ones(1)), "absent", "fast", 2)
    assert row.met is None
    assert "absent is not installed" in row.detail
    assert "not measured" in table(target_lines([row]))


def test_a_miss_has_its_cause(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [Row("slow thing", "≤ 1 s", "2 s", False), Row("fast thing", "≤ 1 s", "0.5 s", True)]
    assert "slow thing: not looked into." in misses(rows)[1]
    monkeypatch.setitem(CAUSES, "slow", "it loads too much")
    assert misses(rows)[1] == "- slow thing: it loads too much.\n"
    assert misses(rows[1:]) == []


def test_every_line_of_a_table_has_all_columns() -> None:
    rows = [Row("a", "≥ 2×", "3×", True), Row("b", "–", "1 s", None, "once")]
    assert {line.count("|") for line in table(target_lines(rows)).splitlines()} == {6}


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(3.14159e-9, "3.14 ns"), (2.5e-7, "250 ns"), (1.234e-5, "12.3 µs"), (0.0456, "45.6 ms"), (1.5, "1.5 s"), (250.0, "250 s")],
)
def test_durations_have_three_digits(seconds: float, text: str) -> None:
    assert duration_text(seconds) == text


def test_a_late_tick_is_counted_and_a_hopeless_loop_ends() -> None:
    observations = np.zeros((40, 1))
    late = paced(lambda _: time.sleep(0.002), observations, period=0.001)
    assert late.overruns == len(late.seconds) < len(observations)
    early = paced(lambda _: None, observations[:3], period=5.0e-3)
    assert len(early.seconds) == 3


def test_the_collector_is_as_it_was() -> None:
    with tended():
        assert not gc.isenabled()
        assert gc.get_freeze_count() > 0
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0


def test_the_machine_is_described() -> None:
    assert all(line.partition(":")[2].strip() for line in described())
    assert versions()["numpy"] == np.__version__
    with cores(1):
        assert in_step(read_all(np.ones(1000)), 1) > 0
    assert len(CORES) >= 1
    assert read_all(np.full(8, 2.0), 2)() == [16.0, 16.0]


def test_the_twin_is_not_compiled_and_scores_alike() -> None:
    workload = ("letter", 30, 1)
    with Twin() as twin:
        found = twin.score(workload, 5)
        assert twin.clocked(workload, 5)(2) > 0
    model = model_of(*workload)
    np.testing.assert_allclose(found, score_series(shared_gains(model), recordings_of(model, 5)), rtol=1e-12)
    assert isinstance(kernels.COMPILED, bool)
