"""`probdmp fit`: learn primitives and their failure detector from demonstrations."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from probdmp.cli.command_line import command_line
from probdmp.cli.detector_choice import FalseAlarmRate, Rule, calibrate, chosen_detector
from probdmp.cli.detector_summaries import calibration_text, detector_summary
from probdmp.cli.exit_codes import UsageError, usage
from probdmp.cli.fit_options import (
    By,
    Channels,
    Coupling,
    Discretization,
    ForcingNoise,
    Most,
    NBasis,
    Published,
    Scaling,
    Smoothing,
    WeightModel,
    WeightUncertainty,
)
from probdmp.cli.learning import checked_settings, learn, taught_by_fleet
from probdmp.cli.options import Columns, Jobs, Json, RecordingFiles, SampleStep, Topic, Trim, check_output, names_of
from probdmp.cli.output import print_json, print_line, print_table
from probdmp.cli.recordings import read_files
from probdmp.cli.sensor_file import read_sensor_file
from probdmp.cli.summaries import by_name, channel_noise, common_units, name_text, primitive_summary
from probdmp.cli.trajectories import with_unit

if TYPE_CHECKING:
    from probdmp.demonstrations import Demonstration
    from probdmp.estimator import ProbabilisticDMP

__all__ = ["fit"]


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
    topic: Topic = None,
    trim: Trim = False,
    n_basis: NBasis = 30,
    weight_model: WeightModel = None,
    weight_uncertainty: WeightUncertainty = None,
    forcing_noise: ForcingNoise = "predictive",
    discretization: Discretization = None,
    scaling: Scaling = None,
    smoothing: Smoothing = 0.05,
    published: Published = False,
    channels: Channels = None,
    coupling: Coupling = "full",
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
    by: By = None,
    most: Most = None,
    jobs: Jobs = 1,
    as_json: Json = False,
) -> None:
    """Learn primitives and their failure detector from demonstrations.

    One primitive for each label; with --label a single one. In several files without labels, those named alike but for a
    number are of one movement: a_1.csv, a_2.csv and b_1.csv make the primitives a and b.

    With --by primitive, from a .parquet file of any size: some executions of each primitive, spread over the file.

    The failure detector is
    calibrated on the same demonstrations, each judged by what the others teach, and saved with the primitives, so that probdmp
    monitor can judge executions.
    """
    check_output(output, ".probdmp")
    given: dict[str, Any] = {"forcing_noise": forcing_noise, "discretization": discretization, "scaling": scaling}
    given |= {"weight_model": weight_model, "weight_uncertainty": weight_uncertainty, "coupling": coupling}
    given["channels"] = None if channels is None else tuple(names_of(channels) or ())
    settings = checked_settings({"n_basis": n_basis, "smoothing": smoothing, **given}, published)
    detector = chosen_detector(rule, false_alarm_rate, settings)
    file = None if sensors is None else read_sensor_file(sensors)
    from probdmp.estimator import PrimitiveLibrary

    wanted = {"columns": names_of(columns), "dt": dt, "topic": topic, "trim": trim}
    demonstrations = _taught(files, by, most, label, wanted)
    library = PrimitiveLibrary(learn(demonstrations, settings, jobs))
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


def _taught(
    files: Sequence[Path], by: str | None, most: int | None, label: str | None, wanted: Mapping[str, Any]
) -> "dict[str, list[Demonstration]]":
    """Demonstrations by label, all that there are, or with `--by` some of a fleet's; what is left out is said."""
    from probdmp.evaluation import group_by_label

    if by is None:
        if most is not None:
            raise UsageError("--most with --by", "it alone", "Without --by, all recordings teach.")
        return group_by_label(read_files(files, label, **wanted))
    taught = taught_by_fleet(files, by, most, label, wanted)
    for reason, count in taught.left_out.items():
        print(f"probdmp: {count} of the chosen executions left out: {reason}", file=sys.stderr)
    return taught.demonstrations


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
