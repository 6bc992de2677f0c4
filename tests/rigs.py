"""Rigs for tests: the reference machine on a virtual bus, and a peer that drives it."""

import itertools
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import Configuration, load
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import cache_folder, shipped
from hil_emulator.recording.memory import MemoryRecorder
from hil_emulator.simulation.assembly import assemble
from hil_emulator.simulation.clock import Clock, LockStep
from hil_emulator.simulation.loop import Timing, run
from hil_emulator.simulation.rig import Rig

NODE = 5
START = Frame(0x000, bytes([1, NODE]))
_numbers = itertools.count()


def reference() -> Configuration:
    """Return the reference machine."""
    return load([shipped("configs/hyq_knee.toml")])


def timed(folder: Path, **settings: Any) -> Configuration:
    """Return the reference machine on a bus that takes time."""
    bus = {"bit_rate": "500 kbit/s", "timing": "modelled", **settings}
    layer = folder / "timed.toml"
    layer.write_text("[bus]\n" + "".join(f"{k} = {v!r}\n" for k, v in bus.items()))
    return load([shipped("configs/hyq_knee.toml"), layer])


def set_point(milliampere: float) -> Frame:
    """Return the RPDO that commands a current."""
    return Frame(0x200 + NODE, struct.pack("<i", round(milliampere * 1e6)))


@dataclass
class Bench:
    """A rig, a peer on its bus, and everything the peer has heard."""

    rig: Rig
    peer: Bus
    clock: Clock
    recorder: MemoryRecorder
    heard: list[Frame] = field(default_factory=list)

    def tick(self, *frames: Frame) -> list[Frame]:
        """Send frames, let one tick pass, and return what the rig sent."""
        self.peer.send(frames)
        run(self.rig, self.clock, 1, Timing())
        answer = self.peer.receive()
        self.heard += answer
        return answer

    def ticks(self, count: int, *frames: Frame) -> list[Frame]:
        """Let ticks pass, sending the same frames in each; return what the rig sent in all."""
        return [frame for _ in range(count) for frame in self.tick(*frames)]


@contextmanager
def bench(config: Configuration, clock: Clock | None = None) -> Iterator[Bench]:
    """Yield a rig on a virtual bus of its own, with a peer."""
    settings = {"interface": "virtual", "channel": f"rig test {next(_numbers)}"}
    recorder = MemoryRecorder()
    with Bus(settings) as rig_bus, Bus(settings) as peer:
        rig = assemble(config, rig_bus, cache_folder(), recorder)
        yield Bench(rig, peer, clock or LockStep(), recorder)
