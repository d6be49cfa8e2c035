"""The two ways to filter an execution tick by tick: forcing terms redrawn at every step, or parameters that stay."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive, Task, linear_gaussian_model, stack_tasks
from probdmp.dmp.joint_model import joint_executions, state_rows
from probdmp.dmp.responses import continue_responses, parameter_responses
from probdmp.execution.joint_filtering import start_deviation, state_moments, update_joint
from probdmp.gaussian import predict, predict_deviation, update

__all__ = ["STEP_FILTERS", "Sensed", "StepFilter"]


class Sensed(NamedTuple):
    """What the sensors said at one tick."""

    contributions: FloatArray
    """(D,) array, nats."""
    innovations: FloatArray
    """(D,) array, data units; NaN where not seen."""
    innovation_variances: FloatArray
    """(D,) array, data units squared, seen or not."""


class StepFilter(Protocol):
    """A filter that is updated and predicts in turn, beginning with an update of the initial state."""

    def update(self, measured: FloatArray) -> Sensed:
        """Take in positions, (D,) array, NaN where nothing was measured."""
        ...

    def predict(self) -> tuple[FloatArray, FloatArray]:
        """Go on to the next tick: mean (D, 3) and covariance (D, 3, 3) of its state."""
        ...


class IndependentFilter:
    """The paper's Kalman filter.

    Parameters
    ----------
    chunk : for how many ticks inputs are prepared at a time; the movement need not end after its duration.
    """

    def __init__(self, primitive: Primitive, task: Task, dt: float, chunk: int) -> None:
        self._primitive, self._task, self._dt, self._chunk = primitive, task, dt, chunk
        self._step = 0
        self._load()
        self._mean, self._covariance = self._model.initial_mean, self._model.initial_covariance

    def update(self, measured: FloatArray) -> Sensed:
        """Alg. 2, lines 5-8."""
        model = self._model
        seen = update(self._mean, self._covariance, measured[:, None], model.observation_matrix, model.observation_covariance)
        self._mean, self._covariance = seen.mean, seen.covariance
        return Sensed(seen.log_likelihood, seen.innovation[:, 0], seen.innovation_covariance[:, 0, 0])

    def predict(self) -> tuple[FloatArray, FloatArray]:
        """Alg. 2, lines 3-4."""
        if self._step - self._first == len(self._drifts):
            self._load()
        k = self._step - self._first
        self._mean, self._covariance = predict(
            self._mean, self._covariance, self._model.transition, self._drifts[k], self._process_covariances[k]
        )
        self._step += 1
        return self._mean, self._covariance

    def _load(self) -> None:
        self._first = self._step
        self._model = linear_gaussian_model(self._primitive, self._task, self._dt, self._chunk, self._step)
        self._drifts, self._process_covariances = self._model.drifts(), self._model.process_covariances()


class JointFilter:
    """Conditioning of parameters that stay and of what deviates from them; arguments as for `IndependentFilter`."""

    def __init__(self, primitive: Primitive, task: Task, dt: float, chunk: int) -> None:
        self._primitive, self._chunk = primitive, chunk
        self._duration, self._phase_step = task.duration, float(dt / task.duration)
        self._responses = parameter_responses(primitive.configuration, self._phase_step, chunk)
        self._first, self._step = 0, 0
        batch, _, system = joint_executions(primitive, stack_tasks([task]), np.array([dt]), 1)
        belief = batch.belief
        self._model = batch._replace(
            means=batch.means[0],
            factors=batch.factors[0],
            belief=belief._replace(mean=belief.mean[0], covariance=belief.covariance[0]),
        )
        self._transition, self._noise = system.transition[0], system.noise[0]
        self._deviation = start_deviation(self._model)

    def update(self, measured: FloatArray) -> Sensed:
        """Condition on positions."""
        variances = self._primitive.observation_variances
        seen, self._deviation, *_ = update_joint(self._model, self._deviation, self._rows(), measured, variances)
        self._model = self._model._replace(belief=seen.belief)
        return Sensed(seen.log_likelihoods, seen.innovation, np.diagonal(seen.innovation_covariance))

    def predict(self) -> tuple[FloatArray, FloatArray]:
        """The parameters stay, what deviates from them goes on; the state is another function of them."""
        self._step += 1
        self._deviation = predict_deviation(self._deviation, self._transition, self._noise)
        if self._step - self._first == len(self._responses):
            last = self._responses[-1]
            before, self._first = self._step - 1, self._step
            self._responses = continue_responses(self._primitive.configuration, self._phase_step, self._chunk, before, last)
        return state_moments(self._model, self._deviation, self._rows())

    def _rows(self) -> FloatArray:
        return state_rows(self._responses[self._step - self._first], self._duration)


STEP_FILTERS: dict[str, Callable[[Primitive, Task, float, int], StepFilter]] = {
    "independent": IndependentFilter,
    "joint": JointFilter,
}
