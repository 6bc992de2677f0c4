"""A result as files: table (CSV), result (JSON), picture (PNG)."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise.figure import new_figure
from hil_emulator.characterise.result import BenchResult


def _heading(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _write_table(result: BenchResult, file: Path) -> None:
    with file.open("w", newline="", encoding="utf-8") as stream:
        rows = csv.writer(stream)
        rows.writerow([_heading(name, c.unit) for name, c in result.columns.items()])
        table = np.column_stack([c.values for c in result.columns.values()])
        rows.writerows([f"{value:.9g}" for value in row] for row in table)


def as_json(result: BenchResult) -> dict[str, object]:
    """Return a result as JSON objects; not-a-number becomes null."""
    return {
        "name": result.name,
        "title": result.title,
        "procedure": result.procedure,
        "notes": list(result.notes),
        "does_not_apply": list(result.inapplicable),
        "figures": [vars(figure) for figure in result.figures],
        "comparisons": [
            {
                "quantity": c.quantity,
                "unit": c.unit,
                "expected": c.expected,
                "source": c.source,
                "measured": c.measured if np.isfinite(c.measured) else None,
                "difference": c.difference if np.isfinite(c.difference) else None,
                "tolerance": c.tolerance,
                "agrees": c.agrees,
                "kind": c.kind.value,
                "rests_on_assumed": list(c.rests_on),
            }
            for c in result.comparisons
        ],
        "columns": {
            name: {
                "unit": c.unit,
                "values": [float(f"{v:.9g}") if np.isfinite(v) else None for v in c.values],
            }
            for name, c in result.columns.items()
        },
    }


def outputs(name: str, folder: Path) -> tuple[Path, Path, Path]:
    """Return the files of a test's result: table, JSON, picture."""
    return folder / f"{name}.csv", folder / f"{name}.json", folder / f"{name}.png"


def write_result(
    result: BenchResult, draw: Callable[[BenchResult, Figure], None], folder: Path
) -> None:
    """Write NAME.csv, NAME.json and NAME.png.

    Raises:
        OSError: if a file cannot be written.

    """
    figure = new_figure()
    draw(result, figure)
    table, everything, picture = outputs(result.name, folder)
    _write_table(result, table)
    text = json.dumps(as_json(result), indent=1, ensure_ascii=False)
    everything.write_text(text, encoding="utf-8")
    figure.savefig(picture)
