"""The two ways to filter an execution tick by tick: forcing terms redrawn at every step, or parameters that stay."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from probdmp.checks import BoolArray, FloatArray
from probdmp.dmp import Primitive, Task, linear_gaussian_model, stack_tasks
from probdmp.dmp.joint_model import joint_executions, state_rows
from probdmp.dmp.responses import continue_responses, parameter_responses
from probdmp.execution.independent_filtering import look_through, of_each_dof, sensed_system
from probdmp.execution.joint_filtering import start_deviation, state_moments, update_joint
from probdmp.execution.sensor_array import SensorArray
from probdmp.gaussian import block_diagonal, output_shares, predict, predict_deviation, update

__all__ = ["STEP_FILTERS", "Sensed", "StepFilter"]


class Sensed(NamedTuple):
    """What the sensors said at one tick."""

    contributions: FloatArray
    """(O,) array, nats."""
    innovations: FloatArray
    """(O,) array, units of the outputs; NaN where not seen."""
    innovation_covariance: FloatArray
    """(O, O) array, whether seen or not."""
    fused: BoolArray
    """(O,) array: what was seen and believed."""


class StepFilter(Protocol):
    """A filter that is updated and predicts in turn, beginning with an update of the initial state."""

    def update(self, observation: FloatArray) -> Sensed:
        """Take in an observation, (O,) array, NaN where nothing was measured."""
        ...

    def predict(self) -> tuple[FloatArray, FloatArray]:
        """Go on to the next tick: mean (S, 3) and covariance (S, 3, 3) of its state."""
        ...


class IndependentFilter:
    """The paper's Kalman filter.

    Parameters
    ----------
    chunk : for how many ticks inputs are prepared at a time; the movement need not end after its duration.
    """

    def __init__(self, primitive: Primitive, task: Task, dt: float, chunk: int, array: SensorArray) -> None:
        self._primitive, self._task, self._dt, self._chunk, self._array = primitive, task, dt, chunk, array
        self._step = 0
        self._load()
        self._mean, self._covariance = self._model.initial_mean, self._model.initial_covariance

    def update(self, observation: FloatArray) -> Sensed:
        """Alg. 2, lines 5-8."""
        array = self._array
        looked = look_through(array, observation, self._mean, self._covariance)
        seen = update(self._mean, self._covariance, looked)
        self._mean, self._covariance = seen.mean, seen.covariance
        innovations, covariance, fused = seen.innovation, seen.innovation_covariance, seen.fused
        if array.is_plain and not array.is_coupled:
            spread = np.diag(covariance[:, 0, 0])
            return Sensed(seen.log_likelihood, innovations[:, 0], spread, fused[:, 0])
        if not array.is_coupled:
            innovations, fused = array.flat(innovations.ravel()), array.flat(fused.reshape(-1))
            covariance = array.flat_covariances(block_diagonal(covariance))
        return Sensed(output_shares(np.where(fused, innovations, np.nan), covariance), innovations, covariance, fused)

    def predict(self) -> tuple[FloatArray, FloatArray]:
        """Alg. 2, lines 3-4."""
        if self._step - self._first == len(self._drifts):
            self._load()
        k = self._step - self._first
        self._mean, self._covariance = predict(
            self._mean, self._covariance, self._model.transition, self._drifts[k], self._process_covariances[k]
        )
        self._step += 1
        return of_each_dof(self._array, self._mean, self._covariance)

    def _load(self) -> None:
        self._first = self._step
        model = linear_gaussian_model(self._primitive, self._task, self._dt, self._chunk, self._step)
        self._model = sensed_system(model, self._array)
        self._drifts, self._process_covariances = self._model.drifts(), self._model.process_covariances()


class JointFilter:
    """Conditioning of parameters that stay and of what deviates from them; arguments as for `IndependentFilter`."""

    def __init__(self, primitive: Primitive, task: Task, dt: float, chunk: int, array: SensorArray) -> None:
        self._primitive, self._chunk, self._array = primitive, chunk, array
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
        self._transition, self._noise = (part[0] for part in system.grouped(array.is_coupled))
        self._deviation = start_deviation(self._model, array.is_coupled)

    def update(self, observation: FloatArray) -> Sensed:
        """Condition on what was measured."""
        array = self._array
        seen, self._deviation, *_ = update_joint(self._model, self._deviation, self._rows(), observation, array)
        self._model = self._model._replace(belief=seen.belief)
        covariance = array.flat_covariances(seen.innovation_covariance)
        return Sensed(array.flat(seen.log_likelihoods), array.flat(seen.innovation), covariance, array.flat(seen.fused))

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


STEP_FILTERS: dict[str, Callable[[Primitive, Task, float, int, SensorArray], StepFilter]] = {
    "independent": IndependentFilter,
    "joint": JointFilter,
}
