"""A directive whose Python is run when a page is built, and shown with what it prints.

    ```{run}
    :picture: figure
    figure = ...
    ```

The blocks of a page share their names; `docs` is the folder of the pages. A picture is anything
with `png` or `savefig`.
"""

import contextlib
import io
import tempfile
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

GENERATED = "generated"
"""Folder of what is made when the pages are built; not kept."""


class Run(SphinxDirective):
    """Runs its content: an exception ends the build."""

    has_content = True
    option_spec: ClassVar[dict[str, Any]] = {"picture": str}

    def run(self) -> list[nodes.Node]:
        """Return the code, what it printed, and its picture."""
        code = "\n".join(self.content)
        page = self.env.docname
        names = self.env.temp_data.setdefault("names of run", {"docs": Path(self.env.srcdir)})
        printed = _executed(code, names, f"{page}, line {self.lineno}")
        shown: list[nodes.Node] = [nodes.literal_block(code, code, language="python")]
        if printed:
            shown.append(nodes.literal_block(printed, printed, language="text"))
        if "picture" in self.options:
            name = f"{page.replace('/', '_')}_{self.lineno}.png"
            _save(names[self.options["picture"]], Path(self.env.srcdir) / GENERATED / name)
            shown.append(nodes.image(uri=f"/{GENERATED}/{name}", alt=self.options["picture"]))
        return shown


def _executed(code: str, names: dict[str, Any], place: str) -> str:
    """Run code in an empty folder; return what it prints."""
    printed = io.StringIO()
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        contextlib.redirect_stdout(printed),
    ):
        try:
            exec(compile(code, place, "exec"), names)
        except Exception as error:
            raise ExtensionError(f"{place}: the example fails: {error!r}", error) from error
    return printed.getvalue().rstrip()


def _save(picture: Any, file: Path) -> None:
    file.parent.mkdir(exist_ok=True)
    if hasattr(picture, "png"):
        file.write_bytes(picture.png)
    else:
        picture.savefig(file, dpi=90.0)


def setup(app: Sphinx) -> dict[str, Any]:
    """Make the directive known."""
    app.add_directive("run", Run)
    return {"parallel_read_safe": True}
