"""docs/benchmarks.md."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from speed.agreement import TOLERANCE, Agreement
from speed.causes import CAUSES
from speed.filter_rows import COUNTS, ENOUGH, ScoringTimes
from speed.machine import described, versions
from speed.rows import Row, Settings
from speed.workload import N_STEPS

__all__ = ["Findings", "misses", "page_text", "table", "target_lines"]

MARKS = {True: "yes", False: "**no**", None: "–"}
HEAD = """# Speed, measured

Written by `make bench`, in one run: what is compared takes turns, each turn lasts at least 4 ms, on the last core of the
machine, in double precision, and what is shown is the median over {rounds} rounds; ratios are medians of the ratios within a
round. [benchmarks/README.md](../benchmarks/README.md) says how to run it and what each package is given.
"""
AGREEMENT = """## The same numbers first

Everyone gets the same system (the built-in letter "a", x: 3 states, driven, process noise of rank one that depends on time,
{n_steps} samples) and simulated recordings of it, and is compared with `filter_sequence` and `smooth_sequence` of
`probdmp.gaussian`: the largest relative deviation of a log-likelihood, and the largest of a smoothed mean or covariance, in
standard deviations of the movement without observations. Within {tolerance:g} counts as equal.
"""
SCORING = """## Filter and log-likelihood of N recordings

Nanoseconds per series and step, on one core. {slow} go through the series one by one and got at most {few} of them.
"""
PICTURE = """![Cost against N, T and D](images/benchmarks.png)

*Cost of a step against the number of series N, of samples T and of degrees of freedom D; the last of online steps.*
"""
REAL_TIME = """## Real time

[benchmarks/realtime.py](../benchmarks/realtime.py) calls `step()` of an execution once every millisecond, on one core that is
not reserved, with an ordinary scheduler: how long the calls take, and how many ticks were not done when the next was due. The
7 degrees of freedom are a built-in movement of seven joints, the 30 all built-in arm movements at once. Collector off is the
recipe for a loop with deadlines: stay on one core, load everything, then `gc.collect()`, `gc.freeze()`, `gc.disable()`, and
call `step` a few times before it counts.
"""


class Findings(NamedTuple):
    """All that was measured."""

    rows: Sequence[Row]
    agreements: Sequence[Agreement]
    scoring: dict[int, ScoringTimes]
    real_time: Sequence[Sequence[str]]
    """With the names of the columns first."""


def table(rows: Iterable[Sequence[str]]) -> str:
    """Markdown; the first row has the names of the columns."""
    first, *others = ["| " + " | ".join(row) + " |" for row in rows]
    n_columns = first.count(" | ") + 1
    return "\n".join([first, "|" + "---|" * n_columns, *others]) + "\n"


def target_lines(rows: Iterable[Row]) -> list[list[str]]:
    """The table of targets."""
    names = ["", "target", "measured", "met", "times"]
    return [names, *([row.name, row.target, row.measured, MARKS[row.met], row.detail] for row in rows)]


def misses(rows: Iterable[Row]) -> list[str]:
    """A list of the targets that are missed and why; nothing if there are none."""
    missed = [row.name for row in rows if row.met is False]
    if not missed:
        return []
    causes = [next((why for begins, why in CAUSES.items() if name.startswith(begins)), "not looked into") for name in missed]
    lines = [f"- {name}: {why}." for name, why in zip(missed, causes, strict=True)]
    return ["Missed, and why:\n", "\n".join(lines) + "\n"]


def agreement_lines(agreements: Iterable[Agreement]) -> list[list[str]]:
    """Who computes the same."""
    lines = [["", "log-likelihoods", "smoothed states", "equal", ""]]
    for found in agreements:
        numbers = ["–" if value is None else f"{value:.0e}" for value in (found.scores, found.states)]
        lines.append([found.name, *numbers, MARKS[found.within], found.remark])
    return lines


def scoring_lines(scoring: dict[int, ScoringTimes]) -> list[list[str]]:
    """By N, everyone that could be measured."""
    lines = [["", *(f"N = {n:,}" for n in scoring)]]
    for name in scoring[COUNTS[0]].times if scoring else ():
        seconds = [times.per_step(name) for times in scoring.values()]
        lines.append([name, *("–" if value is None else f"{1e9 * value:,.3g}" for value in seconds)])
    return lines


def page_text(findings: Findings, settings: Settings) -> str:
    """The whole page."""
    packages = ", ".join(f"{name} {number}" for name, number in versions().items())
    machine = [*described(), f"Packages: {packages}"]
    n_missed = sum(row.met is False for row in findings.rows)
    n_targets = sum(row.met is not None for row in findings.rows)
    few = max(ENOUGH.values())
    parts = [
        HEAD.format(rounds=settings.rounds),
        "\n".join(f"- {line}" for line in machine) + "\n",
        f"## Targets: {n_targets - n_missed} of {n_targets} met\n",
        table(target_lines(findings.rows)),
        *misses(findings.rows),
        AGREEMENT.format(n_steps=N_STEPS, tolerance=TOLERANCE),
        table(agreement_lines(findings.agreements)),
        SCORING.format(slow=", ".join(ENOUGH), few=few),
        table(scoring_lines(findings.scoring)),
        PICTURE,
        REAL_TIME,
        table(findings.real_time),
    ]
    return "\n".join(parts)
