"""One movement: scikit-learn manners, no arithmetic."""

from collections.abc import Sequence
from dataclasses import asdict, fields, replace
from inspect import signature
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, check_choice, check_count, check_seconds
from probdmp.demonstrations import Demonstration, Recording, Recordings, as_demonstrations
from probdmp.detection import FailureDetector
from probdmp.dmp import PUBLISHED, Configuration, Primitive, Task, ViaPoint, condition_primitive, task_for
from probdmp.errors import InputError, InputTypeError, NotFittedError
from probdmp.estimator.saving import write_learned
from probdmp.execution import (
    GaussianTrajectory,
    OnlineExecution,
    TrackedTrajectory,
    roll_out,
    sample_trajectories,
    score_recordings,
    smooth_recording,
    task_of_recording,
    track_recording,
)
from probdmp.learning import FitReport, LearningOptions, fit_primitive

__all__ = ["ProbabilisticDMP"]

MOST_SAMPLES = 10_000


class ProbabilisticDMP:
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

    Attributes
    ----------
    primitive_ : Primitive, the learned movement.
    fit_report_ : FitReport, how well it says what it was shown; None if loaded from a file.

    Notes
    -----
    Wherever `start`, `goal`, `duration`, `dt` are not given, they are as learned; for recordings, the recording's own first
    row, length and dt, and the learned goal. Positions are in data units, times in seconds, arrays time first: (T, D).
    Bands of position and velocity hardly depend on dt; those of the acceleration, which is white, grow as 1 / sqrt(dt).
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

    @classmethod
    def as_published(cls, n_basis: int = 30, *, forcing_noise: str = "predictive") -> Self:
        """The paper's configuration: semi-implicit Euler, pooled weights, amplitude scaling; docs/paper.md has the details.

        Parameters
        ----------
        forcing_noise : the paper does not say which; it speaks of a predictive distribution.
        """
        settings = asdict(PUBLISHED) | {"n_basis": n_basis, "forcing_noise": forcing_noise}
        return cls(weight_model="pooled", smoothing=0.05, **settings)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """The constructor's arguments by name."""
        return {name: getattr(self, name) for name in signature(type(self).__init__).parameters if name != "self"}

    def set_params(self, **parameters: Any) -> Self:
        """Change constructor's arguments by name."""
        for name, value in parameters.items():
            check_choice(name, "the name of a parameter", self.get_params())
            setattr(self, name, value)
        return self

    def __repr__(self) -> str:
        arguments = ", ".join(f"{name}={value!r}" for name, value in self.get_params().items())
        return f"ProbabilisticDMP({arguments})"

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
        options = LearningOptions(self.weight_model, self.smoothing)
        self.primitive_: Primitive
        self.fit_report_: FitReport | None
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
    ) -> GaussianTrajectory:
        """The movement as planned, with its uncertainty. Source: Algorithm 1."""
        task = task_for(self._learned(), start, goal, duration, start_velocity)
        return roll_out(self._learned(), task, self._step(dt))

    def track(
        self,
        observations: Recording,
        dt: float | None = None,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: float | None = None,
        start_velocity: ArrayLike | None = None,
    ) -> TrackedTrajectory:
        """Kalman filter over a recorded execution, (T, D), NaN where nothing was measured. Source: Algorithm 2."""
        recording = self._recording(observations, dt)
        task = task_of_recording(self._learned(), recording, start, goal, duration, start_velocity)
        return track_recording(self._learned(), task, recording)

    def smooth(
        self,
        observations: Recording,
        dt: float | None = None,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: float | None = None,
        start_velocity: ArrayLike | None = None,
    ) -> GaussianTrajectory:
        """The state at each time given the whole recorded execution, before and after."""
        recording = self._recording(observations, dt)
        task = task_of_recording(self._learned(), recording, start, goal, duration, start_velocity)
        return smooth_recording(self._learned(), task, recording)

    def execute(
        self,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: float | None = None,
        dt: float | None = None,
        detector: FailureDetector | None = None,
        start_velocity: ArrayLike | None = None,
        on_alarm: str = "continue",
    ) -> OnlineExecution:
        """An execution to be stepped tick by tick with what the sensors say. Source: Algorithm 2, ExecuteAndMonitor.

        Parameters
        ----------
        start : where it starts; unless given it is about where the demonstrations did, and the first observation tells.
        detector : judges the execution while it runs.
        on_alarm : `"continue"` or `"hold"`, what is commanded after an alarm; see `OnlineExecution`.
        """
        if not isinstance(detector, FailureDetector | None):
            raise InputTypeError("detector as a FailureDetector", f"{detector!r:.100}")
        start = np.full(self._learned().n_dof, np.nan) if start is None else start
        task = task_for(self._learned(), start, goal, duration, start_velocity)
        return OnlineExecution(self._learned(), task, self._step(dt), detector, on_alarm)

    def score_samples(self, executions: Recordings, dt: float | None = None, tasks: Sequence[Task] | None = None) -> FloatArray:
        """Total log-likelihood of each recorded execution, (N,) array, nats, computed side by side.

        Parameters
        ----------
        tasks : what each was asked to do; its own first row and length and the learned goal unless given.
        """
        primitive, recordings = self._learned(), as_demonstrations(executions, self._step(dt))
        asked = tasks if tasks is not None else [task_of_recording(primitive, recording) for recording in recordings]
        return score_recordings(primitive, asked, recordings)

    def sample(
        self,
        n_samples: int = 1,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: float | None = None,
        dt: float | None = None,
        start_velocity: ArrayLike | None = None,
        sensor_noise: bool = True,
        random_state: int | np.random.Generator | None = None,
    ) -> list[FloatArray]:
        """Draw executions from the model: a list of n_samples (T, D) arrays.

        Parameters
        ----------
        sensor_noise : whether positions are as a sensor would record them, or as they are.
        """
        task = task_for(self._learned(), start, goal, duration, start_velocity)
        count = check_count(n_samples, "n_samples", most=MOST_SAMPLES)
        try:
            rng = np.random.default_rng(random_state)
        except (TypeError, ValueError) as error:
            raise InputTypeError("random_state as a whole number >= 0 or a Generator", f"{random_state!r:.100}") from error
        return sample_trajectories(self._learned(), task, self._step(dt), count, rng, sensor_noise)

    def condition(self, points: Sequence[ViaPoint]) -> Self:
        """The same movement through via-points; needs `weight_uncertainty="joint"`, the default.

        Parameters
        ----------
        points : (time, position, std) each: seconds of the learned duration; (D,) array, data units, NaN for a degree of
            freedom that is free; how far the movement may pass from it, a number or (D,) array, data units, > 0; executions
            deviate around that as anywhere. Positions are those of a movement from the learned start: from another one, it
            passes as much further on.
        """
        return self._with(condition_primitive(self._learned(), points))

    def with_sensor_noise(self, stds: ArrayLike) -> Self:
        """The same movement measured by other sensors; a detector has to be fitted to it anew.

        Parameters
        ----------
        stds : (D,) array, data units: standard deviation of each position sensor, > 0.
        """
        learned = self._learned()
        checked = check_array(stds, "stds", (learned.n_dof,))
        if np.any(checked <= 0):
            raise InputError("stds > 0", f"{checked.min():g}")
        return self._with(replace(learned, observation_variances=checked**2))

    def save(self, path: str | Path, detector: FailureDetector | None = None) -> None:
        """Write a model file, atomically, with the detector if given."""
        write_learned(path, {"": (self._learned(), self.get_params())}, detector)

    def _learned(self) -> Primitive:
        if not hasattr(self, "primitive_"):
            raise NotFittedError("a learned primitive", "one that was not fitted", "Call fit(demonstrations) first.")
        return self.primitive_

    def _with(self, primitive: Primitive) -> Self:
        other = type(self)(**self.get_params())
        other.primitive_, other.fit_report_ = primitive, None
        return other

    def _step(self, dt: float | None) -> float:
        return self._learned().dt if dt is None else check_seconds(dt, "dt")

    def _recording(self, observations: Recording, dt: float | None) -> Demonstration:
        return as_demonstrations([observations], self._step(dt))[0]
