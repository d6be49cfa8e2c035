"""The report of a model: what was learned, from what, and how far its failure detector can be trusted."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from html import escape
from typing import Any

from probdmp.detection import FailureDetector
from probdmp.dmp import Primitive, task_for
from probdmp.execution import position_covariances, roll_out
from probdmp.plotting.forcing import forcing_panels
from probdmp.plotting.page import code, definitions, figure, heading, note, page, paragraph, table
from probdmp.plotting.panels import Panel
from probdmp.plotting.report_tables import FLAGGED, calibration_table, percent
from probdmp.plotting.style import require_matplotlib
from probdmp.plotting.trajectories import path_panel, plot_rollout

__all__ = ["ModelReport", "model_page"]

MOST_DOFS = 8
"""Degrees of freedom that are drawn of each primitive."""
PATH_CAPTION = """The path of {x} and {y} as planned from the learned start to the learned goal, in the tube where executions
pass (two standard deviations)."""
BANDS_CAPTION = """Positions as planned, with 95 % bands; and the forcing term with its 95 % bands{cut}."""
NO_DETECTOR = """The file has no failure detector."""
VOUCHES = """The detector was asked for {asked} false alarms per execution. {n} calibration executions can vouch for no less
than {attainable}, so {verdict}."""
CAPTION = f"""α is per execution. <em>Known</em>: for executions that are told their goal and duration; <em>nominal</em>: for
those told their start only. <em>Attainable</em>: the least rate that n calibration executions can vouch for, 1 / (n + 1).
{FLAGGED}"""
MADE = {
    "Duration, from, to": "Means over the demonstrations.",
    "Sensor noise": "Standard deviation of single measurements around the movement, as learned from the demonstrations.",
    "Bands": "1.96 standard deviations on either side of the mean of a rollout: the model's own, not counted on recordings.",
    "Path": "The mean, and for each time the ellipse of two standard deviations of where executions then are, with what "
    "degrees of freedom share if weights are joint. An ellipse holds 86 %.",
    "Forcing term": "Mean and variance of what shapes the movement, over the phase of one execution at the learned duration.",
}
MADE_CALIBRATED = {
    "Threshold": "In nats of surprise: minus the logarithm of the share of calibration executions that ever were as extreme. "
    "Leave-one-out: each demonstration was judged by what the others teach.",
}
MADE_PAPER = {
    "Threshold": "Twice the least log-likelihood of the demonstrations, with positions in units of their range. It promises no "
    "rate of false alarms.",
}


@dataclass(frozen=True, slots=True)
class ModelReport:
    """What a report of a model is made from."""

    name: str
    """Of the file."""
    primitives: Mapping[str, Primitive]
    """By label."""
    drawn: tuple[str, ...]
    """Labels of those that get pictures."""
    detector: FailureDetector | None
    provenance: Mapping[str, str] = field(default_factory=dict)
    """As in the model file; `"command"`, if it is there, makes the model again."""
    command: str = ""
    """What makes the page again."""


def model_page(report: ModelReport, on_primitive: Callable[[str], Any] = lambda label: None) -> str:
    """The page as HTML.

    Parameters
    ----------
    on_primitive : called with its label after each primitive, for a progress bar.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    require_matplotlib()
    parts = [paragraph(_introduction(report)), heading("What was learned"), _primitives_table(report.primitives)]
    parts += [heading("Failure detector"), *_detector(report.detector)]
    for label in report.drawn:
        primitive = report.primitives[label]
        parts += [heading(_named(label)), note(_configuration(primitive)), _pictures(primitive)]
        on_primitive(label)
    made = MADE | ({} if report.detector is None else MADE_PAPER if report.detector.rule == "paper" else MADE_CALIBRATED)
    parts += [heading("How each number was made"), definitions(made), heading("Make it again"), *_commands(report)]
    return page(f"Probabilistic Dynamic Movement Primitives: {report.name}", parts)


