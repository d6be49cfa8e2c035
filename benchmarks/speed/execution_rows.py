"""Online steps and rollouts, through the public interface."""

import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np

from peers.system import Stepper, System, systems_of
from probdmp import ProbabilisticDMP
from probdmp.checks import FloatArray
from probdmp.execution import SensorArray
from probdmp.execution.step_filters import PlainFilter, step_filter
from realtime import tended
from speed.agreement import Agreement, imported
from speed.interleaving import Clocked, clocked
from speed.rows import Row, Settings, at_least, duration_text, raced, ratio_text, without_target
from speed.workload import N_STEPS, UNCERTAINTIES, learned, model_of, recordings_of, task_of

__all__ = ["STEPPED", "execution_rows", "our_stepper", "peer_stepped", "rollout_rows", "step_agreements", "stepped"]

STEPPED = ("filterpy", "simdkalman")
FILTER = "the filter alone"
N_BASIS = 30
WARM, TICKS = 200, 5_000
MOST_SECONDS = 20.0
"""After which no more ticks are asked of an execution."""


def our_stepper(movement: str, uncertainty: str = "independent", n_steps: int = N_STEPS) -> Callable[[FloatArray], Any]:
    """`step` of an execution of a movement as learned, from a known start, in so many ticks."""
    dmp, _ = learned(movement, uncertainty)
    task = task_of(dmp)
    dt = float(task.duration) / (n_steps - 1)
    return dmp.execute(start=task.start, goal=task.goal, duration=float(task.duration), dt=dt).step


def filter_stepper(movement: str) -> Callable[[FloatArray], Any]:
    """The same without what `step` does beside filtering: a tick with its log-likelihood is all that comes of it."""
    dmp, _ = learned(movement)
    primitive, task = dmp.primitive_, task_of(dmp)
    dt = float(task.duration) / (N_STEPS - 1)
    filtering = step_filter(primitive, task, dt, N_STEPS, SensorArray(primitive))
    assert isinstance(filtering, PlainFilter), "its sensors are those of the paper"
    return filtering.take


def stepped(begin: Callable[[], Callable[[FloatArray], object]], observations: FloatArray) -> Clocked:
    """Whole executions of observations (T, D), without beginning them and taking these apart; seconds of a tick."""
    readings = list(observations)

    def run(count: int) -> float:
        total = 0.0
        for _ in range(count):
            step = begin()
            began = time.perf_counter()
            for reading in readings:
                step(reading)
            total += time.perf_counter() - began
        return total

    return run


def step_agreements() -> Iterator[Agreement]:
    """Log-likelihoods of an execution of 7 degrees of freedom, step by step, of the packages that are stepped."""
    model = model_of("arm")
    observations = recordings_of(model, 1)[0]
    ours = our_stepper("arm")
    expected = np.array([ours(observation).log_likelihood for observation in observations])
    for name in STEPPED:
        module = imported(name)
        if module is not None:
            theirs: Stepper = module.stepper(systems_of(model))
            found = np.array([theirs.step(observation) for observation in observations])
            worst = float(np.max(np.abs(found - expected) / np.maximum(np.abs(expected), 1.0)))
            yield Agreement(f"{name}, against `step()`, 7 degrees of freedom", worst, None)


