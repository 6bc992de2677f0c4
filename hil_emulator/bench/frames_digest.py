"""Digest of the frames that a node sends, to compare versions of the program."""

import hashlib
import math
import struct
from pathlib import Path

from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import Configuration
from hil_emulator.frame import Frame
from hil_emulator.simulation.assembly import assemble

_CHANNEL = "hil-emulator bench, digest"
_TICKS = 5_000
_AMPLITUDE, _PERIOD = 4e6, 1500.0
"""Set point [digits of the object] and its duration [ticks]: the rod reaches both ends, and a
chamber cavitates."""


def frames_digest(config: Configuration, cache: Path) -> str:
    """Return the SHA-256 of all frames of a run in lock-step: identifier, length and data of each.

    Each tick receives a set point and a SYNC.
    """
    digest = hashlib.sha256()
    node = config.nodes[0].id
    settings = {"interface": "virtual", "channel": _CHANNEL}
    with Bus(settings) as emulator, Bus(settings) as master:
        rig = assemble(config, emulator, cache)
        rig.step()
        master.send([Frame(0x000, bytes([1, node]))])
        for tick in range(_TICKS):
            wanted = round(_AMPLITUDE * math.sin(2.0 * math.pi * tick / _PERIOD))
            master.send([Frame(0x200 + node, struct.pack("<i", wanted)), Frame(0x080)])
            rig.step()
            while heard := master.receive():
                for frame in heard:
                    digest.update(struct.pack("<IB", frame.can_id, len(frame.data)) + frame.data)
    return digest.hexdigest()
