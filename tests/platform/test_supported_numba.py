"""Versions of numba that the model can be compiled with."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from hil_emulator.errors import UserError
from hil_emulator.platform import supported_numba
from hil_emulator.platform.supported_numba import NEWEST, OLDEST, require_supported_numba

PROJECT = Path(__file__).parents[2] / "pyproject.toml"


@pytest.mark.parametrize("installed", ["0.61.2", "0.69.0", "0.69.0rc1", "1.0.0"])
def test_other_versions_are_refused(installed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names what is installed and what to install."""
    monkeypatch.setattr(supported_numba, "version", lambda _: installed)
    with pytest.raises(UserError, match=rf"numba {installed} is installed.*numba>=0.62,<0.69"):
        require_supported_numba()


@pytest.mark.parametrize("installed", ["0.62.0", "0.68.9"])
def test_the_bounds_belong_to_them(installed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also every bug-fix release of theirs."""
    monkeypatch.setattr(supported_numba, "version", lambda _: installed)
    require_supported_numba()


def test_an_installation_has_the_same_bounds() -> None:
    """No version is installed that the program refuses, and each that it runs with can be."""
    dependencies = tomllib.loads(PROJECT.read_text())["project"]["dependencies"]
    (numba,) = (line for line in dependencies if line.startswith("numba"))
    after = NEWEST[0], NEWEST[1] + 1
    assert numba == f"numba>={OLDEST[0]}.{OLDEST[1]},<{after[0]}.{after[1]}"


PROGRAM = """
import importlib.metadata, sys
installed = importlib.metadata.version
importlib.metadata.version = lambda name: "0.1.0" if name == "numba" else installed(name)
from hil_emulator.__main__ import main
main(["check", "hyq_knee"])
"""


def test_a_command_ends_with_one_sentence() -> None:
    """It ends before it compiles anything."""
    run = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True)
    assert run.returncode == 2
    assert re.fullmatch(r"hil-emulator: numba 0\.1\.0 is installed.*\n", run.stderr)
