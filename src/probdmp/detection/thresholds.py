"""From a statistic to a test ratio: above 1 is an alarm."""

from dataclasses import dataclass

from probdmp.checks import LARGEST_MAGNITUDE

__all__ = ["PaperThreshold"]


@dataclass(frozen=True, slots=True)
class PaperThreshold:
    """The paper's rule: failed when the log-likelihood falls below twice its minimum over the training demonstrations.

    Twice a positive minimum would lie above it, and the rule would call every execution failed; so it is read as
    minimum - |minimum|, which is the same where the minimum is negative.
    Source: Meier & Schaal 2016, "Failure Detection with Probabilistic DMPs".
    """

    minimum: float
    """Least value of the statistic over the training demonstrations, nats."""

    @property
    def level(self) -> float:
        """The statistic below which an execution has failed, nats."""
        return self.minimum - abs(self.minimum)

    def test_ratio(self, log_likelihood: float) -> float:
        """Statistic over threshold, above 1 for an alarm; 0 where the log-likelihood is beyond doubt.

        The statistic is how far the log-likelihood has fallen: below 0, or below the minimum where that is positive.
        """
        top = max(self.minimum, 0.0)
        return max(top - log_likelihood, 0.0) / max(top - self.level, 1 / LARGEST_MAGNITUDE)
