"""Pictures for a page or a file, drawn without a screen; matplotlib is imported on first use."""

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil_emulator.errors import UserError
from hil_emulator.platform.output_files import new_files

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COMPRESSION = {"compress_level": 3}
"""Of a PNG: half the time of the usual 6 for a few per cent more bytes."""


def subplots(
    size: tuple[float, float], rows: int = 1, columns: int = 1, **options: Any
) -> tuple["Figure", Any]:
    """Return a picture and its axes, as `Figure.subplots` does.

    Args:
        size: width and height [inch].
        rows: of axes.
        columns: of axes.
        options: of `Figure.subplots`.

    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, **options)


def png(figure: "Figure", dpi: float) -> bytes:
    """Return a picture as PNG, with so many dots per inch."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.image import imsave

    figure.set_dpi(dpi)
    canvas: Any = FigureCanvasAgg(figure)
    memory = io.BytesIO()
    # `savefig` would draw once for the layout, and once more
    canvas.draw()
    imsave(memory, canvas.buffer_rgba(), format="png", dpi=dpi, pil_kwargs=COMPRESSION)
    return memory.getvalue()


def check_format(file: Path) -> None:
    """Refuse a file without the ending of a picture format.

    Raises:
        UserError: with the possible endings.

    """
    from matplotlib.backend_bases import FigureCanvasBase

    formats = sorted(FigureCanvasBase.filetypes)
    if file.suffix[1:].lower() not in formats:
        endings = ", ".join(f".{ending}" for ending in formats)
        raise UserError(f"{file}: no format of a picture has this ending; take one of {endings}")


def save(figure: "Figure", file: Path, dpi: float = 110.0, *, overwrite: bool = False) -> None:
    """Write a picture in the format of the file's ending.

    Raises:
        UserError: if it exists or cannot be written.

    """
    try:
        with new_files(overwrite=overwrite) as staged:
            figure.savefig(staged(file), dpi=dpi)
    except ValueError as error:
        raise UserError(f"{file}: cannot be written: {error}") from None
