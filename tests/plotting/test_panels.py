"""What every picture has in common: legible in black and white, units on axes, nothing that has to be loaded."""

from functools import partial

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from probdmp.dmp import task_for
from probdmp.errors import InputError, MissingExtraError
from probdmp.evaluation import example_of, illustrate
from probdmp.evaluation.experiment import Experiment
from probdmp.execution import position_covariances, roll_out, smooth_recording, task_of_recording, track_recording
from probdmp.plotting.demonstrations import class_panels, demonstration_panels
from probdmp.plotting.example import example_panels
from probdmp.plotting.executions import smoothing_panels
from probdmp.plotting.failure_detection import failure_detection_panels
from probdmp.plotting.forcing import basis_panels, forcing_panels
from probdmp.plotting.monitoring import monitoring_panels
from probdmp.plotting.operating import onset_panels, operating_panels, plot_realized_rates
from probdmp.plotting.panels import Panel, save_panels, svg_of, tiled
from probdmp.plotting.style import LINES, MARKERS, SETTINGS, require_matplotlib, series
from probdmp.plotting.trajectories import band_panels, path_panel


@pytest.fixture(scope="module")
def every_panel(primitive, letters, blocked, judged, evaluation):
    task = task_for(primitive)
    planned = roll_out(primitive, task, primitive.dt)
    its_own = task_of_recording(primitive, blocked)
    tracked, smoothed = track_recording(primitive, its_own, blocked), smooth_recording(primitive, its_own, blocked)
    judge = evaluation.record().judges[0]
    return [
        *demonstration_panels(letters),
        *class_panels({"a": letters[:3], "": letters[3:]}),
        *basis_panels(primitive),
        *forcing_panels(primitive),
        *band_panels(planned, range(2)),
        path_panel("Path", planned, position_covariances(primitive, task, primitive.dt)),
        *smoothing_panels(blocked, tracked, smoothed),
        *monitoring_panels(planned, judged, onset=0.4),
        *operating_panels(judge),
        *onset_panels(judge.summary),
        Panel("Realised", partial(plot_realized_rates, realized=judge.realized)),
        *failure_detection_panels(illustrate(letters, Experiment(4, 3))),
    ]


def drawn(panel):
    with matplotlib.rc_context(SETTINGS):
        ax = Figure().subplots()
        panel.draw(ax)
        return ax


def lightness(color):
    """Roughly, from 0 to 1, as on a black-and-white print."""
    return float(np.dot(to_rgb(color), (0.299, 0.587, 0.114)))


def test_lines_differ_in_black_and_white(every_panel):
    """Lines that mean different things, which different legends or colours say, share line and mark in no picture."""
    for panel in every_panel:
        lines = drawn(panel).lines
        meanings = {}
        for line in lines:
            look = line.get_linestyle(), str(line.get_marker()), line._dash_pattern[1] and tuple(line._dash_pattern[1])
            meanings.setdefault(look, set()).add(line.get_color())
        for look, colors in meanings.items():
            tones = sorted(lightness(color) for color in colors)
            crosses_of_curves = look[1] == "X"
            assert len(colors) == 1 or crosses_of_curves or min(np.diff(tones)) > 0.3, (panel.title, look, colors)


def test_axes_say_what_they_show_and_in_which_unit(every_panel):
    without = {"Phase x", "Basis functions φ", "Test ratio", ""}
    for panel in every_panel:
        ax = drawn(panel)
        assert "[" in ax.get_xlabel(), panel.title
        assert "[" in ax.get_ylabel() or ax.get_ylabel() in without, panel.title
        assert panel.title


def test_the_first_35_of_several_lines_differ_in_more_than_colour():
    looks = {(str(s["linestyle"]), s["marker"]) for s in map(series, range(len(LINES) * len(MARKERS)))}
    assert len(looks) == 35
    marked = {(str(s["linestyle"]), s["marker"]) for s in (series(k, always_marked=True) for k in range(12))}
    assert len(marked) == 12


def test_the_same_picture_gives_the_same_bytes(tmp_path, letters):
    for suffix in (".svg", ".png", ".pdf"):
        for name in ("one", "two"):
            save_panels(tmp_path / f"{name}{suffix}", demonstration_panels(letters)[:2], 2, "heading")
        assert (tmp_path / f"one{suffix}").read_bytes() == (tmp_path / f"two{suffix}").read_bytes()


def test_other_formats_are_refused(tmp_path, every_panel):
    with pytest.raises(InputError, match=r"Expected suffix of a picture to be one of '\.svg', '\.png', '\.pdf', got '\.gif'"):
        save_panels(tmp_path / "a.gif", every_panel[:1], 1)


def test_panels_stand_in_rows(every_panel):
    with matplotlib.rc_context(SETTINGS):
        figure = tiled(every_panel[:5], 2, "heading")
    assert [ax.get_title(loc="left") for ax in figure.axes] == [panel.title for panel in every_panel[:5]]
    assert figure.axes[0].get_subplotspec().get_gridspec().get_geometry() == (3, 2)
    assert figure.get_suptitle() == "heading"


def test_titles_are_not_mathematics_and_any_letter_will_do():
    svg = svg_of(Panel("$\\frac{<script>$ 字", lambda ax: ax.plot([0, 1], [0, 1], label="_a")))
    assert "<script>" not in svg
    assert "&lt;script&gt;" in svg


def test_an_svg_for_a_page_loads_nothing(every_panel):
    svg = svg_of(every_panel[0])
    assert svg.startswith("<svg ")
    assert svg.endswith("</svg>")
    assert "http" not in svg
    assert "metadata" not in svg


def test_without_matplotlib_the_command_is_said(monkeypatch, every_panel, tmp_path):
    monkeypatch.setattr("probdmp.plotting.style.find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"pip install 'probdmp\[plot\]'"):
        require_matplotlib()
    with pytest.raises(MissingExtraError, match=r"pip install 'probdmp\[plot\]'"):
        save_panels(tmp_path / "a.svg", every_panel[:1], 1)


def test_an_example_is_drawn(evaluation):
    from probdmp import synthetic_letters

    example = example_of(evaluation, synthetic_letters(7, seed=2, letters="cl", dt=0.02))
    axes = [drawn(panel) for panel in example_panels(example)]
    for dof, ax in enumerate(axes[:-1]):
        lines = {line.get_label(): line for line in ax.lines}
        assert list(lines["hold"].get_ydata()) == list(example.recordings["hold"].positions[:, dof])
        assert list(lines["onset"].get_xdata()) == [example.onset] * 2
    ratios = {line.get_label(): line for line in axes[-1].lines}
    assert list(ratios["as recorded"].get_ydata()) == list(example.findings["undisturbed"].trace.test_ratios)
    assert list(ratios["threshold"].get_ydata()) == [1, 1]
