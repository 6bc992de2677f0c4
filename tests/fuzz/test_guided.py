"""Bytes that coverage leads to new lines are refused in words, or read."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("atheris", reason="atheris is for Linux")

ROOT = Path(__file__).parents[2]


@pytest.mark.full(sibling="fuzz/test_files.py::test_some_hundred_mutants")
@pytest.mark.parametrize(
    ("target", "runs"),
    [("quantity", 100_000), ("socketcand", 100_000), ("frames", 10_000), ("eds", 500),
     ("lvm", 10_000)],
)  # fmt: skip
def test_no_input_is_a_traceback(target: str, runs: int, tmp_path: Path) -> None:
    """LibFuzzer ends with 0: no input that it came to has raised anything."""
    command = [sys.executable, "-m", "tests.fuzz.guided", target]
    ended = subprocess.run(
        [*command, f"-runs={runs}", "-seed=1", f"-artifact_prefix={tmp_path}/"],
        capture_output=True, text=True, errors="replace", cwd=ROOT, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, (ended.stdout + ended.stderr)[-3000:]
