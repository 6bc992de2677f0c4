"""Kinds of values on the command line."""

from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from hil_emulator.errors import UserError


class PackagedFile(click.ParamType[Path]):
    """A file, or the name of a packaged one.

    Args:
        name: of the argument, for the message.
        purposes: see `platform.packaged.Purpose`; all without any.

    """

    def __init__(self, name: str, *purposes: str) -> None:
        self.name = name
        self._purposes = purposes

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path of the file; a missing file is reported when it is read."""
        from hil_emulator.platform.packaged import Purpose, found

        try:
            return found(str(value), *map(Purpose, self._purposes))
        except UserError as error:
            self.fail(str(error), param, ctx)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the packaged names with this beginning; the shell completes files as well."""
        from hil_emulator.platform.packaged import Purpose, packaged

        names = packaged(*map(Purpose, self._purposes))
        fitting = [CompletionItem(name) for name in names if name.startswith(incomplete)]
        return [*fitting, CompletionItem(incomplete, type="file")]


def some_files(
    ctx: click.Context, param: click.Parameter, files: tuple[Path, ...]
) -> tuple[Path, ...]:
    """Refuse an empty list of files without a scenario; the message lists the packaged machines."""
    from hil_emulator.platform.packaged import Purpose, packaged, summary

    if files or ctx.params.get("played"):  # a scenario names its configuration
        return files
    machines = [f"  {name:<14} {summary(file)}" for name, file in packaged(Purpose.MACHINE).items()]
    text = (f"name a configuration (TOML), or a machine of the package:\n"
            f"{chr(10).join(machines)}\n"
            f"`hil-emulator init` writes a configuration of your own machine.")  # fmt: skip
    raise click.UsageError(text, ctx)


class Duration(click.ParamType[float]):
    """A time with its unit."""

    name = "time"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the value in SI; fail if it is not a quantity."""
        from hil_emulator.units import to_si

        try:
            seconds = to_si(value, "s", "60 s")
        except ValueError as error:
            self.fail(str(error), param, ctx)
        if not 0 < seconds < float("inf"):
            self.fail(f'"{value}" is not a positive time', param, ctx)
        return seconds


class QuantityType(click.ParamType[float]):
    """A number with a unit."""

    name = "quantity"

    def __init__(self, unit: str, example: str) -> None:
        self._unit = unit
        self._example = example

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the value in SI; fail if it is not a quantity."""
        from hil_emulator.units import to_si

        try:
            return to_si(value, self._unit, self._example)
        except ValueError as error:
            self.fail(str(error), param, ctx)


class Output(click.Path):
    """Output of a command, which then has the option `--overwrite`."""

    def __init__(self, *, is_folder: bool = False) -> None:
        super().__init__(file_okay=not is_folder, dir_okay=is_folder, path_type=Path)


class OutputStem(Output):
    """A file to write whose ending the command chooses; its folder exists."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return its path; fail before the work if its folder is missing."""
        folder = Path(value).parent
        if not folder.is_dir():
            self.fail(f"{value}: the folder {folder} does not exist; make it first", param, ctx)
        return super().convert(value, param, ctx)


class NewFile(OutputStem):
    """A file to write, checked before the work."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return its path; fail if its folder is missing, or it exists without --overwrite."""
        from hil_emulator.platform.output_files import refuse_existing

        try:
            refuse_existing([Path(value)], overwrite=bool(ctx and ctx.params["overwrite"]))
        except UserError as error:
            self.fail(str(error), param, ctx)
        return super().convert(value, param, ctx)


class NewPicture(NewFile):
    """A picture to write, in a supported format."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return its path; fail if it cannot be written, or its ending is not a format."""
        from hil_emulator.pages.drawing import check_format

        path = super().convert(value, param, ctx)
        try:
            check_format(path)
        except UserError as error:
            self.fail(str(error), param, ctx)
        return path


OVERWRITE = click.option(
    "--overwrite", is_flag=True, is_eager=True, help="Replace output files that exist."
)
"""Option of every command that writes; eager, because `NewFile` reads it."""

CONFIGURATION = PackagedFile("configuration", "machine", "layer", "bench")
SCENARIO = PackagedFile("scenario", "scenario")

ROLE = click.option(
    "--controller", "role", type=click.Choice(["reference", "external", "none"]),
    help="Controller that acts, in place of that of the scenario.",
)  # fmt: skip
"""Option of the commands that play a scenario."""

FILES = click.argument(
    "files", metavar="CONFIG...", nargs=-1, type=CONFIGURATION, callback=some_files
)
