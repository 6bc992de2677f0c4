"""Several actuators under one loop."""

import itertools
import struct
from collections.abc import Callable
from pathlib import Path

import pytest
from rigs import set_point

from hil_emulator.bus.bus import Bus
from hil_emulator.config.machine import load_machine
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import cache_folder, shipped
from hil_emulator.simulation.machine import Machine, assemble_machine

KNEE = shipped("configs/hyq_knee.toml")
_numbers = itertools.count()

LEG = f"""
[buses.left]
interface = "virtual"
channel = "left"

[buses.right]
interface = "virtual"
channel = "right"

[[actuator]]
name = "hip"
files = ["{KNEE}"]
bus = "left"

[[actuator]]
name = "knee"
files = ["{KNEE}"]
bus = "left"
node_offset = 1

[[actuator]]
name = "other"
files = ["{KNEE}"]
bus = "right"
"""

TIMED = 'bit_rate = "1 Mbit/s"\ntiming = "modelled"\n'

Write = Callable[[str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a function that writes a machine's file."""

    def write(text: str) -> Path:
        file = tmp_path / "machine.toml"
        file.write_text(text)
        return file

    return write


class Bench:
    """A machine, and a peer on each of its buses."""

    def __init__(self, file: Path) -> None:
        number = next(_numbers)
        settings = load_machine([file])
        self.own: dict[str, Bus] = {}
        self.peers: dict[str, Bus] = {}
        for name in settings.buses:
            channel = {"interface": "virtual", "channel": f"machine test {number} {name}"}
            self.own[name], self.peers[name] = Bus(channel), Bus(channel)
        self.machine: Machine = assemble_machine(settings, self.own, cache_folder())

    def ticks(self, count: int, bus: str, *frames: Frame) -> dict[str, list[Frame]]:
        """Execute ticks, sending frames on a bus in each; return the frames of each bus."""
        heard: dict[str, list[Frame]] = {name: [] for name in self.peers}
        for _ in range(count):
            self.peers[bus].send(frames)
            self.machine.step()
            for name, peer in self.peers.items():
                heard[name] += peer.receive()
        return heard

    def close(self) -> None:
        """Leave the buses."""
        for bus in (*self.own.values(), *self.peers.values()):
            bus.close()


def test_actuators_move_on_separate_buses(write: Write) -> None:
    """A set point for node 5 on the left bus moves only the hip."""
    bench = Bench(write(LEG))
    bench.ticks(5, "left", Frame(0x000, bytes([1, 0])))
    heard = bench.ticks(100, "left", set_point(2.0))
    positions = {name: rig.plant.signals.position for name, rig in bench.machine.rigs.items()}
    assert positions["hip"] > 0.045
    assert abs(positions["knee"] - 0.04) < 1e-3
    assert abs(positions["other"] - 0.04) < 1e-3
    assert {0x185, 0x186} <= {f.can_id for f in heard["left"]}
    assert {f.can_id for f in heard["right"]} <= {0x705}
    bench.close()


def test_actuators_have_independent_noise(write: Write) -> None:
    """The noise of equal actuators differs."""
    bench = Bench(write(LEG))
    bench.ticks(5, "left", Frame(0x000, bytes([1, 0])))
    heard = bench.ticks(50, "left")["left"]
    hip, knee = ([f.data[:4] for f in heard if f.can_id == i] for i in (0x385, 0x386))
    assert len(hip) == len(knee) == 50
    assert hip != knee
    bench.close()


def test_nodes_of_different_actuators_communicate_on_a_shared_bus(write: Write) -> None:
    """The knee's node monitors the hip's heartbeat and sends 0x8130 when it stops."""
    bench = Bench(write(LEG))
    bench.ticks(5, "left")
    watch = bytes.fromhex("23161001") + struct.pack("<I", 5 << 16 | 300)
    bench.ticks(1, "left", Frame(0x606, watch))
    assert not [f for f in bench.ticks(500, "left")["left"] if f.can_id == 0x086]
    bench.ticks(1, "left", Frame(0x605, bytes.fromhex("2b17100000000000")))
    (emergency,) = [f for f in bench.ticks(500, "left")["left"] if f.can_id == 0x086]
    assert struct.unpack_from("<H", emergency.data)[0] == 0x8130
    bench.close()


def test_a_single_configuration_is_a_machine_of_one() -> None:
    """Without [[actuator]] the files describe one actuator on its own bus."""
    settings = load_machine([KNEE])
    (only,) = settings.actuators
    assert (only.name, only.bus) == ("hyq_knee", "bus")
    assert settings.buses["bus"]["interface"] == "socketcand_server"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("node_offset = 1", "node_offset = 0", "hip and knee both have a node 5"),
        ("node_offset = 1", "node_offset = 123", "node-ID 128 is above 127"),
        ('bus = "right"', 'bus = "rigth"', "there is no bus 'rigth'; there are: left, right"),
        ("node_offset = 1", "offset = 1", "actuator.1.offset: unknown key"),
        ('name = "knee"', "", "actuator.1.name: missing"),
        ('name = "knee"', 'name = "hip"', "two actuators are called hip"),
        (
            f'files = ["{KNEE}"]\nbus = "left"\nnode',
            'files = ["no.toml"]\nbus="left"\nnode',
            "no such",
        ),
    ],
)
def test_a_mistake_in_a_machine_is_named(write: Write, old: str, new: str, message: str) -> None:
    """The message has the mistake, its place and the remedy."""
    assert old in LEG
    with pytest.raises(UserError, match=message):
        load_machine([write(LEG.replace(old, new))])


def test_actuators_on_a_bus_that_takes_time_take_turns(write: Write) -> None:
    """Both receive the master's frames; their frames are sent one by one, by priority."""
    text = LEG.replace('channel = "left"\n', 'channel = "left"\n' + TIMED, 1)
    bench = Bench(write(text))
    bench.ticks(2, "left")
    heard = bench.ticks(50, "left", Frame(0x000, b"\x01\x00"))["left"]
    wire = bench.machine.wires["left"]
    assert list(bench.machine.wires) == ["left"]
    tpdos = [f.can_id for f in heard if f.can_id in (0x185, 0x186, 0x285, 0x286)]
    assert sorted(set(tpdos[-8:])) == [0x185, 0x186, 0x285, 0x286]
    # by priority, over and over
    assert {b for a, b in itertools.pairwise(tpdos[8:]) if a == 0x185} == {0x186}
    bench.ticks(1000, "left")
    assert 0.5 < wire.load <= 1.0
    bench.close()
