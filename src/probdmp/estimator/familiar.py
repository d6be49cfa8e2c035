"""The verbs that users of `movement-primitives` and `pydmps` know; docs/how-to/migrate.md has the same task in all three."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Self

from numpy.typing import ArrayLike

from probdmp.checks import FloatArray
from probdmp.demonstrations import Recordings, demonstration_from_times
from probdmp.estimator.learned import HasPrimitive

if TYPE_CHECKING:
    from probdmp.execution import GaussianTrajectory
    from probdmp.learning import ForcingWeights

__all__ = ["HasFamiliarVerbs"]


class HasFamiliarVerbs(HasPrimitive):
    """Other names for `fit` and `rollout`, and weights that were learned elsewhere."""

    if TYPE_CHECKING:

        def fit(self, demonstrations: Recordings, dt: float | None = None) -> Self: ...
        def rollout(self, *args: Any, **task: Any) -> "GaussianTrajectory": ...

    def imitate(self, times: ArrayLike, positions: ArrayLike) -> Self:
        """`fit` to a single demonstration: (T,) times in seconds, even or not, and (T, D) positions."""
        return self.fit([demonstration_from_times(times, positions)])

    def open_loop(self, **task: Any) -> tuple[FloatArray, FloatArray]:
        """Times and mean positions of `rollout`, (T,) and (T, D) arrays; arguments as for `rollout`."""
        planned = self.rollout(**task)
        return planned.times, planned.positions

    @classmethod
    def of_weights(cls, forcing: "ForcingWeights", **movement: Any) -> Self:
        """The movement of weights that another library has learned, without any spread.

        Parameters
        ----------
        movement : the other arguments of `probdmp.learning.primitive_from_weights`: start, goal, duration, dt, perhaps alpha_z
            and n_basis.
        """
        from probdmp.learning import primitive_from_weights

        primitive = primitive_from_weights(forcing, **movement)
        estimator = cls(**asdict(primitive.configuration) | {"weight_model": "pooled"})
        estimator.primitive_, estimator.fit_report_ = primitive, None
        return estimator
