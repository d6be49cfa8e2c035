"""Options of `probdmp fit`: how primitives are learned."""

from typing import Annotated

import typer

__all__ = [
    "By",
    "Channels",
    "Coupling",
    "Discretization",
    "ForcingNoise",
    "Most",
    "NBasis",
    "Published",
    "Scaling",
    "Smoothing",
    "WeightModel",
    "WeightUncertainty",
]

NBasis = Annotated[int, typer.Option("--n-basis", metavar="N", help="Basis functions per degree of freedom.")]
WeightModel = Annotated[
    str | None,
    typer.Option(
        "--weight-model",
        metavar="NAME",
        help="hierarchical (the default): each demonstration has its own weights; pooled (the paper): all have the same.",
    ),
]
WeightUncertainty = Annotated[
    str | None,
    typer.Option(
        "--weight-uncertainty",
        metavar="NAME",
        help="joint (the default): weights stay for an execution; independent (the paper): redrawn at every step.",
    ),
]
ForcingNoise = Annotated[
    str,
    typer.Option(
        "--forcing-noise",
        metavar="NAME",
        help="predictive: the forcing term strays from its weights as in the demonstrations; posterior: it does not.",
    ),
]
Discretization = Annotated[
    str | None,
    typer.Option("--discretization", metavar="NAME", help="exact (the default) or semi_implicit_euler."),
]
Scaling = Annotated[
    str | None,
    typer.Option(
        "--scaling",
        metavar="NAME",
        help="none (the default) or paper: the shape grows with the distance from start to goal. Needs "
        "--weight-model pooled --weight-uncertainty independent.",
    ),
]
Smoothing = Annotated[
    float,
    typer.Option(
        "--smoothing",
        metavar="FRACTION",
        help="Window of the smoothing filter, fraction of a demonstration, 0 to 0.5.",
    ),
]
Published = Annotated[
    bool,
    typer.Option(
        "--published",
        help="The paper's configuration: semi_implicit_euler, its scaling, pooled and independent weights.",
    ),
]
Channels = Annotated[
    str | None,
    typer.Option(
        "--channels",
        metavar="NAMES",
        help="Sensor channels to learn with the movement, such as pen_force: what they should read, and how that varies "
        "with it. Needs the default weights.",
    ),
]
Coupling = Annotated[
    str,
    typer.Option(
        "--coupling",
        metavar="NAME",
        help="Whether degrees of freedom, and channels, vary together: full, none, or auto: what makes demonstrations "
        "likelier given the others.",
    ),
]
By = Annotated[
    str | None,
    typer.Option(
        "--by",
        metavar="COLUMN",
        help="Learn from one .parquet file, piece by piece; the column says what movement is executed.",
    ),
]
Most = Annotated[
    int | None,
    typer.Option("--most", min=2, metavar="N", help="With --by: executions that teach each primitive, at most. Default: 100."),
]
