"""The templates of docs/how_to/ci.md: their commands are run."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from test_shown import block


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
    assert first[0] == "pip install hil-emulator pytest"


@pytest.mark.slow
def test_the_commands_of_the_templates_pass(tmp_path: Path) -> None:
    """In an empty folder with the page's test, by a plain shell; installed it is already."""
    (tmp_path / "test_step.py").write_text(block("how_to/ci.md", "python", "# test_step.py"))
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    for command in templates()["GitHub"][1:]:
        done = subprocess.run(
            ["sh", "-ec", command], cwd=tmp_path, env={**os.environ, "PATH": path},
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    assert "<testsuite" in (tmp_path / "report.xml").read_text()
