"""Directives whose content runs when a page is built, and is shown with what it prints.

    ```{run}
    :picture: figure
    figure = ...
    ```

    ```{command}
    :exit: 1
    hil-emulator scenario step.toml
    ```

    ```{file} step.toml
    title = "..."
    ```

The blocks of a page share one empty folder, and `{run}` blocks also their variables; `docs` is the
folder of the pages. A picture is any object with `png` or `savefig`.
"""

import contextlib
import io
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

GENERATED = "generated"
"""Folder of the files that a build makes; not kept."""


class Directive(SphinxDirective):
    """A block of code of a page."""

    has_content = True

    @property
    def code(self) -> str:
        """The content of the block."""
        return "\n".join(self.content)

    @property
    def place(self) -> str:
        """Page and line, for messages."""
        return f"{self.env.docname}, line {self.lineno}"

    @property
    def folder(self) -> Path:
        """The working folder of the page; removed after the page."""
        made = self.env.temp_data.setdefault("folder of run", tempfile.TemporaryDirectory())
        return Path(made.name)

    def shown(self, language: str, printed: str) -> list[nodes.Node]:
        """Return the code and, if there is any, its output."""
        block = nodes.literal_block(self.code, self.code, language=language)
        output = nodes.literal_block(printed, printed, language="text")
        return [block, output] if printed else [block]


class Run(Directive):
    """Runs its content as Python: an exception ends the build."""

    option_spec: ClassVar[dict[str, Any]] = {"picture": str}

    def run(self) -> list[nodes.Node]:
        """Return the code, its output and its picture."""
        names = self.env.temp_data.setdefault("names of run", {"docs": Path(self.env.srcdir)})
        shown = self.shown("python", _executed(self.code, names, self.folder, self.place))
        if "picture" in self.options:
            name = f"{self.env.docname.replace('/', '_')}_{self.lineno}.png"
            _save(names[self.options["picture"]], Path(self.env.srcdir) / GENERATED / name)
            shown.append(nodes.image(uri=f"/{GENERATED}/{name}", alt=self.options["picture"]))
        return shown


class Command(Directive):
    """Runs its content in a shell: another exit code than `:exit:` ends the build."""

    option_spec: ClassVar[dict[str, Any]] = {"exit": int}

    def run(self) -> list[nodes.Node]:
        """Return the commands and what they print to standard output."""
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(
            ["sh", "-ec", self.code], cwd=self.folder, env={**os.environ, "PATH": path},
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode != self.options.get("exit", 0):
            raise ExtensionError(f"{self.place}: exit code {done.returncode}\n{done.stderr}")
        return self.shown("sh", done.stdout.rstrip())


class File(Directive):
    """Writes its content into a file of the page's folder."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the name and the content."""
        (self.folder / self.arguments[0]).write_text(self.code + "\n")
        return [
            nodes.paragraph("", "", nodes.literal("", self.arguments[0])),
            *self.shown("toml", ""),
        ]


def _executed(code: str, names: dict[str, Any], folder: Path, place: str) -> str:
    """Run code in a folder; return what it prints."""
    printed = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(printed):
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
    """Register the directives."""
    app.add_directive("run", Run)
    app.add_directive("command", Command)
    app.add_directive("file", File)
    return {"parallel_read_safe": True}
