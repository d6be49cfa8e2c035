"""One style for all pictures: few colours that differ in lightness too, lines that differ in more than colour."""

from contextlib import AbstractContextManager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from probdmp.errors import MissingExtraError
from probdmp.execution.trajectory import HALF_BAND

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "ALARM",
    "BAND",
    "FAINT",
    "FAULTY",
    "MEAN",
    "RECORDED",
    "WIDER_BAND",
    "axis_label",
    "band",
    "figure_style",
    "legend_beside",
    "mark_onset",
    "require_matplotlib",
    "series",
]

MEAN = "#1f3a5f"
BAND = "#9db8d9"
WIDER_BAND = "#dde7f3"
RECORDED = "#2f7d4f"
FAULTY = "#c1440e"
ALARM = "#7a1fa2"
FAINT = "0.65"

SERIES = (MEAN, FAULTY, RECORDED, ALARM, "#8c6d1f", "#4a90b8", "#5f5f5f")
LINES = ("-", "--", "-.", (0, (1, 1)), (0, (5, 1, 1, 1, 1, 1)))
MARKERS = ("none", "o", "s", "^", "D", "v", "P")
MARK_EVERY = 0.17
"""Of the length of a line; marks of neighbours do not fall on one another."""

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
    "legend.handlelength": 2.6,
    "lines.linewidth": 1.5,
    "svg.fonttype": "path",
    "svg.hashsalt": "probdmp",
    "text.parse_math": False,  # labels come from files: a $ in them is a $
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


def series(k: int, always_marked: bool = False) -> dict[str, Any]:
    """How the line of the k-th of several things is drawn: no two of the first 35 share line and marker.

    Parameters
    ----------
    always_marked : for lines of few points, each of which is marked.
    """
    n_lines = len(LINES)
    drawn: dict[str, Any] = {"color": SERIES[k % len(SERIES)], "linestyle": LINES[k % n_lines], "markersize": 4.5}
    if always_marked:
        return drawn | {"marker": MARKERS[1 + (k + 2 * (k // n_lines)) % (len(MARKERS) - 1)]}
    return drawn | {"marker": MARKERS[k // n_lines % len(MARKERS)], "markevery": (0.03 * (k % n_lines), MARK_EVERY)}


def axis_label(name: str, units: str, per: str = "") -> str:
    """A name and its unit, such as `x velocity [mm/s]`.

    Parameters
    ----------
    units : of the positions; those of the data where nothing is known of them.
    per : how the unit goes on.
    """
    return f"{name} [{units or 'data units'}{per}]"


def band(ax: "Axes", times: Any, means: Any, stds: Any, is_backdrop: bool = False) -> "Axes":
    """A mean with its 95 % band.

    Parameters
    ----------
    is_backdrop : whether the mean is thin and dotted, since other lines matter more.
    """
    half = HALF_BAND * stds
    ax.fill_between(times, means - half, means + half, color=BAND, alpha=0.6, linewidth=0, label="95 % band")
    line, width = (":", 1.0) if is_backdrop else ("-", 1.5)
    ax.plot(times, means, color=MEAN, linestyle=line, linewidth=width)
    return ax


def mark_onset(ax: "Axes", onset: float | None) -> None:
    """A grey line where a fault begins, seconds, if it is known."""
    if onset is not None:
        ax.axvline(onset, color="0.55", linewidth=1, linestyle=(0, (6, 3)), label="onset")


def legend_beside(ax: "Axes") -> None:
    """Where no line runs."""
    ax.legend(loc="upper left", bbox_to_anchor=(1, 1))
