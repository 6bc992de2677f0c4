"""Every kind of fault: the table that Python, scenario files and the command line share."""

from hil_emulator.faults import coil, frames, objects, plant, sensor
from hil_emulator.faults.declare import FaultKind

KINDS: tuple[FaultKind, ...] = (
    *plant.KINDS,
    *coil.KINDS,
    *sensor.KINDS,
    *objects.KINDS,
    *frames.KINDS,
)
