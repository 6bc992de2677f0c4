"""MAT, level 5: a column per signal, and structures of units and origin; for MATLAB and Octave.

True values are in the structure `model`, and in `units.model`: `plot(time, model.position)`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil_emulator.recording import journal
from hil_emulator.recording.format import Format


def write(source: Path, file: Path) -> None:
    """Write the signals bit for bit."""
    from scipy.io import savemat  # imported late, because it takes a while

    recording = journal.read(source)
    origin = {name.replace("-", "_"): text for name, text in recording.provenance.items()}
    content = _nested(recording.table()) | {"units": _nested(recording.units), "provenance": origin}
    savemat(file, content, long_field_names=True, do_compression=True, oned_as="column")


def _nested(columns: Mapping[str, Any]) -> dict[str, Any]:
    """Return a structure inside the structure for names such as "model.position"."""
    nested: dict[str, Any] = {}
    for name, value in columns.items():
        inside, _, last = name.rpartition(".")
        (nested.setdefault(inside, {}) if inside else nested)[last] = value
    return nested


FORMAT = Format((".mat",), write)
