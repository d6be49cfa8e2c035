"""Learning the primitives of `probdmp fit`, one after the other or in several processes."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from probdmp.cli.exit_codes import UsageError, usage
from probdmp.cli.progress import progress
from probdmp.errors import InputError

if TYPE_CHECKING:
    from probdmp.demonstrations import Demonstration
    from probdmp.estimator import ProbabilisticDMP
    from probdmp.fleet import Teaching

__all__ = ["checked_settings", "learn", "taught_by_fleet"]

DECIDED = dict.fromkeys(("discretization", "scaling", "weight_model", "weight_uncertainty"))
"""What --published leaves no choice of."""


def checked_settings(given: Mapping[str, Any], published: bool) -> dict[str, Any]:
    """Constructor arguments of ProbabilisticDMP, checked before any file is read."""
    from probdmp.dmp import Configuration
    from probdmp.estimator import ProbabilisticDMP
    from probdmp.learning import LearningOptions

    chosen = {name: value for name, value in given.items() if value is not None}
    if published and chosen.keys() & DECIDED:
        options = ", ".join("--" + name.replace("_", "-") for name in DECIDED)
        raise UsageError(f"--published, or any of {options}", "both", "The paper's configuration decides these.")
    base = ProbabilisticDMP.as_published() if published else ProbabilisticDMP()
    settings = base.get_params() | chosen
    with usage():
        Configuration(**{field.name: settings[field.name] for field in fields(Configuration)})
        LearningOptions(settings["weight_model"], settings["smoothing"], settings["channels"])
    if settings["channels"] and settings["weight_uncertainty"] != "joint":
        hint = "A forcing term that is redrawn at every step says nothing about the channels."
        raise UsageError("--weight-uncertainty joint with --channels", settings["weight_uncertainty"], hint)
    return settings


def learn(
    demonstrations: Mapping[str, Sequence["Demonstration"]], settings: Mapping[str, Any], jobs: int = 1
) -> dict[str, "ProbabilisticDMP"]:
    """Primitives by label.

    Parameters
    ----------
    jobs : processes; 1 is this one.
    """
    with progress("Learning", len(demonstrations)) as done:
        if jobs == 1:
            library = {}
            for label, members in demonstrations.items():
                library[label] = _learned(label, members, settings)
                done(label)
            return library
        from probdmp.fleet.work import process_pool

        with process_pool(min(jobs, len(demonstrations))) as pool:
            futures = {label: pool.submit(_learned, label, members, settings) for label, members in demonstrations.items()}
            for label, future in futures.items():
                future.result()
                done(label)
        return {label: future.result() for label, future in futures.items()}


def _learned(label: str, members: Sequence["Demonstration"], settings: Mapping[str, Any]) -> "ProbabilisticDMP":
    from probdmp.estimator import ProbabilisticDMP

    try:
        return ProbabilisticDMP(**settings).fit(members)
    except InputError as error:
        raise InputError(f"{error.expected} for {label!r}", error.got, error.hint) from error


def taught_by_fleet(
    files: Sequence[Path], by: str, most: int | None, label: str | None, wanted: Mapping[str, Any]
) -> "Teaching":
    """What `--by` learns from.

    Parameters
    ----------
    wanted : of `read_demonstrations`: columns, dt, topic, trim; of these, columns alone go with it.

    Raises
    ------
    UsageError
        If that is not one Parquet file, which has a rate of its own.
    """
    from probdmp.fleet import teaching_executions
    from probdmp.fleet.teaching import MOST_DEMONSTRATIONS

    others = [f"--{name}" for name in ("dt", "topic", "trim") if wanted[name] not in (None, False)]
    if len(files) != 1 or files[0].suffix.lower() != ".parquet" or others:
        got = f"{', '.join(others)} too" if others else " ".join(map(str, files))
        raise UsageError("--by with one .parquet file, which has its own rate", got, "See docs/how-to/fleet.md.")
    with progress("Reading", None) as done:
        chosen = MOST_DEMONSTRATIONS if most is None else most
        return teaching_executions(files[0], by, most=chosen, columns=wanted["columns"], label=label, on_part=done)
