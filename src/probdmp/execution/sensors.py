"""What observes an execution: o = h(s) + v, v ~ N(0, R), for each sensor.

The state s of D degrees of freedom is that of the model, (acceleration, velocity, position) of the first, then of the second
and so on: 3 D numbers. A linear sensor has a matrix C, (O, 3 D); a nonlinear one has a function. A channel sensor measures
what no state is: a channel that was learned with the movement, such as a force. R is diagonal or full.

An output is read from the column of a recording that has its name, be it a degree of freedom or a channel. Sensors need not
have the same rate: where one has measured nothing, there is NaN.

Source of the gate: the innovation checks of PX4's estimator (docs.px4.io, "Using PX4's Navigation Filter").
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, check_choice, check_names, check_positive, frozen, shape_text
from probdmp.dmp import Primitive
from probdmp.dmp.transformation_system import ACCELERATION, POSITION, VELOCITY
from probdmp.errors import InputError, InputTypeError

__all__ = [
    "LINEARIZATIONS",
    "STATES",
    "ChannelSensor",
    "LinearSensor",
    "NonlinearSensor",
    "Sensor",
    "default_sensors",
    "state_sensor",
    "variances_from_stds",
]

STATES = {"acceleration": ACCELERATION, "velocity": VELOCITY, "position": POSITION}
"""By name: where each is in the state of a degree of freedom."""
LINEARIZATIONS = ("extended", "unscented")


@dataclass(frozen=True, slots=True, eq=False)
class LinearSensor:
    """o = C s + v.

    Raises
    ------
    InputError, InputTypeError
        If shapes disagree, R is not positive definite, or names are not different texts.
    """

    name: str
    matrix: FloatArray
    """C, (O, 3 D) array; columns 3 d, 3 d + 1, 3 d + 2 are acceleration, velocity and position of degree of freedom d."""
    covariance: FloatArray
    """R, (O, O) array; an (O,) array of variances is made one. An infinite variance is that of a sensor that says nothing."""
    outputs: tuple[str, ...] = ()
    """(O) names of the outputs, those of the columns of recordings; the sensor's name, with a number where it has several,
    unless given."""
    gate: float | None = None
    """Standard deviations from which a reading is rejected; one of several numbers as rarely as a single one. None: never."""

    def __post_init__(self) -> None:
        matrix = frozen(check_array(self.matrix, f"matrix of sensor {self.name!r:.50}", ("O", "3 D")))
        if matrix.shape[1] % 3 or not matrix.size:
            hint = "Three for each degree of freedom: acceleration, velocity, position."
            raise InputError(f"matrix of sensor {self.name!r:.50} with 3 D columns", shape_text(matrix.shape), hint)
        object.__setattr__(self, "matrix", matrix)
        _check_sensor(self, len(matrix))

    @property
    def n_outputs(self) -> int:
        """O."""
        return len(self.matrix)


@dataclass(frozen=True, slots=True, eq=False)
class NonlinearSensor:
    """o = h(s) + v, linearised at every step.

    Raises
    ------
    InputError, InputTypeError
        If an argument cannot be used.
    """

    name: str
    function: Callable[..., ArrayLike]
    """h: from the (D,) array of each quantity in `reads`, in that order, to the (O,) outputs."""
    covariance: FloatArray
    """R, as for `LinearSensor`."""
    jacobian: Callable[..., ArrayLike] | None = None
    """From the same arguments to dh, (O, D len(reads)) array, columns in the order of the arguments; by central differences
    unless given. The unscented update needs none."""
    reads: tuple[str, ...] = ("position",)
    """Which of `STATES` the function takes."""
    linearization: str = "extended"
    """`"extended"`: the tangent at the mean; `"unscented"`: the line through points around it."""
    outputs: tuple[str, ...] = ()
    gate: float | None = None
    period: float | None = None
    """After which the outputs come round again: 2 pi for angles; None if they do not."""

    def __post_init__(self) -> None:
        functions: list[object] = [self.function] if self.jacobian is None else [self.function, self.jacobian]
        if not all(callable(function) for function in functions):
            raise InputTypeError(f"functions for sensor {self.name!r:.50}", f"{self.function!r:.60} and {self.jacobian!r:.60}")
        given: object = self.reads  # a single name, which is no tuple, is what people write
        object.__setattr__(self, "reads", (given,) if isinstance(given, str) else tuple(self.reads))
        for quantity in self.reads:
            check_choice(quantity, f"what sensor {self.name!r:.50} reads", STATES)
        if len(set(self.reads)) < max(len(self.reads), 1):
            raise InputError(f"different quantities that sensor {self.name!r:.50} reads", repr(self.reads))
        check_choice(self.linearization, "linearization", LINEARIZATIONS)
        if self.period is not None:
            object.__setattr__(self, "period", check_positive(self.period, "period"))
        _check_sensor(self, len(np.atleast_1d(_numbers(self.covariance, f"covariance of sensor {self.name!r:.50}"))))

    @property
    def n_outputs(self) -> int:
        """O."""
        return len(self.covariance)


@dataclass(frozen=True, slots=True, eq=False)
class ChannelSensor:
    """Measures a channel that was learned with the movement, and is named as that."""

    name: str
    covariance: FloatArray
    """R, (1, 1) array, or a number or (1,) array: the variance, units of the channel squared."""
    gate: float | None = None
    outputs: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "outputs", (self.name,))
        _check_sensor(self, 1)

    @property
    def n_outputs(self) -> int:
        """One."""
        return 1


Sensor = LinearSensor | NonlinearSensor | ChannelSensor


def default_sensors(primitive: Primitive) -> tuple[Sensor, ...]:
    """What observes an execution unless something else is said: its positions, and the channels that were learned."""
    signals, d = primitive.signals, primitive.n_dof
    # Not by way of standard deviations: a variance that is rooted and squared is another one.
    positions = replace(state_sensor(primitive, "position", "position", 1.0), covariance=primitive.observation_variances)
    of_channels = zip(signals.names[d:], signals.observation_variances[d:], strict=True)
    return (positions, *(ChannelSensor(name, variance) for name, variance in of_channels))


def state_sensor(
    primitive: Primitive,
    name: str,
    measures: str | Sequence[str],
    stds: ArrayLike,
    outputs: Sequence[str] | None = None,
    gate: float | None = None,
) -> LinearSensor:
    """A sensor whose outputs are states as they are.

    Parameters
    ----------
    measures : `"position"`, `"velocity"` or `"acceleration"` of all degrees of freedom, or a list of single ones such as
        `["velocity:x", "position:y"]`.
    stds : standard deviations, a number for all outputs or one for each, in the units of what is measured; infinite where an
        output says nothing.
    outputs : names of the columns of recordings. Unless given, positions have those of their degrees of freedom; others are
        called velocity_x and so on.
    """
    wanted = [f"{measures}:{dof}" for dof in primitive.names] if isinstance(measures, str) and ":" not in measures else measures
    wanted = [wanted] if isinstance(wanted, str) else list(wanted)
    matrix, names = np.zeros((len(wanted), 3 * primitive.n_dof)), []
    for row, text in zip(matrix, wanted, strict=True):
        kind, _, dof = str(text).partition(":")
        check_choice(kind, f"what sensor {name!r:.50} measures", STATES)
        check_choice(dof, f"the degree of freedom after the colon in {text!r}", primitive.names)
        row[3 * primitive.names.index(dof) + STATES[kind]] = 1.0
        names.append(dof if kind == "position" else f"{kind}_{dof}")
    variances = variances_from_stds(stds, len(wanted), name)
    chosen = names if outputs is None else check_names(outputs, "outputs")
    return LinearSensor(name, matrix, variances, tuple(chosen), gate)


def variances_from_stds(stds: ArrayLike, n_outputs: int, name: str) -> FloatArray:
    """Variances of the outputs of a sensor, (O,) array, from a standard deviation for all of them or one for each.

    Raises
    ------
    InputError, InputTypeError
        If they are not that many numbers above zero; infinite ones are such.
    """
    what = f"stds of sensor {name!r:.50}"
    given = _numbers(stds, what)
    silent = np.isposinf(given)
    checked = check_array(np.where(silent, 1.0, given), what, (n_outputs,) if given.ndim else ())
    if np.any(checked <= 0):
        raise InputError(f"{what} > 0", f"{checked.min():g}")
    return np.array(np.broadcast_to(np.where(silent, np.inf, checked**2), (n_outputs,)))


def _check_sensor(sensor: Sensor, n_outputs: int) -> None:
    """Check and complete what all sensors have."""
    name, outputs = sensor.name, sensor.outputs
    if not all(isinstance(given, kind) for given, kind in ((name, str), (outputs, tuple | list))) or not name:
        raise InputTypeError(
            "the name of a sensor as text, and its outputs as a list of names", f"{name!r:.50}, {outputs!r:.50}"
        )
    if n_outputs < 1:
        raise InputError(f"at least one output of sensor {name!r:.50}", "none")
    default = (name,) if n_outputs == 1 else tuple(f"{name}_{i}" for i in range(n_outputs))
    names = tuple(outputs) or default
    if not all(isinstance(text, str) for text in names) or len(names) != n_outputs or len(set(names)) < n_outputs:
        raise InputError(f"{n_outputs} different names for the outputs of sensor {name!r:.50}", f"{names!r:.100}")
    object.__setattr__(sensor, "outputs", names)
    object.__setattr__(sensor, "covariance", _noise(sensor.covariance, n_outputs, name))
    if sensor.gate is not None:
        object.__setattr__(sensor, "gate", check_positive(sensor.gate, f"gate of sensor {name!r:.50}", "standard deviations"))


def _noise(value: ArrayLike, n_outputs: int, name: str) -> FloatArray:
    """R, (O, O) array, positive definite; infinite on the diagonal for outputs that say nothing."""
    what = f"covariance of sensor {name!r:.50}"
    given = np.atleast_1d(_numbers(value, what))
    noise = np.diag(given) if given.ndim == 1 else given
    if noise.shape != (n_outputs, n_outputs):
        raise InputError(f"{what} of shape {shape_text((n_outputs, n_outputs))}", shape_text(given.shape))
    silent = np.isposinf(np.diagonal(noise))
    finite = check_array(np.where(silent[:, None] | silent, np.eye(n_outputs), noise), what, noise.shape)
    if np.any(finite != finite.T) or np.linalg.eigvalsh(finite)[0] <= 0:
        hint = "Give every output a variance above zero, if only a tiny one; infinite if it says nothing."
        raise InputError(f"{what} symmetric and positive definite", "one that is not", hint)
    return frozen(np.where(np.diag(silent), np.inf, finite))


def _numbers(value: ArrayLike, what: str) -> FloatArray:
    """Real numbers of any shape, infinite ones too."""
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise InputError(f"{what} as a rectangular array", "rows of different lengths") from error
    if array.dtype.kind not in "fiu":
        raise InputTypeError(f"{what} as real numbers", f"dtype {array.dtype}")
    return array.astype(np.float64)
