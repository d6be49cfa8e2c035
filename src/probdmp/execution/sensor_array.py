"""Sensors as one observation of the states of a primitive.

All outputs of all sensors make up an observation (O,). Where each output depends on one degree of freedom alone, and no two of
different ones share noise, the states of each degree of freedom are a group that is filtered by itself; otherwise all of them
are one group.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from probdmp.checks import BoolArray, FloatArray, IntArray, check_array, check_choice, check_names
from probdmp.dmp import Primitive
from probdmp.dmp.transformation_system import POSITION
from probdmp.errors import InputError, InputTypeError
from probdmp.execution.gating import gate_limits, gate_ratios
from probdmp.execution.sensors import STATES, ChannelSensor, LinearSensor, NonlinearSensor, Sensor, default_sensors
from probdmp.gaussian import AffineObservation, Linearization, linearize_extended, linearize_unscented, wrapped

__all__ = ["Moments", "SensorArray"]

Values = TypeVar("Values", FloatArray, BoolArray, IntArray)
Moments = Callable[[], tuple[FloatArray, FloatArray]]
"""Mean (*batch, 3 S) and covariance (*batch, 3 S, 3 S) of the states of all signals, computed when they are needed."""


class SensorArray:
    """All sensors of an execution.

    Parameters
    ----------
    sensors : positions and learned channels unless given. A channel that none of them measures keeps its own sensor.

    Raises
    ------
    InputError, InputTypeError
        If they do not fit the primitive, or two have a name or an output in common.
    """

    def __init__(self, primitive: Primitive, sensors: Sequence[Sensor] | None = None) -> None:
        self.sensors = _checked_sensors(primitive, sensors)
        self.names = tuple(sensor.name for sensor in self.sensors)
        self.outputs = tuple(output for sensor in self.sensors for output in sensor.outputs)
        ends = np.cumsum([sensor.n_outputs for sensor in self.sensors]).tolist()
        self.slices = {s.name: slice(end - s.n_outputs, end) for s, end in zip(self.sensors, ends, strict=True)}
        """By name of the sensor: its outputs in an observation."""
        self.dof_names, self._n_signals = primitive.names, len(primitive.signals.names)
        scales = primitive.ranges[:, None] * primitive.duration ** np.array([-2.0, -1.0, 0.0])
        self._scales = scales.ravel()
        covariance = np.zeros((len(self.outputs),) * 2)
        self.dense_matrix = np.zeros((len(self.outputs), 3 * self._n_signals))
        for sensor in self.sensors:
            part = self.slices[sensor.name]
            covariance[part, part] = sensor.covariance
            if isinstance(sensor, LinearSensor):
                self.dense_matrix[part, : sensor.matrix.shape[1]] = sensor.matrix
            elif isinstance(sensor, ChannelSensor):
                self.dense_matrix[part, 3 * primitive.signals.names.index(sensor.name) + POSITION] = 1.0
        # C of all states, (O, 3 S); rows of nonlinear sensors are zero.
        self.silent = np.isposinf(np.diagonal(covariance))
        """(O,) outputs whose noise is infinite: what they say is never used."""
        self._is_any_silent = bool(self.silent.any())
        self.covariance = np.where(self.silent[:, None] | self.silent, np.eye(len(covariance)), covariance)
        """R, (O, O), with ones where it is infinite."""
        self._nonlinear = [sensor for sensor in self.sensors if isinstance(sensor, NonlinearSensor)]
        self._gated = [sensor for sensor in self.sensors if sensor.gate is not None]
        for sensor in self.sensors:
            if sensor.gate is not None:  # loads what it takes now, not in a control loop
                gate_limits(sensor.gate, len(sensor.outputs))
        self._group()
        self._find_signals()
        self.scales = self._output_scales(primitive)
        """(O,) how far each output goes in a movement, about; its units."""

    def _output_scales(self, primitive: Primitive) -> FloatArray:
        ranges = np.repeat(primitive.signals.ranges, 3)
        ranges[: len(self._scales)] = self._scales
        matrix, mean = np.array(self.dense_matrix), np.zeros(len(ranges))
        mean[POSITION : len(self._scales) : 3] = primitive.start
        for sensor in self._nonlinear:
            rows, function = self._rows(sensor), self._function(sensor)
            # By small differences: further away, or in a Jacobian at rest, the function may not be defined.
            line = linearize_extended(function, None, mean[rows], self._scales[rows], sensor.period)
            matrix[self.slices[sensor.name], rows] = line.matrix
        scales = np.abs(matrix) @ ranges
        return np.where(scales > 0, scales, 1.0)

    def _find_signals(self) -> None:
        """Which outputs measure a position or a channel as it is; of several for one signal the most precise."""
        units = np.eye(3 * self._n_signals)[POSITION::3]
        direct = [np.flatnonzero((self.dense_matrix == unit).all(axis=1) & ~self.silent) for unit in units]
        variances = np.diagonal(self.covariance)
        self.measured = np.array([len(found) > 0 for found in direct])
        """(S,) positions and channels that are measured as they are."""
        self._measuring = np.array([found[np.argmin(variances[found])] for found in direct if len(found)], dtype=np.int64)
        self._direct_outputs = (self.dense_matrix[:, None] == units).all(axis=-1).any(axis=1)
        every = np.arange(self._n_signals)
        self._is_direct = len(self.outputs) == self._n_signals and np.array_equal(self._measuring, every)

    def _group(self) -> None:
        """Which outputs belong to which group of states, and C and R of the groups."""
        touched = np.abs(self.dense_matrix).reshape(len(self.outputs), self._n_signals, 3).any(axis=-1)
        owners = np.argmax(touched, axis=1)
        strangers = owners[:, None] != owners
        self.is_coupled = bool(self._nonlinear or np.any(touched.sum(axis=1) > 1) or np.any(self.covariance[strangers] != 0))
        """Whether all states are one group."""
        if self.is_coupled:
            owners = np.zeros_like(owners)
        counts = np.bincount(owners, minlength=1 if self.is_coupled else self._n_signals)
        n_groups, size, n = len(counts), int(counts.max()), 3 * self._n_signals // len(counts)
        slots = np.array([int(np.sum(owners[:i] == owner)) for i, owner in enumerate(owners)])
        self._places = owners * size + slots
        by_group = self.dense_matrix.reshape(len(self.outputs), n_groups, n)
        self.matrix, self.noise = np.zeros((n_groups, size, n)), np.tile(np.eye(size), (n_groups, 1, 1))
        self.matrix[owners, slots] = by_group[np.arange(len(owners)), owners]
        for group in range(n_groups):
            own = np.flatnonzero(owners == group)
            self.noise[group][np.ix_(slots[own], slots[own])] = self.covariance[np.ix_(own, own)]
        self.is_plain = size == 1 and np.array_equal(self._places, np.arange(n_groups))
        """Whether there is one output for each group, in their order."""
        seen = self.matrix.reshape(-1, 3).any(axis=0)
        self.kinds = tuple(range(3)) if self.is_adaptive else tuple(np.flatnonzero(seen).tolist()) or (POSITION,)
        """Which of acceleration, velocity and position the outputs depend on."""

    @property
    def is_adaptive(self) -> bool:
        """Whether what an observation says depends on what is believed already."""
        return bool(self._nonlinear or self._gated)

    def grouped(self, values: FloatArray) -> FloatArray:
        """An observation (*batch, O) by group, (*batch, G, size); NaN where a group has fewer outputs than others."""
        n_groups, size, _ = self.matrix.shape
        if self.is_plain:
            return values[..., None]
        spread = np.full((*values.shape[:-1], n_groups * size), np.nan)
        spread[..., self._places] = values
        return spread.reshape(*values.shape[:-1], n_groups, size)

    def flat(self, by_group: Values) -> Values:
        """From (*batch, G size) to (*batch, O)."""
        return by_group if self.is_plain else by_group[..., self._places]

    def flat_covariances(self, by_group: FloatArray) -> FloatArray:
        """From (*batch, G size, G size) to (*batch, O, O)."""
        return by_group if self.is_plain else by_group[..., self._places[:, None], self._places]

    def look(self, observation: FloatArray, predicted: Moments) -> AffineObservation:
        """What an observation (*batch, O) says of the groups of states: values (*batch, G, size), C and R."""
        values = np.where(self.silent, np.nan, observation) if self._is_any_silent else observation
        if not self.is_adaptive:
            return AffineObservation(self.grouped(values), self.matrix, self.noise)
        mean, covariance = predicted()
        values, matrix, noise = self.lines(values, mean, covariance)
        trusted = self._trusted(values - np.matmul(matrix, mean[..., None])[..., 0], matrix @ covariance @ matrix.mT + noise)
        believed = self.grouped(np.where(trusted, 1.0, 0.0)) == 1.0
        if not self._nonlinear:
            return AffineObservation(self.grouped(values), self.matrix, self.noise, believed)
        return AffineObservation(self.grouped(values), matrix[..., None, :, :], noise[..., None, :, :], believed)

    def lines(
        self, observation: FloatArray, mean: FloatArray, covariance: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """An observation (*batch, O) as a linear function of all states, of the given moments: values, C (…, O, 3 S), R."""
        if not self._nonlinear:
            return observation, self.dense_matrix, self.covariance
        batch, values = observation.shape[:-1], np.array(observation)
        matrix, noise = (np.array(np.broadcast_to(x, (*batch, *x.shape))) for x in (self.dense_matrix, self.covariance))
        for index in np.ndindex(batch):
            for sensor in self._nonlinear:
                part = self.slices[sensor.name]
                line = self._linearized(sensor, mean[index], covariance[index])
                # The innovation is the reading minus the value; what the line says of the mean cancels.
                innovation = wrapped(values[index][part] - line.value, sensor.period)
                values[index][part] = innovation + line.matrix @ mean[index]
                matrix[index][part] = line.matrix
                noise[index][part, part] += line.residual
        return values, matrix, noise

    def _trusted(self, innovations: FloatArray, covariances: FloatArray) -> BoolArray:
        """(*batch, O) whether the gates let readings pass."""
        trusted = np.ones(innovations.shape, dtype=np.bool_)
        for sensor in self._gated:
            part = self.slices[sensor.name]
            ratios = gate_ratios(innovations[..., part], covariances[..., part, part], sensor.gate)
            trusted[..., part] = ~(ratios > 1)[..., None]
        return trusted

    def signals(self, observation: FloatArray) -> FloatArray:
        """What an observation (*batch, O) says of positions and channels as they are, (*batch, S) array; NaN elsewhere."""
        if self._is_direct:
            return observation
        values = np.full((*observation.shape[:-1], self._n_signals), np.nan)
        values[..., self.measured] = observation[..., self._measuring]
        return values

    def is_direct(self, name: str) -> bool:
        """Whether all outputs of a sensor are positions or learned channels as they are."""
        return bool(self._direct_outputs[self.slices[name]].all())

    def draw(self, states: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Readings of states (*batch, T, 3 S), with noise, (*batch, T, O) array; NaN of outputs that say nothing."""
        values = states @ self.dense_matrix.T
        for sensor in self._nonlinear:
            part = self.slices[sensor.name]
            for index in np.ndindex(states.shape[:-1]):
                values[index][part] = self._function(sensor)(states[index][self._rows(sensor)])
        noise = rng.standard_normal(values.shape) @ np.linalg.cholesky(self.covariance).T
        return np.where(self.silent, np.nan, values + noise)

    def chosen(self, names: Sequence[str]) -> BoolArray:
        """(O,) which outputs are of the sensors with these names."""
        for name in check_names(names, "feedback"):
            check_choice(name, "the name of a sensor that modulates the command", self.names)
        return np.array([name in names for name, part in self.slices.items() for _ in range(part.stop - part.start)])

    def _rows(self, sensor: NonlinearSensor) -> IntArray:
        """Which of the 3 S states a sensor reads."""
        return np.concatenate([3 * np.arange(len(self.dof_names)) + STATES[quantity] for quantity in sensor.reads])

    def _function(self, sensor: NonlinearSensor) -> Callable[[FloatArray], FloatArray]:
        """h of the states that it reads, in one array."""

        def call(arguments: FloatArray) -> FloatArray:
            value = np.atleast_1d(np.asarray(sensor.function(*np.split(arguments, len(sensor.reads)))))
            return check_array(value, f"what the function of sensor {sensor.name!r} returns", (sensor.n_outputs,))

        return call

    def _linearized(self, sensor: NonlinearSensor, mean: FloatArray, covariance: FloatArray) -> Linearization:
        """A line through h in all 3 S states."""
        rows, function = self._rows(sensor), self._function(sensor)

        def jacobian(arguments: FloatArray) -> FloatArray:
            assert sensor.jacobian is not None, "asked for only where there is one"
            value = np.asarray(sensor.jacobian(*np.split(arguments, len(sensor.reads))))
            return check_array(value, f"what the Jacobian of sensor {sensor.name!r} returns", (sensor.n_outputs, len(rows)))

        if sensor.linearization == "unscented":
            line = linearize_unscented(function, mean[rows], covariance[np.ix_(rows, rows)], sensor.period)
        else:
            given = None if sensor.jacobian is None else jacobian
            line = linearize_extended(function, given, mean[rows], self._scales[rows], sensor.period)
        matrix = np.zeros((sensor.n_outputs, len(mean)))
        matrix[:, rows] = line.matrix
        return line._replace(matrix=matrix)


