"""The templates of docs/how_to/ci.md: their commands are run."""

import os
import subprocess
import sys
import venv
from pathlib import Path
from typing import Any

import pytest
import yaml
from test_shown import block

ROOT = Path(__file__).parent.parent


def templates() -> dict[str, list[str]]:
    """Return the commands of each service's template."""
    github: Any = yaml.safe_load(block("how_to/ci.md", "yaml", "on:"))
    gitlab: Any = yaml.safe_load(block("how_to/ci.md", "yaml", "emulator:"))
    steps = github["jobs"]["emulator"]["steps"]
    return {
        "GitHub": [step["run"] for step in steps if "run" in step],
        "GitLab": gitlab["emulator"]["script"],
    }


def test_both_services_do_the_same() -> None:
    """They install the package, run tests and play a scenario."""
    first, second = templates().values()
    assert first == second
    assert first[0] == "pip install wheels/hil_emulator-*.whl pytest"


def build_wheel(folder: Path) -> None:
    """Build the wheel as the page on installation shows, without an index."""
    pytest.importorskip("hatchling", reason="hatchling builds the wheel")
    command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation"]
    subprocess.run([*command, "-q", "-w", folder, ROOT], check=True)


def fresh_environment(folder: Path) -> Path:
    """Make an environment with all that the package needs, and return its `bin`."""
    venv.create(folder / "fresh", with_pip=True)
    packages = next((folder / "fresh").glob("lib/*/site-packages"))
    needed = folder / "needed"
    needed.mkdir()
    for entry in (e for path in sys.path if path.endswith("site-packages")
                  for e in Path(path).iterdir()):  # fmt: skip
        mine = entry.suffix == ".pth" or "hil_emulator" in entry.name or entry.name == "pip"
        if not mine and not (needed / entry.name).exists():
            (needed / entry.name).symlink_to(entry)
    (packages / "needed.pth").write_text(str(needed))
    programs = folder / "fresh" / "bin"
    pytest_program = programs / "pytest"  # which pip finds installed already
    pytest_program.write_text(f'#!/bin/sh\nexec {programs}/python -m pytest "$@"\n')
    pytest_program.chmod(0o755)
    return programs


@pytest.mark.slow
def test_the_commands_of_the_templates_pass(tmp_path: Path) -> None:
    """As they stand, with a wheel in `wheels`, by a plain shell in a fresh environment."""
    project = tmp_path / "project"
    project.mkdir()
    (project / "test_step.py").write_text(block("how_to/ci.md", "python", "# test_step.py"))
    build_wheel(project / "wheels")
    path = f"{fresh_environment(tmp_path)}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "PIP_NO_INDEX": "1"}
    for command in templates()["GitHub"]:
        done = subprocess.run(
            ["sh", "-ec", command], cwd=project, env=environment,
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    assert "<testsuite" in (project / "report.xml").read_text()
