"""Recordings by the thousand through the public interface: no target of their own, but what a user calls."""

from collections.abc import Iterator
from functools import partial

from probdmp import FailureDetector
from speed.interleaving import clocked, interleaved
from speed.rows import Row, Settings, duration_text, without_target
from speed.workload import N_STEPS, UNCERTAINTIES, learned, model_of, recordings_of

__all__ = ["batch_rows"]

N_EXECUTIONS = 1_000


def batch_rows(settings: Settings) -> Iterator[Row]:
    """Log-likelihoods and verdicts of executions of a letter, each with its own start and duration as its task."""
    recordings = recordings_of(model_of("letter"), N_EXECUTIONS)
    for uncertainty in UNCERTAINTIES:
        dmp, demonstrations = learned("letter", uncertainty)
        detector, dt = FailureDetector().fit(dmp, demonstrations), demonstrations[0].dt
        times = interleaved(
            {
                "`score_samples`": clocked(partial(dmp.score_samples, recordings, dt)),
                "`predict` of a detector": clocked(partial(detector.predict, recordings, dt)),
            },
            max(3, settings.rounds // 5),
        )
        for name in times:
            each = duration_text(times.typical(name) / N_EXECUTIONS)
            title = f"{name}, {N_EXECUTIONS:,} executions {N_STEPS} × 2, `{uncertainty}` weights"
            yield without_target(title, f"{each} per execution", duration_text(times.typical(name)))
