"""One style for all pictures: few colours that differ in lightness too, so that they survive black-and-white print."""

from contextlib import AbstractContextManager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from probdmp.errors import MissingExtraError
from probdmp.execution.trajectory import HALF_BAND

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["ALARM", "BAND", "FAULTY", "MEAN", "RECORDED", "band", "figure_style", "require_matplotlib", "series"]

MEAN = "#1f3a5f"
BAND = "#9db8d9"
RECORDED = "#2f7d4f"
FAULTY = "#c1440e"
ALARM = "#7a1fa2"

SERIES = (MEAN, FAULTY, RECORDED, ALARM, "#8c6d1f", "#4a90b8", "#5f5f5f")
LINES = ("-", "--", "-.", (0, (1, 1)), (0, (5, 1, 1, 1, 1, 1)))

SETTINGS: Any = {
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.labelsize": 9,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "font.family": "DejaVu Sans",
    "legend.fontsize": 8,
    "legend.edgecolor": "none",
    "legend.framealpha": 0.85,
    "lines.linewidth": 1.5,
    "svg.fonttype": "path",
    "svg.hashsalt": "probdmp",
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
}


def require_matplotlib() -> None:
    """Refuse, with the command to type, where matplotlib is not installed."""
    if find_spec("matplotlib") is None:
        raise MissingExtraError("matplotlib for plots", "none installed", "Type: pip install 'probdmp[plot]'")


def figure_style() -> AbstractContextManager[None]:
    """The style, as a context."""
    require_matplotlib()
    import matplotlib

    return matplotlib.rc_context(SETTINGS)


def series(k: int) -> dict[str, Any]:
    """How the line of the k-th of several things is drawn; neighbours differ in more than colour."""
    return {"color": SERIES[k % len(SERIES)], "linestyle": LINES[k % len(LINES)]}


def band(ax: "Axes", times: Any, means: Any, stds: Any, label: str | None = None) -> "Axes":
    """A mean with its 95 % band."""
    half = HALF_BAND * stds
    ax.fill_between(times, means - half, means + half, color=BAND, alpha=0.6, linewidth=0, label=label)
    ax.plot(times, means, color=MEAN)
    return ax
