"""From what fills one pair of axes to a figure, a file, or a picture in a page."""

import io
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from probdmp.checks import check_choice
from probdmp.io import write_atomically
from probdmp.plotting.style import figure_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["FORMATS", "Panel", "save_panels", "svg_of", "tiled"]

FORMATS = (".svg", ".png", ".pdf")
"""Suffixes of picture files."""
RESOLUTION = 150
"""Dots per inch, of `.png`."""


@dataclass(frozen=True, slots=True)
class Panel:
    """One pair of axes: what is drawn there, and how large."""

    title: str
    draw: Callable[["Axes"], Any]
    width: float = 4.6
    """Inches."""
    height: float = 2.9


def tiled(panels: Sequence[Panel], columns: int, heading: str = "") -> "Figure":
    """A figure with the panels in rows, under a heading; the caller holds `figure_style()` until it is saved."""
    from matplotlib.figure import Figure

    columns = min(columns, len(panels))
    rows = [panels[k : k + columns] for k in range(0, len(panels), columns)]
    widths = [max(row[k].width for row in rows if k < len(row)) for k in range(columns)]
    heights = [max(panel.height for panel in row) for row in rows]
    figure = Figure(figsize=(sum(widths), sum(heights)), layout="constrained")
    grid = figure.add_gridspec(len(rows), columns, width_ratios=widths, height_ratios=heights)
    for i, row in enumerate(rows):
        for j, panel in enumerate(row):
            ax = figure.add_subplot(grid[i, j])
            panel.draw(ax)
            ax.set_title(panel.title)
    if heading:
        figure.suptitle(heading, x=0.01, horizontalalignment="left", fontsize=10, fontweight="bold")
    return figure


def save_panels(path: str | Path, panels: Sequence[Panel], columns: int, heading: str = "") -> None:
    """Write a picture, atomically; the same picture gives the same bytes.

    Parameters
    ----------
    path : its suffix says which of `FORMATS`.

    Raises
    ------
    InputError
        If the suffix is another.
    MissingExtraError
        If matplotlib is not installed.
    """
    suffix = check_choice(Path(path).suffix, "suffix of a picture", FORMATS)
    with figure_style():
        payload = _rendered(tiled(panels, columns, heading), suffix.removeprefix("."))
    write_atomically(path, payload)


def svg_of(panel: Panel) -> str:
    """A panel as an SVG element for a page; nothing in it has to be loaded."""
    with figure_style():
        text = _rendered(tiled([panel], 1), "svg").decode()
    svg = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.S)
    svg = re.sub(r' xmlns(:\w+)?="[^"]*"', "", svg).replace("xlink:href=", "href=")
    return svg.replace("<svg ", f'<svg role="img" aria-label="{escape(panel.title)}" ', 1).strip()


def _rendered(figure: "Figure", kind: str) -> bytes:
    buffer = io.BytesIO()
    undated: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")  # a box in its place says so
        figure.savefig(buffer, format=kind, dpi=RESOLUTION, metadata=undated.get(kind))
    return buffer.getvalue()
