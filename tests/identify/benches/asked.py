"""Output of the command line for recordings that a test has simulated."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from click.testing import CliRunner
from numpy.typing import ArrayLike

from hil_emulator.__main__ import main
from hil_emulator.platform.paths import shipped

CANNOT_EXAMINE = 3
"""Exit code of a search that could not begin."""


def bench(name: str) -> Path:
    """Return the worked configuration of a bench."""
    return shipped(f"configs/benches/{name}.toml")


def recorded(file: Path, columns: Mapping[str, ArrayLike]) -> Path:
    """Write columns, named with their units, as a bench's logger does."""
    rows = np.column_stack([np.asarray(c) for c in columns.values()])
    np.savetxt(file, rows, "%.8g", ",", header=",".join(columns), comments="")
    return file


def asked(
    command: str, config: Path, learn: Sequence[Path], check: Sequence[Path], out: Path
) -> tuple[dict[str, Any], str]:
    """Return the content of result.json from `gap` or `identify`, and the output."""
    words = [command, str(config), *map(str, learn), f"--out={out}", "--overwrite"]
    done = CliRunner().invoke(main, [*words, *(f"--validate={f}" for f in check)])
    assert done.exit_code in (0, CANNOT_EXAMINE), done.output
    result = json.loads((out / "result.json").read_text())
    assert (done.exit_code == CANNOT_EXAMINE) == (result["verdict"] == "cannot_examine")
    return result, done.output


def names(result: Mapping[str, Any]) -> list[str]:
    """Return the effects that a result names."""
    return [effect["name"] for effect in result["effects"]]
