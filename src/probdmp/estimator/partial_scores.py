"""Which movement a drawing is one of, while it is still being drawn."""

from collections.abc import Mapping

from probdmp.demonstrations import Demonstration
from probdmp.estimator.probabilistic_dmp import ProbabilisticDMP
from probdmp.execution import score_recordings, task_of_recording

__all__ = ["TEMPOS", "log_densities_so_far"]

TEMPOS = (0.6, 0.8, 1.0, 1.25, 1.6)
"""Durations of a movement that has only begun, relative to the learned one, out of which the likeliest counts."""

MOST_SAMPLES = 40
"""That are compared; those between say little more."""


def log_densities_so_far(
    library: Mapping[str, ProbabilisticDMP], drawn: Demonstration, is_complete: bool = False
) -> dict[str, float]:
    """Log density per sample of the positions drawn so far under each movement, wherever it is drawn, nats.

    Parameters
    ----------
    library : learned movements by label; those of other degrees of freedom are left out.
    drawn : from its first sample on, which was measured.
    is_complete : whether it has ended, so that its duration is known; else each movement takes the tempo that suits it best.

    """
    every = max(1, -(-drawn.n_samples // MOST_SAMPLES))
    seen = Demonstration(drawn.positions[::every], drawn.dt * every) if drawn.n_samples > 2 * every else drawn
    scores = {}
    for label, learned in library.items():
        primitive = learned.primitive_
        if primitive.n_dof != drawn.n_dof:
            continue
        moved = Demonstration(seen.positions - seen.positions[0] + primitive.start, seen.dt)  # wherever it is drawn
        durations = [drawn.duration] if is_complete else [tempo * primitive.duration for tempo in TEMPOS]
        tasks = [task_of_recording(primitive, moved, duration=duration) for duration in durations]
        scores[label] = float(score_recordings(primitive, tasks, [moved] * len(tasks)).max()) / seen.n_samples
    return scores
