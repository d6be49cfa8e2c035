"""Measures feedback, of a displaced robot and of a lagging one, and writes the tables of docs/feedback.md: `make figures`."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from pushed_robot import HELD, LETTERS, Controller, Inferred, coupled, displace, plan_of, position_sensor

from probdmp import ProbabilisticDMP

__all__ = ["write_feedback_tables"]

PAGE = Path(__file__).parent / "feedback.md"
BACK = 0.2
"""Millimetres from the plan that count as back on it."""
NOISE = 0.03
"""Standard deviation of the sensor, mm, where it has noise: that of the recordings."""
SEEDS = 20
SHARES = (1.0, 0.9, 0.5)
"""Of the way to its command that a robot covers in a tick."""


def compared() -> Iterator[list[str]]:
    """The same displacement under several kinds of feedback; and what sensor noise does where there is no displacement."""
    yield ["feedback", "held", "let go", "beyond", "back after", "strays"]
    default, published = ProbabilisticDMP().fit(LETTERS), ProbabilisticDMP.as_published().fit(LETTERS)
    for gain in (-150, -60, 0, 300, 3000):
        name = "none: K_c = 0" if gain == 0 else f"K_c = {gain} / s²".replace("-", "−")
        yield [name, *_measured(default, lambda gain=gain: coupled(default, gain))]
    for std in (None, 0.3, 3.0):
        name = "inferred" if std is None else f"inferred, sensor noise {std:g} mm"
        yield [name, *_measured(default, lambda std=std: Inferred(default, std))]
    yield ["inferred, the paper's model", *_measured(published, lambda: Inferred(published))]


def _measured(dmp: ProbabilisticDMP, controller: Callable[[], Controller]) -> list[str]:
    plan = plan_of(dmp)
    execution = displace(dmp, controller())
    off = (execution.positions - plan.positions)[:, 0]
    gaps = np.abs(execution.commands[:-1, 0, 2] - execution.positions[1:, 0])
    let_go = plan.times[1:] >= HELD[1]
    away = np.flatnonzero(np.abs(off) > BACK)[-1] + 1
    back = f"{plan.times[away] - HELD[1]:.2f} s" if away < len(off) else "not by the end"
    strays = [
        np.abs(displace(dmp, controller(), by=0.0, noise_std=NOISE, seed=seed).positions - plan.positions).max()
        for seed in range(SEEDS)
    ]
    return [
        f"{gaps[~let_go].max():.1f} mm",
        f"{np.abs(execution.efforts[1:, 0][let_go]).max():.0f} mm/s²",
        f"{max(0.0, -off[1:][let_go].min()):.1f} mm",
        back,
        f"{np.mean(strays):.2f} mm",
    ]


def lagging() -> Iterator[list[str]]:
    """How far from the plan a robot gets that covers only a share of the way to its command in each tick."""
    yield ["covers of the way, each tick", *(f"{100 * share:.0f} %" for share in SHARES)]
    dmp = ProbabilisticDMP().fit(LETTERS)
    for std in (None, 0.3, 3.0):
        name = "feedback, sensor noise " + ("as learned" if std is None else f"{std:g} mm")
        yield [name, *(_lag(dmp, share, std, None) for share in SHARES)]
    yield ["`feedback=[]`", *(_lag(dmp, share, None, []) for share in SHARES)]


def _lag(dmp: ProbabilisticDMP, share: float, std: float | None, feedback: list[str] | None) -> str:
    plan, told = plan_of(dmp), {"start": dmp.primitive_.start, "goal": dmp.primitive_.goal}
    run = dmp.execute(**told, sensors=position_sensor(dmp, std), feedback=feedback)
    rng, robot, off = np.random.default_rng(0), plan.positions[0], []
    for planned in plan.positions:
        off.append(np.abs(robot - planned).max())
        robot = robot + share * (run.step(robot + NOISE * rng.standard_normal(2)).position - robot)
    return f"{max(off):.1f} mm"


def write_feedback_tables() -> None:
    """Replace them in the page."""
    page = PAGE.read_text()
    for name, rows in (("compared", compared()), ("lagging", lagging())):
        lines = ["| " + " | ".join(row) + " |" for row in rows]
        body = "\n".join([lines[0], "|" + "---|" * lines[0].count(" | ") + "---|", *lines[1:]])
        pattern = rf"(<!-- table: {name}, written by make figures -->\n).*?(<!-- end -->)"
        page, count = re.subn(pattern, lambda found, body=body: f"{found[1]}{body}\n{found[2]}", page, flags=re.S)
        assert count == 1, name
    PAGE.write_text(page)


if __name__ == "__main__":
    write_feedback_tables()