def execution_rows(settings: Settings) -> Iterator[Row]:
    """One tick, with its log-likelihood."""
    model = model_of("arm")
    systems, observations = systems_of(model), recordings_of(model, 1)[0]
    times = raced(
        {
            "probdmp": stepped(partial(our_stepper, "arm"), observations),
            FILTER: stepped(partial(filter_stepper, "arm"), observations),
            **{name: peer_stepped(name, systems, observations) for name in STEPPED},
        },
        settings.rounds,
    )
    for name, least in (("filterpy", 2000), ("simdkalman", 100)):
        yield at_least(f"online step, 7 degrees of freedom, against {name}", times, name, "probdmp", least, N_STEPS, "step")
        if name in times:
            ratio, took = ratio_text(times.ratio(name, FILTER)), duration_text(times.typical(FILTER) / N_STEPS)
            yield without_target(f"the same, {FILTER}, against {name}", ratio, f"{took} per step")
    for uncertainty, whose in UNCERTAINTIES.items():
        seconds = _each_tick(uncertainty)
        median, late = np.quantile(seconds, [0.5, 0.99])
        yield Row(
            f"online step, 30 degrees of freedom, `{uncertainty}` weights ({whose}): median, p99",
            "≤ 5 µs, ≤ 20 µs",
            f"{duration_text(median)}, {duration_text(late)}",
            bool(median <= 5e-6 and late <= 20e-6),
            f"{len(seconds):,} calls of `step()` on end, garbage collector off; worst {duration_text(seconds.max())}",
        )


def rollout_rows(settings: Settings) -> Iterator[Row]:
    """Rolling out 200 samples of 7 degrees of freedom, to a new goal each time; only this library's have an uncertainty."""
    demonstration = learned("arm")[1][0]
    contestants: dict[str, Clocked | None] = {
        f"probdmp, {uncertainty}": clocked(_to_new_goals(learned("arm", uncertainty)[0])) for uncertainty in UNCERTAINTIES
    }
    errors = []
    for name in ("movement_primitives", "pydmps"):
        peer = imported(name)
        call = None if peer is None else peer.rollout_call(demonstration.positions, demonstration.dt, N_BASIS)
        contestants[name] = None if call is None else clocked(call)
        if call is not None:
            errors.append(f"{name} {_error(call(), demonstration.positions):.2f} %")
    times = raced(contestants, settings.rounds)
    for uncertainty, whose in UNCERTAINTIES.items():
        for name, least in (("movement_primitives", 50), ("pydmps", 200)):
            title = f"rollout 200 × 7, `{uncertainty}` weights ({whose}), against {name}"
            yield at_least(title, times, name, f"probdmp, {uncertainty}", least)
    ours = ProbabilisticDMP().fit([demonstration]).rollout(demonstration.positions[0], demonstration.positions[-1])
    errors.insert(0, f"probdmp {_error(ours.positions, demonstration.positions):.2f} %")
    yield without_target("rollout: rms distance from the one demonstration it was taught", ", ".join(errors), "of its range")


def peer_stepped(name: str, systems: list[System], observations: FloatArray) -> Clocked | None:
    """A package's filter of independent systems, tick by tick; None if it is not installed."""
    module = imported(name)
    return None if module is None else stepped(lambda: module.stepper(systems).step, observations)


def _to_new_goals(dmp: ProbabilisticDMP) -> Callable[[], object]:
    """Rollouts of the learned duration and step, of which what does not depend on the goal is kept after the first."""
    primitive, rng = dmp.primitive_, np.random.default_rng(0)
    goals = cycle(primitive.goal + 0.1 * primitive.ranges * rng.standard_normal((100, primitive.n_dof)))
    return lambda: dmp.rollout(goal=next(goals))


def _each_tick(uncertainty: str) -> FloatArray:
    """Seconds of each call, of which there are at most `TICKS`."""
    observations = recordings_of(model_of("body", TICKS + WARM), 1)[0]
    step = our_stepper("body", uncertainty, TICKS + WARM)
    seconds = np.empty(len(observations))
    with tended():
        limit = time.perf_counter() + MOST_SECONDS
        for k, observation in enumerate(observations):
            began = time.perf_counter()
            step(observation)
            seconds[k] = time.perf_counter() - began
            if began > limit and k > 2 * WARM:
                break
    return seconds[WARM : k + 1]


def _error(path: FloatArray, demonstrated: FloatArray) -> float:
    """Root of the mean squared distance, % of the range of each degree of freedom."""
    n = min(len(path), len(demonstrated))
    return float(100 * np.sqrt(np.mean(((path[:n] - demonstrated[:n]) / np.ptp(demonstrated, axis=0)) ** 2)))
