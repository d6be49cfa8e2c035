"""One movement: scikit-learn manners, no arithmetic."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_count, check_generator, check_noise_stds
from probdmp.demonstrations import Demonstration, Recording, Recordings, as_demonstrations
from probdmp.dmp import PUBLISHED, Configuration, Task, ViaPoint, condition_primitive, task_for
from probdmp.errors import InputTypeError
from probdmp.estimator.familiar import HasFamiliarVerbs
from probdmp.learning import LearningOptions, fit_primitive

if TYPE_CHECKING:
    from pathlib import Path

    from probdmp.detection import FailureDetector
    from probdmp.execution import GaussianTrajectory, OnlineExecution, Sensor, SensorNoise, TrackedTrajectory

__all__ = ["ProbabilisticDMP"]

MOST_SAMPLES = 10_000


class ProbabilisticDMP(HasFamiliarVerbs):
    """A probabilistic Dynamic Movement Primitive: learn a movement, roll it out, execute it with feedback, judge it.

    Parameters
    ----------
    n_basis : basis functions per degree of freedom.
    weight_model : `"hierarchical"`: each demonstration has its own weights, drawn from a Gaussian over start velocity, goal and
        weights of all degrees of freedom that is learned; `"pooled"`: one set of weights behind all of them (the paper).
    weight_uncertainty : `"joint"`: the weights are constant and unknown, so that bands are those of whole executions and each
        observation tells about the rest; `"independent"`: the forcing term is redrawn at every step (the paper).
    forcing_noise : `"predictive"`: the forcing term strays from what the weights say, at every step, as in the
        demonstrations; `"posterior"`: only the weights are uncertain, and the sensor noise has to explain the rest.
    discretization : `"exact"` or `"semi_implicit_euler"` (the paper).
    scaling : `"none"` or `"paper"`: the forcing term grows with the distance from start to goal; this needs pooled weights and
        an independent forcing term.
    alpha_z : spring constant of the transformation system, dimensionless.
    smoothing : window of the Savitzky-Golay filter as a fraction of a demonstration.
    goal_handling : what a commanded goal does to joint weights. `"condition"`: the movement changes with its end as the
        demonstrations say; `"attractor"`: all of it is drawn to the goal; `"blend"`: the former within their spread, the
        latter beyond.
    coupling : whether the degrees of freedom of an execution are learned to vary together: `"full"`, `"none"`, or `"auto"`,
        whichever makes demonstrations likelier given the others.
    channels : names of sensor channels of the demonstrations, such as `["force"]`, that are learned with the movement: what
        they should read at each phase, and how that varies with the movement. An associative skill memory.

    Attributes
    ----------
    primitive_ : Primitive, the learned movement.
    fit_report_ : FitReport, how well it says what it was shown; None if loaded from a file.

    Notes
    -----
    Wherever `start`, `goal`, `duration`, `dt` are not given, they are as learned; for recordings, the recording's own first
    row, length and dt, and the learned goal. Positions are in data units, times in seconds, arrays time first: (T, D).
    Bands of position and velocity hardly depend on dt; those of the acceleration, which is white, grow as 1 / sqrt(dt).
    `sensors`, a list of what `probdmp.execution.sensors` has, says what observes an execution; unless given, the position of
    every degree of freedom, with the noise of the demonstrations, and every learned channel.
    """

    def __init__(
        self,
        n_basis: int = 30,
        *,
        weight_model: str = "hierarchical",
        weight_uncertainty: str = "joint",
        forcing_noise: str = "predictive",
        discretization: str = "exact",
        scaling: str = "none",
        alpha_z: float = 25.0,
        smoothing: float = 0.05,
        goal_handling: str = "blend",
        coupling: str = "full",
        channels: Sequence[str] = (),
    ) -> None:
        self.n_basis = n_basis
        self.weight_model = weight_model
        self.weight_uncertainty = weight_uncertainty
        self.forcing_noise = forcing_noise
        self.discretization = discretization
        self.scaling = scaling
        self.alpha_z = alpha_z
        self.smoothing = smoothing
        self.goal_handling = goal_handling
        self.coupling = coupling
        self.channels = channels

    @classmethod
    def as_published(cls, n_basis: int = 30, *, forcing_noise: str = "predictive") -> Self:
        """The paper's configuration: semi-implicit Euler, pooled weights, amplitude scaling; docs/paper.md has the details.

        Parameters
        ----------
        forcing_noise : the paper does not say which; it speaks of a predictive distribution.
        """
        settings = asdict(PUBLISHED) | {"n_basis": n_basis, "forcing_noise": forcing_noise}
        return cls(weight_model="pooled", smoothing=0.05, **settings)

    def fit(self, demonstrations: Recordings, dt: float | None = None) -> Self:
        """Learn from demonstrations, each with its own start, goal, duration and length.

        Parameters
        ----------
        demonstrations : a list of Demonstration or of (T_k, D) arrays, or one (K, T, D) array.
        dt : seconds between the samples of bare arrays.

        Raises
        ------
        InputError, InputTypeError
            If an argument or a demonstration cannot be used; the message names it and says what to do.
        """
        configuration = Configuration(**{field.name: getattr(self, field.name) for field in fields(Configuration)})
        options = LearningOptions(self.weight_model, self.smoothing, self.channels)
        recordings = as_demonstrations(demonstrations, dt)
        self.primitive_, self.fit_report_ = fit_primitive(recordings, configuration, options)
        self.taught_by_ = frozenset(recording.fingerprint for recording in recordings)
        return self

    def rollout(
        self,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: float | None = None,
        dt: float | None = None,
        start_velocity: ArrayLike | None = None,
    ) -> "GaussianTrajectory":
        """The movement as planned, with its uncertainty. Source: Algorithm 1."""
        from probdmp.execution import roll_out

        task = task_for(self._learned(), start, goal, duration, start_velocity)
        return roll_out(self._learned(), task, self._step(dt))

    def track(
        self,
        observations: Recording | Mapping[str, ArrayLike],
        dt: float | None = None,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: float | None = None,
        start_velocity: ArrayLike | None = None,
        sensors: "Sequence[Sensor] | None" = None,
    ) -> "TrackedTrajectory":
        """Kalman filter over a recorded execution. Source: Algorithm 2.

        Parameters
        ----------
        observations : a Demonstration, with the columns and channels that the outputs of the sensors are named after; a (T, D)
            array of positions; or (T, O) arrays by name of their sensors. NaN where nothing was measured.
        """
        from probdmp.execution import task_of_recording, track_recording

        array = self._array(sensors)
        recording = self._recording(observations, dt, array)
        task = task_of_recording(self._learned(), recording, start, goal, duration, start_velocity)
        return track_recording(self._learned(), task, recording, array)

    def smooth(
        self,
        observations: Recording | Mapping[str, ArrayLike],
        dt: float | None = None,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: float | None = None,
        start_velocity: ArrayLike | None = None,
        sensors: "Sequence[Sensor] | None" = None,
    ) -> "GaussianTrajectory":
        """The state at each time given the whole recorded execution, before and after; arguments as for `track`."""
        from probdmp.execution import smooth_recording, task_of_recording

        array = self._array(sensors)
        recording = self._recording(observations, dt, array)
        task = task_of_recording(self._learned(), recording, start, goal, duration, start_velocity)
        return smooth_recording(self._learned(), task, recording, array)

    def execute(
        self,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: float | None = None,
        dt: float | None = None,
        detector: "FailureDetector | None" = None,
        start_velocity: ArrayLike | None = None,
        on_alarm: str = "continue",
        sensors: "Sequence[Sensor] | None" = None,
        feedback: Sequence[str] | None = None,
    ) -> "OnlineExecution":
        """An execution to be stepped tick by tick with what the sensors say. Source: Algorithm 2, ExecuteAndMonitor.

        Parameters
        ----------
        start : where it starts; unless given it is about where the demonstrations did, and the first observation tells.
        detector : judges the execution while it runs.
        on_alarm : `"continue"` or `"hold"`, what is commanded after an alarm; see `OnlineExecution`.
        feedback : names of the sensors that modulate the command, all unless given; the others are only watched.
        """
        from probdmp.detection import FailureDetector
        from probdmp.execution import OnlineExecution

        if not isinstance(detector, FailureDetector | None):
            raise InputTypeError("detector as a FailureDetector", f"{detector!r:.100}")
        start = np.full(self._learned().n_dof, np.nan) if start is None else start
        task = task_for(self._learned(), start, goal, duration, start_velocity)
        given = getattr(detector, "sensors_", None) if sensors is None else sensors
        return OnlineExecution(self._learned(), task, self._step(dt), detector, on_alarm, self._array(given), feedback)

    def feedback_gains(
        self,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: float | None = None,
        dt: float | None = None,
        sensors: "Sequence[Sensor] | None" = None,
    ) -> FloatArray:
        """What a unit innovation of each output adds to the next command of `execute`: the paper's A K, (T - 1, D, 3, O) array.

        The order is acceleration, velocity, position. Sensors are linear and have no gate; see
        `probdmp.execution.feedback_gains`.
        """
        from probdmp.execution import feedback_gains

        start = np.full(self._learned().n_dof, np.nan) if start is None else start
        task = task_for(self._learned(), start, goal, duration)
        return feedback_gains(self._learned(), task, self._step(dt), self._array(sensors))

    def score_samples(
        self,
        executions: Recordings,
        dt: float | None = None,
        tasks: Sequence[Task] | None = None,
        sensors: "Sequence[Sensor] | None" = None,
    ) -> FloatArray:
        """Total log-likelihood of each recorded execution, (N,) array, nats, computed side by side.

        Parameters
        ----------
        tasks : what each was asked to do; its own first row and length and the learned goal unless given.
        """
        from probdmp.execution import is_batch, own_batch, score_batch, score_recordings, task_of_recording

        primitive = self._learned()
        if tasks is None and sensors is None and is_batch(executions, primitive):
            return score_batch(primitive, own_batch(primitive, executions, self._step(dt)))
        recordings = as_demonstrations(executions, self._step(dt))
        asked = tasks if tasks is not None else [task_of_recording(primitive, recording) for recording in recordings]
        return score_recordings(primitive, asked, recordings, self._array(sensors))

    def score(self, executions: Recordings, dt: float | None = None, tasks: Sequence[Task] | None = None) -> float:
        """Mean of `score_samples`, nats per execution: what a search of scikit-learn maximises."""
        return float(np.mean(self.score_samples(executions, dt, tasks)))

    def sample(
        self,
        n_samples: int = 1,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: float | None = None,
        dt: float | None = None,
        start_velocity: ArrayLike | None = None,
        sensor_noise: bool = True,
        random_state: "int | np.random.Generator | None" = None,
    ) -> list[FloatArray]:
        """Draw executions from the model: a list of n_samples (T, D) arrays.

        Parameters
        ----------
        sensor_noise : whether positions are as a sensor would record them, or as they are.
        """
        from probdmp.execution import sample_trajectories

        task = task_for(self._learned(), start, goal, duration, start_velocity)
        count, rng = check_count(n_samples, "n_samples", most=MOST_SAMPLES), check_generator(random_state)
        return sample_trajectories(self._learned(), task, self._step(dt), count, rng, sensor_noise)

    def sample_recordings(
        self,
        n_samples: int = 1,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: float | None = None,
        dt: float | None = None,
        start_velocity: ArrayLike | None = None,
        sensors: "Sequence[Sensor] | None" = None,
        random_state: "int | np.random.Generator | None" = None,
    ) -> list[Demonstration]:
        """Draw executions as sensors would record them; positions that none of them measures are missing."""
        from probdmp.execution import sample_recordings

        task = task_for(self._learned(), start, goal, duration, start_velocity)
        count, rng = check_count(n_samples, "n_samples", most=MOST_SAMPLES), check_generator(random_state)
        return sample_recordings(self._learned(), task, self._step(dt), count, rng, self._array(sensors))

    def condition(self, points: Sequence[ViaPoint]) -> Self:
        """The same movement through via-points; needs `weight_uncertainty="joint"`, the default.

        Parameters
        ----------
        points : (time, position, std) each: seconds of the learned duration; (D,) array, data units, NaN for a degree of
            freedom that is free; how far the movement may pass from it, a number or (D,) array, data units, > 0; executions
            deviate around that as anywhere. Positions are those of a movement from the learned start to the learned goal: one
            from or to elsewhere passes elsewhere.
        """
        return self._with(condition_primitive(self._learned(), points))

    def with_sensor_noise(self, stds: ArrayLike) -> Self:
        """The same movement measured by other sensors; a detector has to be fitted to it anew.

        Parameters
        ----------
        stds : (D,) array, data units: standard deviation of each position sensor, > 0.
        """
        learned = self._learned()
        return self._with(replace(learned, observation_variances=check_noise_stds(stds, learned.n_dof) ** 2))

    def learn_sensor_noise(
        self,
        sensors: "Sequence[Sensor]",
        demonstrations: Recordings,
        dt: float | None = None,
        tasks: Sequence[Task] | None = None,
        covariance: str = "as_given",
    ) -> "SensorNoise":
        """The noise R of each sensor, by expectation maximisation over demonstrations that all of them have recorded.

        Parameters
        ----------
        sensors : with a first guess of their noise.
        tasks : what each was asked to do. Unless given, nothing but the length of the recording is told: where it starts is
            for the sensors to say.
        covariance : `"as_given"`: a diagonal R stays diagonal; `"full"`, `"diagonal"`, or `"auto"`: the likelier of the two on
            demonstrations that were left out, sensor by sensor.
        """
        from probdmp.execution import estimate_sensor_noise, task_of_recording

        primitive, recordings = self._learned(), as_demonstrations(demonstrations, self._step(dt))
        unknown = np.full(primitive.n_dof, np.nan)
        asked = tasks if tasks is not None else [task_of_recording(primitive, r, start=unknown) for r in recordings]
        return estimate_sensor_noise(primitive, sensors, asked, recordings, covariance)

    def save(self, path: "str | Path", detector: "FailureDetector | None" = None) -> None:
        """Write a model file, atomically, with the detector if given."""
        from probdmp.estimator.saving import write_learned

        write_learned(path, {"": (self._learned(), self.get_params())}, detector)
