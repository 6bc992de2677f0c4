"""Machines that `init` writes for the tests."""

from pathlib import Path

from click.testing import CliRunner, Result

from hil_emulator.__main__ import main


def init(folder: Path, *options: str, answers: str = "") -> tuple[Path, Result]:
    """Return the file that `init` writes into a folder, and how it ended."""
    file = folder / "machine.toml"
    asked = [] if answers else ["--yes"]
    return file, CliRunner().invoke(main, ["init", str(file), *asked, *options], input=answers)
