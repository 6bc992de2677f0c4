"""CSV: a comment per line of origin, a header with units, a line per tick; for spreadsheets."""

import csv
from pathlib import Path

from hil_emulator.recording.format import Format
from hil_emulator.recording.streaming import batches, header_of


def write(source: Path, file: Path) -> None:
    """Write the signals with nine digits."""
    header = header_of(source)
    with file.open("w", newline="", encoding="utf-8") as out:
        out.writelines(f"# {key}: {value}\n" for key, value in header["provenance"].items())
        writer = csv.writer(out)
        writer.writerow([f"{name} [{unit}]" for name, unit in header["columns"].items()])
        for batch in batches(source):
            writer.writerows([f"{value:.9g}" for value in row] for row in batch.tolist())


FORMAT = Format((".csv",), write)
