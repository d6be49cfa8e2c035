"""Writes docs/benchmarks.md and its picture: this library against others, this machine and targets. `make bench`.

It wants a machine that does nothing else. To try it out, without writing:

    python benchmarks/speed_tables.py --quick --dry --only rollout
"""

import argparse
import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy is loaded: what is compared has one core

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TypeVar

from realtime import COLUMNS, loops, measured, row_of
from speed.agreement import Agreement, agreements
from speed.batch_rows import batch_rows
from speed.execution_rows import execution_rows, rollout_rows, step_agreements
from speed.filter_rows import ScoringTimes, filter_rows, memory_rows, scoring_times
from speed.fleet_rows import fleet_rows
from speed.learning_rows import calibration_rows, learning_rows
from speed.machine import cores
from speed.page import Findings, page_text
from speed.picture import draw_costs, measured_costs
from speed.rows import Row, Settings
from speed.startup_rows import startup_rows
from speed.twin import Twin

DOCS = Path(__file__).parent.parent / "docs"
PAGE, PICTURE = DOCS / "benchmarks.md", DOCS / "images" / "benchmarks.png"
QUICK = Settings(rounds=3, loop_seconds=0.5, in_memory=50_000)
ROWS: dict[str, Callable[[Settings], Iterator[Row]]] = {
    "memory": memory_rows,
    "batch": batch_rows,
    "step": execution_rows,
    "rollout": rollout_rows,
    "learning": learning_rows,
    "calibration": calibration_rows,
    "startup": startup_rows,
    "fleet": fleet_rows,
}
"""Groups of rows beside those about scoring, which are measured with the table of scoring times."""
Found = TypeVar("Found")
PARTS = ("agreement", "scoring", *ROWS, "realtime", "picture")


def main() -> None:
    """Everything, or what is asked for."""
    parser = argparse.ArgumentParser(description="Measure speed.")
    parser.add_argument("--quick", action="store_true", help="few rounds and short loops: such numbers say little")
    parser.add_argument("--dry", action="store_true", help="print the page and leave the file as it is")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS, help="parts; implies --dry")
    parser.add_argument("--fleet", type=int, default=0, metavar="N", help="executions of the fleet; 0: without it")
    given = parser.parse_args()
    settings = (QUICK if given.quick else Settings())._replace(fleet=given.fleet)
    is_whole = set(given.only) == set(PARTS) and not given.dry
    with cores(1), Twin() as twin:
        text = page_text(_findings(twin, settings, given.only), settings)
        print(text)
        if is_whole:
            PAGE.write_text(text)
        if "picture" in given.only:
            path = PICTURE if is_whole else Path("build") / PICTURE.name
            path.parent.mkdir(exist_ok=True)
            draw_costs(_timed("picture", lambda: measured_costs(twin, max(3, settings.rounds // 3))), path)


def _findings(twin: Twin, settings: Settings, parts: list[str]) -> Findings:
    agreed: list[Agreement] = []
    scoring: dict[int, ScoringTimes] = {}
    rows: list[Row] = []
    if "agreement" in parts:
        agreed = _timed("agreement", lambda: [*agreements(twin), *step_agreements()])
    if "scoring" in parts:
        scoring = _timed("scoring", lambda: scoring_times(twin, settings.rounds))
        rows += _timed("smoothing", lambda: list(filter_rows(scoring, settings)))
    for name, measure in ROWS.items():
        if name in parts:
            rows += _timed(name, partial(_listed, measure, settings))
    real_time = [list(COLUMNS)]
    if "realtime" in parts:
        real_time += _timed("realtime", lambda: [row_of(loop, measured(loop, settings.loop_seconds)) for loop in loops()])
    return Findings(rows, agreed, scoring, real_time)


def _listed(measure: Callable[[Settings], Iterator[Row]], settings: Settings) -> list[Row]:
    return list(measure(settings))


def _timed(name: str, work: Callable[[], Found]) -> Found:
    """Say how long a part took."""
    began = time.perf_counter()
    found = work()
    print(f"{name}: {time.perf_counter() - began:.0f} s", file=sys.stderr, flush=True)
    return found


if __name__ == "__main__":
    main()
