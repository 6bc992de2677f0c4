"""Pictures of effects, from the declarations, added to their page."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

from build_time.execute import GENERATED
from build_time.step_pictures import drawn, response
from hil_emulator.model.effects import CATALOGUE

PAGE = "reference/effects"
"""The page that the pictures are added to."""


def effects(folder: Path) -> None:
    """Draw every effect that a step on the reference machine shows at its typical size."""
    for effect in CATALOGUE:
        step = response(effect)
        if step.visible:
            drawn(step).savefig(folder / f"effect_{effect.name}.png", dpi=80.0)


MADE: tuple[Callable[[Path], None], ...] = (effects,)


def make(app: Sphinx) -> None:
    """Make everything before Sphinx reads the pages."""
    folder = Path(app.srcdir) / GENERATED
    folder.mkdir(exist_ok=True)
    for write in MADE:
        write(folder)


def add_pictures(app: Sphinx, page: str, source: list[str]) -> None:
    """Add the picture of each effect below its heading."""
    if page != PAGE:
        return

    def with_picture(heading: re.Match[str]) -> str:
        file = f"effect_{heading[1]}.png"
        if not (Path(app.srcdir) / GENERATED / file).is_file():
            return heading[0]
        return f"{heading[0]}\n\n![A step without and with {heading[1]}](/{GENERATED}/{file})"

    source[0] = re.sub(r"^### (\w+)$", with_picture, source[0], flags=re.MULTILINE)


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect both to the build."""
    app.connect("builder-inited", make)
    app.connect("source-read", add_pictures)
    return {"parallel_read_safe": True}
