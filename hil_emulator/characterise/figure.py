"""Style of the pictures: palette and axes."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter


def new_figure() -> Figure:
    """Return an empty figure, 8 by 4.5 inches."""
    return Figure(figsize=(8.0, 4.5), dpi=120, layout="constrained")


def label(axes: Axes, x: str, y: str, title: str = "") -> None:
    """Label both axes, with units, and draw a light grid."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(title, fontsize="medium", loc="left")
    axes.grid(True, which="both", linewidth=0.4, alpha=0.5)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def legend(axes: Axes) -> None:
    """Show the legend without a box."""
    axes.legend(frameon=False, fontsize="small")


def decade_axis(axes: Axes) -> None:
    """Write plain numbers at 1, 2 and 5 of every decade."""
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
