"""`probdmp inspect`: what a model file holds."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from probdmp.cli.detector_summaries import detector_summary, print_detector
from probdmp.cli.exit_codes import UsageError
from probdmp.cli.options import Json
from probdmp.cli.output import print_json, print_line, print_table
from probdmp.cli.summaries import by_name, channel_noise, common_units, name_text, primitive_summary
from probdmp.cli.system import print_system, system_summary
from probdmp.cli.trajectories import with_unit

if TYPE_CHECKING:
    from probdmp.detection import FailureDetector
    from probdmp.io import ModelContents

__all__ = ["inspect"]


def inspect(
    model: Annotated[
        Path | None, typer.Argument(metavar="MODEL", help="Model file made by probdmp fit.", show_default=False)
    ] = None,
    system: Annotated[
        bool, typer.Option("--system", help="Show versions and what else a report of a problem should say, instead.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Show what a model file holds; or the system, with --system.

    Its primitives with their configuration and sensor noise, the failure detector, and where all this comes from.

    The file is checked first: that its digest, a SHA-256, belongs to its content. A damaged file gives exit code 3.
    """
    if system == (model is not None):
        raise UsageError("either a MODEL or --system", "both" if system else "neither", "Try: probdmp inspect --help")
    if model is None:
        summary = system_summary()
        print_json(summary) if as_json else print_system(summary)
        return
    from probdmp.detection import FailureDetector
    from probdmp.io import read_model

    contents = read_model(model)
    detector = None if contents.detector is None else FailureDetector.from_state(contents.detector, contents.primitives)
    document = _document(model, contents, detector)
    if as_json:
        print_json(document)
    else:
        _print_document(document)


def _document(model: Path, contents: "ModelContents", detector: "FailureDetector | None") -> dict[str, Any]:
    from probdmp.io.model_file import SCHEMA

    return {
        "model": str(model),
        "schema": SCHEMA,
        "digest": "valid",  # or it would not have been read
        "provenance": dict(contents.provenance),
        "primitives": [
            {**primitive_summary(label, primitive), "settings": contents.settings.get(label), "identity": primitive.identity}
            for label, primitive in contents.primitives.items()
        ],
        "detector": None if detector is None else detector_summary(detector),
    }


def _print_document(document: dict[str, Any]) -> None:
    made = ", ".join(f"{name} {value}" for name, value in document["provenance"].items())
    print_line(document["model"], style="bold")
    print_line(f"Schema {document['schema']}, digest {document['digest']}, {made}")
    primitives, detector = document["primitives"], document["detector"]
    units, channels = common_units(primitives), any(p["channels"] for p in primitives)
    print_table(
        [
            "primitive",
            "demos",
            "duration\n[s]",
            "dt\n[s]",
            with_unit("from\n", units),
            with_unit("to\n", units),
            with_unit("sensor noise\nstd", units),
            *(["channel noise\nstd"] if channels else []),
        ],
        [
            [
                name_text(p["label"]),
                str(p["demonstrations"]),
                f"{p['duration']:.3f}",
                f"{p['dt']:.4g}",
                *(by_name(p[key]) for key in ("start", "goal", "sensor_noise_stds")),
                *([channel_noise(p)] if channels else []),
            ]
            for p in primitives
        ],
    )
    for text, labels in _grouped({p["label"]: _configuration_text(p) for p in primitives}).items():
        print_line(f"{labels}: {text}" if len(primitives) > 1 else text)
    if detector is None:
        print_line("No failure detector.")
        return
    print_detector(detector)


def _configuration_text(primitive: dict[str, Any]) -> str:
    values = primitive["configuration"]
    left_out = f" (not {', '.join(primitive['not_scaled'])})" if primitive["not_scaled"] else ""
    return (
        f"{values['n_basis']} basis functions, {values['discretization']}, scaling {values['scaling']}{left_out}, "
        f"forcing noise {values['forcing_noise']}, coupling {values['coupling']}, alpha_z {values['alpha_z']:g}"
    )


def _grouped(texts: dict[str, str]) -> dict[str, str]:
    """Labels, joined, by the text they share."""
    groups: dict[str, list[str]] = {}
    for label, text in texts.items():
        groups.setdefault(text, []).append(name_text(label))
    return {text: ", ".join(labels) for text, labels in groups.items()}
