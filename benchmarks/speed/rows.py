"""Rows of the table of targets."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from speed.interleaving import Clocked, Times, interleaved

__all__ = ["Row", "Settings", "at_least", "at_most", "duration_text", "missing", "raced", "without_target"]


class Settings(NamedTuple):
    """How much is measured."""

    rounds: int = 15
    loop_seconds: float = 5.0
    """Of each paced loop."""
    fleet: int = 0
    """Executions of the fleet; 0: it is left out."""
    in_memory: int = 200_000
    """Recordings that do not fit into caches."""


class Row(NamedTuple):
    """A target and what was measured."""

    name: str
    target: str
    measured: str
    met: bool | None
    """None: there is no target, or it could not be measured."""
    detail: str = ""


def raced(contestants: Mapping[str, Clocked | None], rounds: int) -> Times:
    """`interleaved`, without those that are not there."""
    return interleaved({name: run for name, run in contestants.items() if run is not None}, rounds)


def at_least(name: str, times: Times, slow: str, fast: str, least: float, per: float = 1.0, of: str = "") -> Row:
    """A speed ratio that should be at least something.

    Parameters
    ----------
    per : into how many parts the times are divided in the detail.
    of : what such a part is.
    """
    target = f"≥ {least:,.0f}×" if least >= 10 else f"≥ {least:g}×"
    if slow not in times or fast not in times:
        return missing(name, target, slow if slow not in times else fast)
    ratio = times.ratio(slow, fast)
    ours, theirs = (duration_text(times.typical(each) / per) for each in (fast, slow))
    return Row(name, target, ratio_text(ratio), ratio >= least, f"{ours} against {theirs}{of and ' per ' + of}")


def at_most(name: str, value: float, most: float, text: str, most_text: str, detail: str = "") -> Row:
    """A number that should be at most something."""
    return Row(name, f"≤ {most_text}", text, bool(value <= most), detail)


def without_target(name: str, measured: str, detail: str = "") -> Row:
    """Something that belongs beside the others."""
    return Row(name, "–", measured, None, detail)


def missing(name: str, target: str, package: str) -> Row:
    """A row that could not be measured here."""
    return Row(name, target, "not measured", None, f"{package} is not installed or could not be imported")


def ratio_text(ratio: float) -> str:
    """Two digits that mean something."""
    return f"{ratio:,.0f}×" if ratio >= 10 else f"{ratio:.2g}×"


def duration_text(seconds: float) -> str:
    """With three digits, in the unit that suits it."""
    for factor, unit in ((1e9, "ns"), (1e6, "µs"), (1e3, "ms")):
        value = seconds * factor
        if value < 999.5:
            return f"{value:.{int(np.clip(2 - np.floor(np.log10(max(value, 1e-3))), 0, 3))}f} {unit}"
    return f"{seconds:.3g} s" if seconds < 100 else f"{seconds:,.0f} s"