def _checked_sensors(primitive: Primitive, sensors: Sequence[Sensor] | None) -> tuple[Sensor, ...]:
    default = default_sensors(primitive)
    if sensors is None:
        return default
    if not isinstance(sensors, list | tuple) or not all(isinstance(sensor, Sensor) for sensor in sensors):
        raise InputTypeError("sensors as a list of LinearSensor, NonlinearSensor or ChannelSensor", f"{sensors!r:.100}")
    if not sensors:
        raise InputError("at least one sensor", "none")
    measured = [sensor.name for sensor in sensors if isinstance(sensor, ChannelSensor)]
    chosen = (*sensors, *(sensor for sensor in default[1:] if sensor.name not in measured))
    names, outputs = [sensor.name for sensor in chosen], [output for sensor in chosen for output in sensor.outputs]
    for what, given in (("names", names), ("outputs", outputs)):
        if len(set(given)) < len(given):
            raise InputError(f"sensors with different {what}", repr(given))
    for sensor in chosen:
        if isinstance(sensor, LinearSensor) and sensor.matrix.shape[1] != 3 * primitive.n_dof:
            wanted = f"matrix of sensor {sensor.name!r} with {3 * primitive.n_dof} columns"
            hint = f"Acceleration, velocity and position of each of {', '.join(primitive.names)}."
            raise InputError(wanted, f"{sensor.matrix.shape[1]}", hint)
        if isinstance(sensor, ChannelSensor) and sensor.name not in primitive.channel_names:
            hint = "Learn it: ProbabilisticDMP(channels=[…]).fit(…), or fit --channels."
            raise InputError(f"a channel that was learned, one of {primitive.channel_names}", repr(sensor.name), hint)
    return chosen
