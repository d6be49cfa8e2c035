"""`probdmp fit`: learn primitives and their failure detector from demonstrations."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from probdmp.cli.command_line import command_line
from probdmp.cli.detector_choice import FalseAlarmRate, Rule, calibrate, chosen_detector
from probdmp.cli.detector_summaries import calibration_text, detector_summary
from probdmp.cli.exit_codes import UsageError, usage
from probdmp.cli.options import Columns, Json, RecordingFiles, SampleStep, check_output, names_of
from probdmp.cli.output import print_json, print_line, print_table
from probdmp.cli.progress import progress
from probdmp.cli.recordings import read_files
from probdmp.cli.sensor_file import read_sensor_file
from probdmp.cli.summaries import by_name, channel_noise, common_units, name_text, primitive_summary
from probdmp.cli.trajectories import with_unit
from probdmp.errors import InputError

if TYPE_CHECKING:
    from probdmp.demonstrations import Demonstration
    from probdmp.estimator import ProbabilisticDMP

__all__ = ["fit"]

DECIDED = dict.fromkeys(("discretization", "scaling", "weight_model", "weight_uncertainty"))
"""What --published leaves no choice of."""


def fit(
    context: typer.Context,
    files: RecordingFiles,
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="MODEL", help="Model file to write, such as letters.probdmp.", show_default=False
        ),
    ],
    label: Annotated[
        str | None, typer.Option(metavar="LABEL", help="Learn this movement only; recordings without a label are of it.")
    ] = None,
    columns: Columns = None,
    dt: SampleStep = None,
    n_basis: Annotated[int, typer.Option(metavar="N", help="Basis functions per degree of freedom.")] = 30,
    weight_model: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="hierarchical (the default): each demonstration has its own weights; pooled (the paper): all have the same.",
        ),
    ] = None,
    weight_uncertainty: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="joint (the default): weights stay for an execution; independent (the paper): redrawn at every step.",
        ),
    ] = None,
    forcing_noise: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="predictive: the forcing term strays from its weights as in the demonstrations; posterior: it does not.",
        ),
    ] = "predictive",
    discretization: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="exact (the default) or semi_implicit_euler."),
    ] = None,
    scaling: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="none (the default) or paper: the shape grows with the distance from start to goal. Needs "
            "--weight-model pooled --weight-uncertainty independent.",
        ),
    ] = None,
    smoothing: Annotated[
        float,
        typer.Option(
            metavar="FRACTION",
            help="Window of the smoothing filter, fraction of a demonstration, 0 to 0.5.",
        ),
    ] = 0.05,
    published: Annotated[
        bool,
        typer.Option(
            "--published",
            help="The paper's configuration: semi_implicit_euler, its scaling, pooled and independent weights.",
        ),
    ] = False,
    channels: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Sensor channels to learn with the movement, such as pen_force: what they should read, and how that varies "
            "with it. Needs the default weights.",
        ),
    ] = None,
    coupling: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Whether degrees of freedom, and channels, vary together: full, none, or auto: what makes demonstrations "
            "likelier given the others.",
        ),
    ] = "full",
    sensors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="What observes executions, and has observed the demonstrations: the detector is calibrated with these "
            "sensors. Default: positions and --channels.",
        ),
    ] = None,
    rule: Rule = None,
    false_alarm_rate: FalseAlarmRate = None,
    as_json: Json = False,
) -> None:
    """Learn primitives and their failure detector from demonstrations.

    One primitive for each label; with --label a single one. In several files without labels, those named alike but for a
    number are of one movement: a_1.csv, a_2.csv and b_1.csv make the primitives a and b.

    The failure detector is
    calibrated on the same demonstrations, each judged by what the others teach, and saved with the primitives, so that probdmp
    monitor can judge executions.
    """
    check_output(output, ".probdmp")
    given: dict[str, Any] = {"forcing_noise": forcing_noise, "discretization": discretization, "scaling": scaling}
    given |= {"weight_model": weight_model, "weight_uncertainty": weight_uncertainty, "coupling": coupling}
    given["channels"] = None if channels is None else tuple(names_of(channels) or ())
    settings = _settings({"n_basis": n_basis, "smoothing": smoothing, **given}, published)
    detector = chosen_detector(rule, false_alarm_rate, settings)
    file = None if sensors is None else read_sensor_file(sensors)
    from probdmp.estimator import PrimitiveLibrary
    from probdmp.evaluation import group_by_label

    demonstrations = group_by_label(read_files(files, names_of(columns), label, dt))
    library = PrimitiveLibrary(_learn(demonstrations, settings))
    calibrate(detector, library, demonstrations, file)
    with usage():
        library.save(output, detector, command_line(context))
    summaries = [_summary(name, learned) for name, learned in library.items()]
    if as_json:
        print_json({"model": str(output), "primitives": summaries, "detector": detector_summary(detector)})
    else:
        _print_summaries(summaries)
        for facts in detector.calibrations_:
            print_line(calibration_text(facts))
        print_line(f"Wrote {output}, with a failure detector (rule “{detector.rule}”).")


def _settings(given: Mapping[str, Any], published: bool) -> dict[str, Any]:
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


def _learn(
    demonstrations: Mapping[str, Sequence["Demonstration"]], settings: Mapping[str, Any]
) -> dict[str, "ProbabilisticDMP"]:
    from probdmp.estimator import ProbabilisticDMP

    library = {}
    with progress("Learning", len(demonstrations)) as done:
        for label, members in demonstrations.items():
            try:
                library[label] = ProbabilisticDMP(**settings).fit(members)
            except InputError as error:
                raise InputError(f"{error.expected} for {label!r}", error.got, error.hint) from error
            done(label)
    return library


def _summary(label: str, learned: "ProbabilisticDMP") -> dict[str, Any]:
    """What was learned and how well; errors are fractions of the range."""
    report, primitive = learned.fit_report_, learned.primitive_
    assert report is not None, "just fitted"
    errors, noise = report.reproduction_errors, report.observation_noise
    return {
        **primitive_summary(label, primitive),
        "reproduction_error": float((errors**2).mean() ** 0.5),
        "reproduction_errors": dict(zip(primitive.names, (errors**2).mean(axis=0) ** 0.5, strict=True)),
        "em_converged": None if noise is None else noise.converged,
        "em_iterations": None if noise is None else len(noise.log_likelihoods),
    }


def _print_summaries(summaries: Sequence[Mapping[str, Any]]) -> None:
    scaling = any(s["not_scaled"] for s in summaries)
    noise = with_unit("sensor noise\nstd", common_units(summaries))
    channels = any(s["channels"] for s in summaries)
    columns = ["primitive", "demos", "duration\n[s]", "rms error\n[% of range]", noise, "EM\niterations"]
    print_table(
        [*columns, *(["channel noise\nstd"] if channels else []), *(["not\nscaled"] if scaling else [])],
        [
            [
                name_text(s["label"]),
                str(s["demonstrations"]),
                f"{s['duration']:.3f}",
                f"{100 * s['reproduction_error']:.2f}",
                by_name(s["sensor_noise_stds"], width=24),
                "–"
                if s["em_iterations"] is None
                else f"{s['em_iterations']}" + ("" if s["em_converged"] else ", not converged"),
                *([channel_noise(s)] if channels else []),
                *([", ".join(s["not_scaled"])] if scaling else []),
            ]
            for s in summaries
        ],
    )