def _introduction(report: ModelReport) -> str:
    n, total = len(report.primitives), sum(primitive.n_demonstrations for primitive in report.primitives.values())
    movements = "One movement" if n == 1 else f"{n} movements"
    made = [escape(f"{name} {report.provenance[name]}") for name in ("probdmp", "created") if name in report.provenance]
    return f"{movements}, learned from {total} demonstrations in all." + (f" Made by {', '.join(made)}." if made else "")


def _primitives_table(primitives: Mapping[str, Primitive]) -> str:
    heads = ("Primitive", "Demos", "Duration [s]", "Time step [s]", "Degrees of freedom", "From", "To", "Sensor noise, std")
    rows = [
        [
            _named(label),
            str(p.n_demonstrations),
            f"{p.duration:.3f}",
            f"{p.dt:.4g}",
            f"{', '.join(p.names)}\nin {p.units or 'data units'}",
            *(", ".join(f"{value:.3g}" for value in values) for values in (p.start, p.goal, p.observation_variances**0.5)),
        ]
        for label, p in primitives.items()
    ]
    return table(heads, rows)


def _configuration(primitive: Primitive) -> str:
    c = primitive.configuration
    model = "hierarchical" if primitive.variation is not None else "pooled"
    return escape(
        f"{primitive.n_demonstrations} demonstrations, {c.n_basis} basis functions, weights {model} and "
        f"{c.weight_uncertainty}, {c.discretization}, scaling {c.scaling}, forcing noise {c.forcing_noise}, "
        f"alpha_z {c.alpha_z:g}."
    )


def _pictures(primitive: Primitive) -> str:
    """The path, then what belongs to each degree of freedom."""
    task = task_for(primitive)
    planned, covariances = roll_out(primitive, task, primitive.dt), position_covariances(primitive, task, primitive.dt)
    shown = range(min(primitive.n_dof, MOST_DOFS))
    forcing = forcing_panels(primitive)[: len(shown)]
    panels = [Panel(f"{primitive.names[k]}: position", partial(plot_rollout, rollout=planned, dof=k)) for k in shown]
    panels += [Panel(f"{panel.title}: forcing term", panel.draw) for panel in forcing]
    cut = "" if len(shown) == primitive.n_dof else f", of the first {len(shown)} of {primitive.n_dof} degrees of freedom"
    bands = figure(panels, BANDS_CAPTION.format(cut=cut))
    if primitive.n_dof < 2:
        return bands
    x, y = map(escape, primitive.names[:2])
    return figure([path_panel("Path", planned, covariances)], PATH_CAPTION.format(x=x, y=y)) + bands


def _detector(detector: FailureDetector | None) -> list[str]:
    if detector is None:
        return [paragraph(NO_DETECTOR)]
    if detector.rule == "paper":
        thresholds = {label: detector.thresholds_[p.identity] for label, p in detector.primitives_.items()}
        rows = [[_named(label), f"{t.minimum:.2f}", f"{t.level:.2f}"] for label, t in thresholds.items()]
        text = f"The paper's rule, log-likelihood {detector.likelihood.replace('_', ' ')}. It promises no rate of false alarms."
        return [paragraph(escape(text)), table(("Primitive", "Least in training [nats]", "Failed below [nats]"), rows)]
    facts = detector.calibrations_
    worst = max(facts, key=lambda one: one.attainable_rate)
    kept = worst.attainable_rate <= worst.false_alarm_rate
    vouches = VOUCHES.format(
        asked=percent(worst.false_alarm_rate),
        n=worst.n,
        attainable=percent(worst.attainable_rate),
        verdict="the rate is attainable" if kept else "the rate rests on a fitted tail and is <strong>not vouched for</strong>",
    )
    return [paragraph(vouches), calibration_table({0: facts}, by_seed=False), note(CAPTION)]


def _commands(report: ModelReport) -> list[str]:
    learned = report.provenance.get("command", "")
    unknown = [] if learned else [note("How the model was learned is not in the file: it was saved from Python, or long ago.")]
    commands = [command for command in (learned, report.command) if command]
    return [*unknown, *([code(*commands)] if commands else [])]


def _named(label: str) -> str:
    return f"“{label}”" if label else "The movement"
