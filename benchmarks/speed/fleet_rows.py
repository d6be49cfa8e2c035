"""Executions of a fleet, from Parquet, on two cores: benchmarks/fleet_scoring.py in a process of its own."""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from speed.machine import cores, multiplied
from speed.rows import Row, Settings, duration_text

__all__ = ["fleet_rows"]

PROGRAM = Path(__file__).parent.parent / "fleet_scoring.py"
TARGET_COUNT = 1_000_000


def fleet_rows(settings: Settings) -> Iterator[Row]:
    """As `probdmp score` does it unless told otherwise, in the time and the memory that the program prints."""
    count = settings.fleet or TARGET_COUNT
    name, target = f"fleet: {count:,} executions × 200 × 2 from Parquet, 2 cores", "≤ 60 s, ≤ 1 GB"
    if not settings.fleet or not PROGRAM.exists():
        yield Row(name, target, "not measured", None, "not asked for" if PROGRAM.exists() else f"there is no {PROGRAM.name}")
        return
    with cores(2):
        command = [sys.executable, str(PROGRAM), str(count)]
        before = multiplied(), multiplied(2)
        ended = subprocess.run(command, check=False, capture_output=True, text=True)
        after = multiplied(), multiplied(2)
    if ended.returncode != 0:
        yield Row(name, target, "failed", False, ended.stderr.strip().splitlines()[-1][:200])
        return
    seconds, megabytes = (float(re.findall(rf"([\d.]+) {unit}\b", ended.stdout)[0]) for unit in ("s", "MB"))
    met = (seconds <= 60 and megabytes <= 1000) if count == TARGET_COUNT else None
    yield Row(name, target, f"{duration_text(seconds)}, {megabytes:,.0f} MB", met, _speed_text(before, after))


def _speed_text(before: tuple[float, float], after: tuple[float, float]) -> str:
    """Seconds are those of a machine whose cores were so fast, one of them alone and both at once."""
    alone, both = (f"{then / 1e9:.0f} and {later / 1e9:.0f}" for then, later in zip(before, after, strict=True))
    return f"a core did {alone} billion multiply-adds a second before and after, beside the other one {both}"
