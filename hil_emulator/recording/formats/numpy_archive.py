"""NPZ: an array per signal, units and origin as pairs; for numpy."""

from pathlib import Path

import numpy as np

from hil_emulator.recording import journal
from hil_emulator.recording.format import Format


def write(source: Path, file: Path) -> None:
    """Write the signals bit for bit."""
    recording = journal.read(source)
    units = {"units": np.array(list(recording.units.items()))}
    origin = {"provenance": np.array(list(recording.provenance.items()))}
    np.savez_compressed(file, **recording.table(), **units, **origin)  # type: ignore[arg-type]


FORMAT = Format((".npz",), write)
