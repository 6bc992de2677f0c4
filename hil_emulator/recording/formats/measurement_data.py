"""MDF 4.10: a channel per signal with its unit, the origin as comment; for asammdf, CANape."""

import importlib
import json
from pathlib import Path

from hil_emulator.recording import journal
from hil_emulator.recording.format import Format


def write(source: Path, file: Path) -> None:
    """Write the signals bit for bit."""
    asammdf = importlib.import_module("asammdf")
    recording = journal.read(source)
    table = recording.table()
    time = table.pop("time")
    signals = [
        asammdf.Signal(values.copy(), time, name=name, unit=recording.units[name])
        for name, values in table.items()
    ]
    with asammdf.MDF(version="4.10") as mdf:
        mdf.header.comment = json.dumps(recording.provenance)
        mdf.append(signals, comment="hil-emulator", common_timebase=True)
        mdf.save(file)


FORMAT = Format((".mf4",), write, needs="asammdf")
