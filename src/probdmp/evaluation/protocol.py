"""The experiment from beginning to end: draw the trials of each seed, let every judge decide, count."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from probdmp.checks import check_choice
from probdmp.demonstrations import Demonstration
from probdmp.errors import InputError
from probdmp.evaluation.experiment import Experiment
from probdmp.evaluation.judges import DETECTORS, READINGS, Judge, Progress
from probdmp.evaluation.metrics import BOOTSTRAP, CLOPPER_PEARSON
from probdmp.evaluation.operating import has_traces, operating_curves, realized_rates
from probdmp.evaluation.outcomes import Assessment, Outcome
from probdmp.evaluation.record import EvaluationRecord, JudgeRecord
from probdmp.evaluation.summary import Summary, published_summary, summarize
from probdmp.evaluation.trials import draw_trials, group_by_label

__all__ = ["Evaluation", "evaluate"]


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """What came of an experiment."""

    experiment: Experiment
    by_seed: Mapping[int, Mapping[str, Assessment]]
    """By seed, then by judge."""

    @property
    def outcomes(self) -> dict[str, list[Outcome]]:
        """By judge, all seeds one after another."""
        splits = list(self.by_seed.values())
        return {name: [outcome for split in splits for outcome in split[name].outcomes] for name in splits[0]}

    def summaries(self) -> dict[str, Summary]:
        """The figures of each judge, over all seeds."""
        return {name: summarize(outcomes, len(self.by_seed)) for name, outcomes in self.outcomes.items()}

    def record(self, command: str = "") -> EvaluationRecord:
        """What is kept of it; with curves, if the judges kept their traces.

        Parameters
        ----------
        command : what to type to get the same figures.
        """
        experiment = self.experiment
        judges = tuple(self._judge_record(name, summary) for name, summary in self.summaries().items())
        return EvaluationRecord(
            classes=len({outcome.label for outcome in next(iter(self.outcomes.values()))}),
            train=experiment.train,
            test=experiment.test,
            seed=experiment.seed,
            seeds=experiment.seeds,
            detector=experiment.detector,
            task=experiment.task,
            false_alarm_rate=experiment.false_alarm_rate if any(j.calibrations for j in judges) else None,
            interval=CLOPPER_PEARSON if len(self.by_seed) == 1 else BOOTSTRAP,
            judges=judges,
            channels=experiment.channels,
            command=command,
        )

    def as_dict(self, command: str = "") -> dict[str, Any]:
        """The document that `probdmp evaluate --json` prints: the first judge at the top, then all of them."""
        experiment, record = self.experiment, self.record(command)
        figures = [{**judge.as_dict(), **_parts(judge.name), **self._per_seed(judge.name)} for judge in record.judges]
        first = group_by_label(next(iter(self.outcomes.values())))
        return {
            **{name: value for name, value in asdict(replace(record, judges=())).items() if name != "judges"},
            "configuration": {
                k: v for k, v in asdict(experiment.configuration_for(experiment.detector)).items() if k != "forcing_noise"
            },
            **figures[0],
            "readings": figures,
            "by_class": {label: _counts(members) for label, members in first.items()},
            "published": published_summary().as_dict(),
        }

    def _judge_record(self, name: str, summary: Summary) -> JudgeRecord:
        assessments, outcomes = [split[name] for split in self.by_seed.values()], self.outcomes[name]
        calibrations = {seed: facts for seed, split in self.by_seed.items() if (facts := split[name].calibrations)}
        if not has_traces(outcomes):
            return JudgeRecord(name, summary, calibrations)
        realized = tuple(realized_rates(assessments))
        return JudgeRecord(name, summary, calibrations, realized, operating_curves(outcomes, realized))

    def _per_seed(self, name: str) -> dict[str, Any]:
        """The figures of each seed, if there are several."""
        if len(self.by_seed) == 1:
            return {}
        each = [{"seed": seed, **summarize(split[name].outcomes).as_dict()} for seed, split in self.by_seed.items()]
        return {"per_seed": each}


def evaluate(
    demonstrations: Sequence[Demonstration],
    experiment: Experiment,
    judges: Mapping[str, Judge] | None = None,
    on_class: Progress = lambda label: None,
) -> Evaluation:
    """Run an experiment on labelled demonstrations.

    Parameters
    ----------
    judges : who decides, by name; those of `DETECTORS[experiment.detector]` unless given.
    on_class : called with its label after each class, for each judge and seed once or as often as `STAGES` says: for a
        progress bar.

    Raises
    ------
    TooFewDemonstrationsError
        If a class has too few demonstrations; all such classes are named.
    InputError
        If there is no such detector, or a judge does not judge every test execution.
    """
    if judges is None:
        judges = DETECTORS[check_choice(experiment.detector, "detector", DETECTORS)]
    by_seed = {}
    for seed in range(experiment.seed, experiment.seed + experiment.seeds):
        split = replace(experiment, seed=seed, seeds=1)
        trials = draw_trials(demonstrations, split)
        by_seed[seed] = {name: judge(trials, split, on_class) for name, judge in judges.items()}
        tests = [trial.label for trial in trials for _ in trial.tests]
        for name, assessment in by_seed[seed].items():
            if [outcome.label for outcome in assessment.outcomes] != tests:
                raise InputError(
                    f"from the judge {name!r} an outcome for each of {len(tests)} test executions, in the order of the trials",
                    f"{len(assessment.outcomes)}",
                    "outcomes_of puts the findings of a trial together.",
                )
    return Evaluation(experiment, by_seed)


def _parts(name: str) -> dict[str, str]:
    """What a reading of the paper consists of; nothing for other judges."""
    return next((asdict(reading) for reading in READINGS if reading.name == name), {})


def _counts(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    summary = summarize(outcomes)
    return {
        "n": summary.false_alarms.n,
        "false_alarms": summary.false_alarms.count,
        "detected": {fault: s.detected.count for fault, s in summary.faults.items() if s.detected is not None},
    }
