"""A detector at work on one execution, tick by tick; recordings are fed through the same code."""

from collections.abc import Iterator, Sequence

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration
from probdmp.detection.statistics import LIKELIHOODS, standardized_contributions
from probdmp.detection.thresholds import PaperThreshold
from probdmp.detection.verdict import Verdict
from probdmp.dmp import Primitive, Task
from probdmp.dmp.phase import phases_at
from probdmp.execution import Observed, SensorArray, filter_recordings, readings_of

__all__ = ["LikelihoodMonitor", "LikelihoodStatistic", "replay"]


class LikelihoodStatistic:
    """The log-likelihood of an execution so far, outputs of the sensors in units of their range.

    Parameters
    ----------
    likelihood : a name from `LIKELIHOODS`.
    scales : (O,) array, units of the outputs.
    """

    def __init__(self, likelihood: str, scales: FloatArray) -> None:
        self._follow, self._scales = LIKELIHOODS[likelihood], scales
        self._so_far = 0.0

    def update(self, observed: Observed) -> tuple[float, FloatArray]:
        """The statistic after one more tick, infinite if nothing was seen, and what each output said in it, (O,)."""
        if np.isnan(observed.innovations).all():
            return np.inf, np.zeros_like(observed.innovations)
        contributions = standardized_contributions(
            observed.contributions, observed.innovations, observed.innovation_variances, self._scales
        )
        self._so_far = self._follow(self._so_far, float(contributions.sum()))
        return self._so_far, contributions


class LikelihoodMonitor:
    """Compares the statistic of one execution with a threshold; the first alarm is latched."""

    def __init__(self, array: SensorArray, likelihood: str, threshold: PaperThreshold) -> None:
        self._statistic = LikelihoodStatistic(likelihood, array.scales)
        self._threshold = threshold
        nothing = np.zeros(len(array.outputs))
        self._verdict = Verdict(False, 0, 0.0, 1.0, 0.0, nothing, array.outputs)

    @property
    def verdict(self) -> Verdict:
        """What can be said so far."""
        return self._verdict

    def update(self, observed: Observed) -> float:
        """Take one tick into account; returns the test ratio, above 1 for an alarm."""
        statistic, contributions = self._statistic.update(observed)
        test_ratio = self._threshold.test_ratio(statistic)
        if test_ratio > self._verdict.test_ratio and not self._verdict.failed:
            self._verdict = Verdict(
                failed=test_ratio > 1,
                step=observed.step,
                time=observed.time,
                phase=observed.phase,
                test_ratio=test_ratio,
                contributions=contributions,
                names=self._verdict.names,
            )
        return test_ratio


def replay(
    primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration], array: SensorArray
) -> Iterator[Iterator[Observed]]:
    """For each recording, what an online execution would have shown its monitor, tick by tick."""
    forward = filter_recordings(primitive, tasks, recordings, array)
    for k, (task, recording) in enumerate(zip(tasks, recordings, strict=True)):
        phases, signals = phases_at(recording.times, task.duration), array.signals(readings_of(array, recording))
        yield (
            Observed(
                t,
                t * recording.dt,
                float(x),
                signals[t],
                forward.log_likelihoods[t, k],
                forward.innovations[t, k],
                np.diagonal(forward.innovation_covariances[t, k]),
            )
            for t, x in enumerate(phases)
        )
