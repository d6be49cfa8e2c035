"""Filter, log-likelihood and smoother over recordings: against other packages, against memory, over threads."""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from peers.system import systems_of
from probdmp.gaussian import score_series, shared_gains, smooth_series
from speed.agreement import FILTERS, imported
from speed.interleaving import Clocked, Times, clocked, interleaved
from speed.machine import cores, empty_call, read_all
from speed.rows import Row, Settings, at_least, at_most, duration_text, missing, raced, ratio_text, without_target
from speed.twin import Twin
from speed.workload import N_STEPS, model_of, recordings_of

__all__ = ["COUNTS", "OURS", "TWIN", "ScoringTimes", "filter_rows", "memory_rows", "score_contestants", "scoring_times"]

OURS, TWIN = "probdmp", "probdmp, NumPy twin"
COUNTS = (1, 100, 10_000)
"""N, series that are scored at once."""
ENOUGH = {"statsmodels": 20, "filterpy": 1, "pykalman": 1}
"""Series after which those that go through them one by one are stopped: the others would take as long."""
SERIES_STEP = "series and step"


class ScoringTimes(NamedTuple):
    """How long everyone takes to score N series."""

    times: Times
    series: dict[str, int]
    """How many each did score."""

    def per_step(self, name: str) -> float | None:
        """Seconds per series and step; None for what is not there."""
        return self.times.typical(name) / (self.series[name] * N_STEPS) if name in self.times else None


def score_contestants(
    workload: tuple[str, int, int], n_series: int, twin: Twin, ours_only: bool = False
) -> dict[str, Clocked | None]:
    """This library, its twin, and every package; those of `ENOUGH` score fewer series.

    Parameters
    ----------
    workload : arguments of `model_of`; packages are given models of one degree of freedom.
    """
    model = model_of(*workload)
    gains, recordings = shared_gains(model), recordings_of(model, n_series)
    found: dict[str, Clocked | None] = {
        OURS: clocked(partial(score_series, gains, recordings)),
        TWIN: twin.clocked(workload, n_series),
    }
    if ours_only:
        return found
    (system,) = systems_of(model)
    for name in FILTERS:
        module = imported(name)
        some = np.ascontiguousarray(recordings[: ENOUGH.get(name, n_series), :, 0])
        found[name] = None if module is None else clocked(module.score_call(system, some))
    return found


def scoring_times(twin: Twin, rounds: int) -> dict[int, ScoringTimes]:
    """By N."""
    found = {}
    for n_series in COUNTS:
        times = raced(score_contestants(("letter", N_STEPS, 1), n_series, twin), rounds)
        found[n_series] = ScoringTimes(times, {name: min(n_series, ENOUGH.get(name, n_series)) for name in times})
    return found


def filter_rows(scoring: dict[int, ScoringTimes], settings: Settings) -> Iterator[Row]:
    """On one core."""
    most = COUNTS[-1]
    for n_series, least in ((most, 20), (100, 40)):
        yield _against(f"batch score against dynamax, N = {n_series:,}", scoring[n_series], "dynamax", OURS, least)
    yield _against(f"batch score against a loop over statsmodels, N = {most:,}", scoring[most], "statsmodels", OURS, 1000)
    yield _against(f"NumPy twin against dynamax, N = {most:,}", scoring[most], "dynamax", TWIN, 2)
    for name, least in (("dynamax", 100), ("statsmodels", 50)):
        yield _against(f"one series, gains cached, against {name}", scoring[1], name, OURS, least)
    call = scoring[1].times.typical(OURS)
    yield without_target(
        "one series: the whole call, beside an empty one", f"{duration_text(call)}", duration_text(empty_call())
    )
    model = model_of("letter", N_STEPS, 1)
    gains, recordings, peer = shared_gains(model), recordings_of(model, most), imported("dynamax")
    (system,) = systems_of(model)
    times = raced(
        {
            OURS: clocked(partial(smooth_series, gains, recordings)),
            "dynamax": None if peer is None else clocked(peer.smooth_call(system, recordings[..., 0])),
        },
        settings.rounds,
    )
    yield at_least(f"smoother against dynamax, N = {most:,}", times, "dynamax", OURS, 20, most * N_STEPS, SERIES_STEP)


def memory_rows(settings: Settings) -> Iterator[Row]:
    """Recordings that come from memory, beside merely reading them, on one core and on two."""
    model = model_of("letter", N_STEPS, 1)
    gains, recordings = shared_gains(model), recordings_of(model, settings.in_memory)
    size = f"{settings.in_memory:,} recordings, {recordings.nbytes / 1e6:,.0f} MB"
    for n_threads, most in ((1, 2.5), (2, 2.0)):
        with cores(n_threads):
            times = interleaved(
                {
                    "score": clocked(partial(score_series, gains, recordings, n_threads)),
                    "one thread": clocked(partial(score_series, gains, recordings)),
                    "read": clocked(read_all(recordings, n_threads)),
                },
                settings.rounds,
            )
        ratio, bandwidth = times.ratio("score", "read"), recordings.nbytes / times.typical("read") / 1e9
        count = f"{n_threads} core{'s' if n_threads > 1 else ''}"
        detail = f"{size}: {duration_text(times.typical('score'))}, read at {bandwidth:.1f} GB/s"
        yield at_most(f"batch from memory over reading it, {count}", ratio, most, ratio_text(ratio), f"{most:g}×", detail)
    yield at_least("two threads against one", times, "one thread", "score", 1.6)


def _against(name: str, scoring: ScoringTimes, peer: str, ours: str, least: float) -> Row:
    """Times of one series each: not all score as many."""
    if peer not in scoring.times:
        return missing(name, f"≥ {least:,.0f}×", peer)
    each = Times({key: times / scoring.series[key] for key, times in scoring.times.items()})
    return at_least(name, each, peer, ours, least, N_STEPS, SERIES_STEP)
