"""Failure detectors: what is normal for each primitive, the same online and over recordings."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import FloatArray, check_choice
from probdmp.demonstrations import Demonstration, Recordings, as_demonstrations
from probdmp.detection.batch import BatchJudgement
from probdmp.detection.calibrated_monitor import CalibratedMonitor
from probdmp.detection.calibrated_rule import CalibratedRule
from probdmp.detection.calibration_facts import CalibrationFacts
from probdmp.detection.library import Learned, Library, own_tasks
from probdmp.detection.monitoring import LikelihoodMonitor
from probdmp.detection.options import DetectorOptions
from probdmp.detection.paper_rule import PaperRule
from probdmp.detection.recorded_signals import RecordedSignals
from probdmp.detection.thresholds import PaperThreshold
from probdmp.detection.trajectory_family import tells_goal
from probdmp.detection.verdict import Verdict
from probdmp.dmp import Primitive, Task, stack_tasks, unstack_tasks
from probdmp.errors import InputError, InputTypeError, NotFittedError
from probdmp.execution import ExecutionBatch, Observed, Sensor, SensorArray, check_tasks
from probdmp.execution.plain_sensors import sensors_as_plain, sensors_from_plain
from probdmp.parameters import HasParameters

__all__ = ["FailureDetector"]

RULES = ("calibrated", "paper")


class FailureDetector(HasParameters):
    """Decides, while a movement runs or over its recording, whether it is still the movement that was taught.

    Parameters
    ----------
    false_alarm_rate : alpha, the share of normal executions that may be called failed.
    rule : `"calibrated"`: the threshold that this rate asks for; `"paper"`: failed when the log-likelihood falls below twice
        its minimum over the training demonstrations, whatever the rate.
    statistic : of the calibrated rule: `"trajectory"`: where the execution is, how it has moved, whether it stands still;
        `"log_likelihood"`, `"nis"` or `"cusum"` of the filter's innovations.
    calibration : of the calibrated rule: `"leave_one_out"`: each training demonstration is judged by what the others teach;
        `"held_out"`: the demonstrations given to `fit` are others than those that taught.
    pooled : whether the primitives of a library share one threshold, so that few demonstrations of each are enough.
    persistence : moments in a row (hundredths of the duration for `"trajectory"`, samples otherwise) that must be above the
        threshold. Every one more makes the alarm that much later, and rarer.
    likelihood : of the paper's rule: `"per_step"`: of each step by itself; `"cumulative"`: of all steps so far. The paper does
        not say which.

    Attributes
    ----------
    primitives_ : the primitives by label.
    sensors_ : what observes executions; None: positions and learned channels.
    offset_ : -1, what `score_samples` has to fall below: minus the test ratio of an alarm.
    """

    _kind_of_estimator = "outlier_detector"
    offset_ = -1.0

    def __init__(
        self,
        false_alarm_rate: float = 0.01,
        *,
        rule: str = "calibrated",
        statistic: str = "trajectory",
        calibration: str = "leave_one_out",
        pooled: bool = True,
        persistence: int = 1,
        likelihood: str = "per_step",
    ) -> None:
        self.false_alarm_rate, self.rule, self.statistic, self.calibration = false_alarm_rate, rule, statistic, calibration
        self.pooled, self.persistence, self.likelihood = pooled, persistence, likelihood

    def fit(
        self,
        learned: Primitive | Learned | Mapping[str, Primitive | Learned],
        demonstrations: Recordings | Mapping[str, Recordings],
        dt: float | None = None,
        tasks: Sequence[Task] | Mapping[str, Sequence[Task]] | None = None,
        on_part: Callable[[str, int], None] = lambda label, n_parts: None,
        sensors: Sequence[Sensor] | None = None,
    ) -> Self:
        """Learn what is normal.

        Parameters
        ----------
        learned : a learned primitive, or a library of them by label; demonstrations and tasks then come by label too.
        demonstrations : those that taught it; with `calibration="held_out"`, others.
        dt : seconds between samples of bare arrays; as learned unless given.
        tasks : what each demonstration was asked to do. Unless given, the detector prepares for executions that are told
            nothing but their start, and, where it is calibrated, for those that are told their goal and duration as well.
        on_part : of the calibrated rule, for a progress bar: called after each part of the calibration with the label it was
            about and the number of all parts.
        sensors : what observes executions, and has observed the demonstrations; positions and learned channels unless given.
            Positions and channels are judged as a trajectory, other sensors by the innovations of the filter.
        """
        check_choice(self.rule, "rule", RULES)
        library = Library.of(learned, demonstrations, dt, tasks, sensors)
        rule: CalibratedRule | PaperRule
        if self.rule == "paper":
            rule = PaperRule.fit(self.likelihood, library)
        else:
            options = self._options()
            library.check_taught(options.calibration == "leave_one_out")
            rule = CalibratedRule.fit(options, library, on_part)
        # Together, and only now: a fit that fails leaves the detector as it was.
        self.rule_, self.primitives_ = rule, {label: member.primitive for label, member in library.members.items()}
        self.sensors_ = None if sensors is None else tuple(sensors)
        self._arrays = library.arrays
        return self

    @property
    def calibrations_(self) -> tuple[CalibrationFacts, ...]:
        """Each threshold, where it comes from and how far it may be trusted; none with the paper's rule."""
        rule = self._fitted()
        return rule.facts if isinstance(rule, CalibratedRule) else ()

    @property
    def thresholds_(self) -> Mapping[str, PaperThreshold]:
        """With the paper's rule, that of each primitive by its identity; none where it is calibrated."""
        rule = self._fitted()
        return rule.thresholds if isinstance(rule, PaperRule) else {}

    def calibration_for(self, primitive: Primitive, task: Task) -> CalibrationFacts | None:
        """That of one execution; None with the paper's rule."""
        label = "" if self.pooled else next(name for name, p in self.primitives_.items() if p.identity == primitive.identity)
        known = "known" if tells_goal(task) else "nominal"
        return next((facts for facts in self.calibrations_ if (facts.task, facts.label) == (known, label)), None)

    def monitor(
        self, primitive: Primitive, task: Task, dt: float, outputs: tuple[str, ...] | None = None
    ) -> CalibratedMonitor | LikelihoodMonitor:
        """A fresh judge for one execution of a primitive, which the detector must have been fitted to.

        Parameters
        ----------
        outputs : names of what the sensors of the execution measure; those that the detector was fitted with, unless given.
        """
        rule = self._fitted()
        self._check_known(primitive)
        fitted = self._arrays[primitive.identity].outputs
        if outputs is not None and outputs != fitted:
            hint = "Give fit(…, sensors=…) those that observe executions; what is normal depends on them."
            raise InputError(f"an execution observed by {', '.join(fitted)}, as in calibration", ", ".join(outputs), hint)
        return rule.monitor(primitive, task, dt)

    def replay(
        self, primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration]
    ) -> Iterator[tuple[CalibratedMonitor | LikelihoodMonitor, Iterator[Observed]]]:
        """For each recording a fresh judge and what an execution would have shown it, to be passed to its `update`."""
        return self._fitted().replay(primitive, tasks, recordings)

    def verdicts(self, executions: Recordings, dt: float | None = None, tasks: Sequence[Task] | None = None) -> list[Verdict]:
        """A verdict for each recorded execution; with a library, the label of an execution says which primitive it runs.

        Parameters
        ----------
        dt, tasks : as in `fit`, one task for each execution; unless given, it was told nothing but its start.
        """
        self._fitted()
        dts = {primitive.dt for primitive in self.primitives_.values()}
        recordings = as_demonstrations(executions, dts.pop() if dt is None and len(dts) == 1 else dt)
        if tasks is not None:
            check_tasks(tasks, recordings)
        verdicts: dict[int, Verdict] = {}
        for label, members in self._members(recordings).items():
            primitive, chosen = self.primitives_[label], [recordings[k] for k in members]
            asked = [tasks[k] for k in members] if tasks is not None else own_tasks(primitive, chosen)
            verdicts |= zip(members, self._verdicts(primitive, asked, chosen), strict=True)
        return [verdicts[k] for k in range(len(recordings))]

    def judge(self, primitive: Primitive, batch: ExecutionBatch) -> BatchJudgement:
        """Verdicts on many executions of one primitive at once, as arrays; those of `verdicts` are the same."""
        rule = self._fitted()
        self._check_known(primitive)
        array = self._arrays[primitive.identity]
        judgement = rule.judge(primitive, batch.tasks, lambda: RecordedSignals.of_batch(array, batch))
        if judgement is not None:
            return BatchJudgement.of_judgement(judgement, rule.watched(primitive))
        return BatchJudgement.of(self._replayed(primitive, unstack_tasks(batch.tasks), list(batch.recordings(array))))

    def predict(
        self, executions: Recordings, dt: float | None = None, tasks: Sequence[Task] | None = None
    ) -> NDArray[np.int64]:
        """(N,) array: +1 for a fine execution, -1 for a failed one; arguments as in `verdicts`."""
        return np.array([-1 if verdict.failed else 1 for verdict in self.verdicts(executions, dt, tasks)], dtype=np.int64)

    def score_samples(self, executions: Recordings, dt: float | None = None, tasks: Sequence[Task] | None = None) -> FloatArray:
        """(N,) array: minus the test ratio of each verdict, so that higher is more normal; arguments as in `verdicts`.

        The ratio is that of the first alarm, or the largest without one. Where it was above 1, but not for long enough to
        be an alarm (`persistence`), it counts as 1.
        """
        verdicts = self.verdicts(executions, dt, tasks)
        return np.array([-(v.test_ratio if v.failed else min(v.test_ratio, 1.0)) for v in verdicts], dtype=np.float64)

    def decision_function(
        self, executions: Recordings, dt: float | None = None, tasks: Sequence[Task] | None = None
    ) -> FloatArray:
        """(N,) array: `score_samples` less `offset_`, negative for a failed execution; arguments as in `verdicts`."""
        return self.score_samples(executions, dt, tasks) - self.offset_

    def state(self) -> dict[str, Any]:
        """What a model file keeps, as plain values."""
        learned = self._fitted().state()
        return {"rule": self.rule, "sensors": None if self.sensors_ is None else sensors_as_plain(self.sensors_), **learned}

    @classmethod
    def from_state(cls, state: object, primitives: Mapping[str, Primitive]) -> Self:
        """A fitted detector from its state and the primitives it was fitted to, by label.

        Raises
        ------
        InputError, InputTypeError
            If the state is not one, or that of a detector for other primitives.
        """
        if not isinstance(state, Mapping):
            raise InputTypeError("the state of a detector as a mapping", f"{state!r:.100}")
        parts = dict(state)
        rule = check_choice(parts.pop("rule", None), "rule", RULES)
        if "sensors" not in parts:
            raise InputError("the state of a detector with the sensors it was fitted with", f"{state!r:.200}")
        plain = parts.pop("sensors")
        detector = cls(rule=rule)
        primitives = detector.primitives_ = dict(primitives)  # one that can be copied and sent elsewhere
        sensors = None if plain is None else sensors_from_plain(plain, next(iter(primitives.values())))
        arrays = {primitive.identity: SensorArray(primitive, sensors) for primitive in primitives.values()}
        detector.sensors_, detector._arrays = sensors, arrays
        if rule == "paper":
            detector.rule_ = PaperRule.from_state(parts, primitives, arrays)
            detector.likelihood = detector.rule_.likelihood
        else:
            detector.rule_ = CalibratedRule.from_state(parts, primitives, arrays)
            for name, value in parts["options"].items():
                setattr(detector, name, value)
        return detector

    def _check_known(self, primitive: Primitive) -> None:
        if primitive.identity not in {own.identity for own in self.primitives_.values()}:
            hint = "Learned anew? Fit the detector again too."
            raise InputError("a primitive that this detector was fitted to", "another one", hint)

    def _verdicts(self, primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration]) -> list[Verdict]:
        """On recordings of one primitive."""
        rule, array = self._fitted(), self._arrays[primitive.identity]
        judgement = rule.judge(primitive, stack_tasks(tasks), lambda: RecordedSignals.of(array, recordings))
        if judgement is None:
            return self._replayed(primitive, tasks, recordings)
        names = rule.watched(primitive)
        return [judgement.verdict(k, names) for k in range(len(recordings))]

    def _replayed(self, primitive: Primitive, tasks: Sequence[Task], recordings: Sequence[Demonstration]) -> list[Verdict]:
        """The same, each shown to a monitor tick by tick."""
        verdicts = []
        for monitor, ticks in self.replay(primitive, tasks, recordings):
            for observed in ticks:
                monitor.update(observed)
            verdicts.append(monitor.verdict)
        return verdicts

    def _options(self) -> DetectorOptions:
        return DetectorOptions(self.false_alarm_rate, self.statistic, self.calibration, self.pooled, self.persistence)

    def _fitted(self) -> CalibratedRule | PaperRule:
        if not hasattr(self, "rule_"):
            raise NotFittedError("a fitted detector", "one without thresholds", "Call fit(primitive, demonstrations) first.")
        return self.rule_

    def _members(self, recordings: Sequence[Demonstration]) -> dict[str, list[int]]:
        """Which recordings are executions of which primitive; one that is alone needs no label."""
        alone = next(iter(self.primitives_)) if len(self.primitives_) == 1 else None
        members: dict[str, list[int]] = {}
        for k, recording in enumerate(recordings):
            label = alone if alone is not None and "" in (alone, recording.label) else recording.label
            if label not in self.primitives_:
                raise InputError(f"executions labelled as one of {sorted(self.primitives_)}", repr(label))
            members.setdefault(label, []).append(k)
        return members
