"""Size, colours and file format of all pictures."""

from typing import Any

from hil_emulator.pages import drawing
from hil_emulator.pages.palette import BLACK, BLUE, GREY, VERMILION

BEFORE, AFTER, FLOOR, MEASURED = VERMILION, BLUE, GREY, BLACK

WIDTH = 8.6
"""Width of a page's picture [inch]."""


_TICKS = 5
"""Largest number of intervals between ticks below each of several pictures side by side."""

NARROW = 4.0
"""Ratio of an axis's ends below which it stays linear."""


def figure(height: float, columns: int = 1, rows: int = 1, **options: Any) -> tuple[Any, Any]:
    """Return a picture of the page's width and its axes."""
    drawn, axes = drawing.subplots((WIDTH, height), rows, columns, **options)
    for one in axes.flat if hasattr(axes, "flat") else [axes]:
        one.spines[["top", "right"]].set_visible(False)
        one.tick_params(labelsize=8)
        if columns > 1:
            one.locator_params(axis="x", nbins=_TICKS)
    return drawn, axes


def png(drawn: Any) -> bytes:
    """Return a picture as PNG."""
    return drawing.png(drawn, 150)


def logarithmic(axis: Any, many: float = 100.0) -> None:
    """Give an axis a logarithmic scale with plain numbers that do not overlap.

    Args:
        axis: `axes.xaxis` or `axes.yaxis`.
        many: ratio of its ends above which only powers of ten are marked.

    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    low, high = axis.get_view_interval()
    if low > 0.0 and high / low < NARROW:
        return
    axis.axes.set_xscale("log") if axis.axis_name == "x" else axis.axes.set_yscale("log")
    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high / low < many else (1.0,)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
