"""The ways to filter an execution tick by tick: forcing terms redrawn at every step, or parameters that stay."""

from typing import Protocol

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive, Task, linear_gaussian_model
from probdmp.execution.independent_filtering import look_through, of_each_dof, sensed_system
from probdmp.execution.joint_steps import LATER_CHUNK, JointFilter
from probdmp.execution.sensed_ticks import RECORD_SIZE, RecordedTick, SensedTick, Tick
from probdmp.execution.sensor_array import SensorArray
from probdmp.gaussian import block_diagonal, kernels, output_shares, predict, update
from probdmp.gaussian.scalar_systems import ScalarSystems, scalar_systems

__all__ = ["StepFilter", "step_filter"]


class StepFilter(Protocol):
    """A filter that takes in one observation after the other, the first of the initial state.

    It replaces what it holds and does not write into it: a copy goes its own way.
    """

    def step(self, observation: FloatArray) -> SensedTick:
        """Take in an observation, (O,) array, NaN where nothing was measured, and go on to the next tick."""
        ...


def step_filter(primitive: Primitive, task: Task, dt: float, chunk: int, array: SensorArray) -> StepFilter:
    """The filter that a primitive asks for.

    Parameters
    ----------
    chunk : for how many ticks it is prepared; the movement need not end then.
    """
    if primitive.configuration.weight_uncertainty == "joint":
        return JointFilter(primitive, task, dt, chunk, array)
    if array.is_plain and not array.is_coupled and not array.is_adaptive and not array.silent.any():
        return PlainFilter(primitive, task, dt, chunk, array)
    return IndependentFilter(primitive, task, dt, chunk, array)


class PlainFilter:
    """The paper's Kalman filter where each degree of freedom has a sensor of its own."""

    def __init__(self, primitive: Primitive, task: Task, dt: float, chunk: int, array: SensorArray) -> None:
        self._primitive, self._task, self._dt, self._array = primitive, task, dt, array
        self._first, n = 0, len(array.outputs)
        start, record = self._load(chunk), np.zeros((RECORD_SIZE, _width(n)))
        record[:3, :n], record[3:12, :n] = start.initial_mean.T, start.initial_covariance.reshape(-1, 9).T
        self._record = record.tobytes()

    def step(self, observation: FloatArray) -> RecordedTick:
        """Alg. 2, lines 3-8."""
        taken = self.take(observation)
        assert taken is not None, "it was checked"
        return taken

    def take(self, observation: object) -> RecordedTick | None:
        """The same of what was not checked: None, and nothing is done, unless it is an array that can be an observation."""
        if self._k == self._n_prepared:
            self._first += self._k
            self._load(LATER_CHUNK)
        told = self._prepared.take(observation, self._record, self._k)
        if told is None:
            return None
        self._record = told[3]
        self._k += 1
        return tuple.__new__(RecordedTick, told)

    def _load(self, chunk: int) -> ScalarSystems:
        """Prepare the next ticks."""
        model = linear_gaussian_model(self._primitive, self._task, self._dt, chunk + 1, self._first)
        s = scalar_systems(sensed_system(model, self._array))
        transition = s.transition.reshape(len(s.noise), -1)
        system = _padded(np.concatenate([transition, s.input_vector, s.sensor, s.noise[:, None]], axis=1).T)
        system[-1, len(s.noise) :] = 1.0  # noise of nothing, which is divided by
        inputs = np.concatenate([s.drifts, s.input_variances[..., None]], axis=-1).swapaxes(1, 2)
        self._prepared = kernels.PreparedSteps(system, _padded(inputs), len(s.noise))
        self._k, self._n_prepared = 0, len(inputs)
        return s


def _width(n_systems: int) -> int:
    """How long the kernel wants the rows of so many systems."""
    return -(-n_systems // kernels.LANE) * kernels.LANE


def _padded(rows: FloatArray) -> FloatArray:
    """Rows (…, S) as long as that, with zeros beyond S."""
    padded = np.zeros((*rows.shape[:-1], _width(rows.shape[-1])))
    padded[..., : rows.shape[-1]] = rows
    return padded


class IndependentFilter:
    """The paper's Kalman filter, whatever the sensors."""

    def __init__(self, primitive: Primitive, task: Task, dt: float, chunk: int, array: SensorArray) -> None:
        self._primitive, self._task, self._dt, self._array = primitive, task, dt, array
        self._step = 0
        self._load(chunk)
        self._mean, self._covariance = self._model.initial_mean, self._model.initial_covariance

    def step(self, observation: FloatArray) -> Tick:
        """Alg. 2, lines 5-8, then lines 3-4."""
        array = self._array
        seen = update(self._mean, self._covariance, look_through(array, observation, self._mean, self._covariance))
        innovations, covariance, fused = seen.innovation, seen.innovation_covariance, seen.fused
        if not array.is_coupled:
            innovations, fused = array.flat(innovations.ravel()), array.flat(fused.reshape(-1))
            covariance = array.flat_covariances(block_diagonal(covariance))
        k = self._step - self._first
        if k == len(self._drifts):
            self._load(LATER_CHUNK)
            k = 0
        transition, drift, noise = self._model.transition, self._drifts[k], self._process_covariances[k]
        self._mean, self._covariance = predict(seen.mean, seen.covariance, transition, drift, noise)
        self._step += 1
        shares = output_shares(np.where(fused, innovations, np.nan), covariance)
        state = of_each_dof(array, self._mean, self._covariance)
        return Tick(int(fused.sum()), *state, shares, innovations, covariance, fused)

    def _load(self, chunk: int) -> None:
        self._first = self._step
        model = linear_gaussian_model(self._primitive, self._task, self._dt, chunk + 1, self._step)
        self._model = sensed_system(model, self._array)
        self._drifts, self._process_covariances = self._model.drifts(), self._model.process_covariances()
