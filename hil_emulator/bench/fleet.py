"""Lock-step speed of a quadruped: eight actuators, a CANopen node per instrument, four buses."""

import itertools
import struct
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from hil_emulator.bus.bus import Bus
from hil_emulator.config.actuators import ActuatorSettings
from hil_emulator.config.bus import WireSettings
from hil_emulator.config.load import load
from hil_emulator.config.machine import MachineSettings
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.machine import Machine, assemble_machine
from hil_emulator.simulation.timed_can_port import CanPort

QUADRUPED = 8
_PER_BUS = 2  # two actuators of four nodes: eight PDOs of up to eight bytes a millisecond
TICKS = 1_000  # lock-step ticks timed at once
_REPEATS = 5
COMBINED = 32
_PER_FULL_BUS = 8  # TPDOs of eight bytes a millisecond: 1 Mbit/s
SYNC = Frame(0x080)
_START_ALL = Frame(0x000, bytes([1, 0]))


@dataclass(frozen=True)
class FleetSpeed:
    """Speed of a machine of several actuators, and the parts of a tick; durations in microseconds.

    Attributes:
        nodes: number of CANopen nodes.
        pdos_per_ms: TPDOs sent per emulated millisecond on each bus.
        lockstep_x: emulated over elapsed time.
        tick_us: one tick of all actuators.
        plant_us: part of the tick that integrates the actuators.
        bus_us: part of the tick that sends frames to python-can's virtual bus.
        rest_us: remaining part of the tick: sensors and nodes.

    """

    nodes: int
    pdos_per_ms: float
    lockstep_x: float
    tick_us: float
    plant_us: float
    bus_us: float
    rest_us: float


def measure_fleet(cache: Path) -> FleetSpeed:
    """Run a quadruped's actuators in lock-step, SYNC and set points included."""
    settings = fleet(QUADRUPED)
    with operational(settings, cache) as (machine, peers):
        return _measured(machine, settings, peers, commands(settings))


def measure_combined(cache: Path) -> FleetSpeed:
    """Run as many nodes of one actuator each as fill four buses of 1 Mbit/s with a TPDO each."""
    settings = combined(COMBINED)
    with operational(settings, cache) as (machine, peers):
        leave_one_tpdo(machine)
        return _measured(machine, settings, peers, [SYNC])


def _measured(
    machine: Machine, settings: MachineSettings, peers: list[Bus], frames: list[Frame]
) -> FleetSpeed:
    """Return the best of several runs, with `frames` sent in each tick."""
    seconds, sent = min(timed_ticks(machine, peers, frames) for _ in range(_REPEATS))
    plants = min(_timed_plants(machine, settings) for _ in range(_REPEATS))
    bus = next(iter(machine.rigs.values())).bus
    per_frame = min(_timed_bus(bus, peers) for _ in range(_REPEATS))
    tick_us = seconds / TICKS * 1e6
    bus_us = per_frame * sent / TICKS * 1e6
    plant_us = plants * 1e6
    return FleetSpeed(
        nodes=sum(len(rig.nodes) for rig in machine.rigs.values()),
        pdos_per_ms=sent / TICKS / len(settings.buses) / (machine.tick_ns * 1e-6),
        lockstep_x=TICKS * machine.tick_ns * 1e-9 / seconds,
        tick_us=tick_us,
        plant_us=plant_us,
        bus_us=bus_us,
        rest_us=tick_us - plant_us - bus_us,
    )


def fleet(count: int) -> MachineSettings:
    """Return a machine of `count` actuators (an even number), two on each bus."""
    config = load([shipped("configs/hyq_knee.toml"), shipped("configs/hyq_knee_separate.toml")])
    names = [f"bus {i}" for i in range(count // _PER_BUS)]
    actuators: list[ActuatorSettings] = []
    for name, place in itertools.product(names, range(_PER_BUS)):
        shifted = tuple(
            replace(node, id=node.id + place * len(config.nodes)) for node in config.nodes
        )
        one_config = replace(config, nodes=shifted, seed=config.seed + len(actuators))
        actuators.append(ActuatorSettings(f"{name} {place}", one_config, name))
    buses = {n: {"interface": "virtual", "channel": f"bench {n}"} for n in names}
    return MachineSettings(tuple(actuators), buses, dict.fromkeys(names, WireSettings()))


def combined(count: int) -> MachineSettings:
    """Return a machine of `count` actuators with a node each, eight on each bus."""
    config = load([shipped("configs/hyq_knee.toml")])
    names = [f"bus {i}" for i in range(count // _PER_FULL_BUS)]
    actuators: list[ActuatorSettings] = []
    for name, place in itertools.product(names, range(_PER_FULL_BUS)):
        nodes = (replace(config.nodes[0], id=1 + place),)
        one_config = replace(config, nodes=nodes, seed=config.seed + len(actuators))
        actuators.append(ActuatorSettings(f"{name} {place}", one_config, name))
    buses = {n: {"interface": "virtual", "channel": f"bench {n}"} for n in names}
    return MachineSettings(tuple(actuators), buses, dict.fromkeys(names, WireSettings()))


def leave_one_tpdo(machine: Machine) -> None:
    """Take all TPDOs but the first of each node out of service (CiA 301 7.5.2.37, bit 31)."""
    dictionaries = [node.dictionary for rig in machine.rigs.values() for node in rig.nodes]
    for dictionary, index in itertools.product(dictionaries, range(0x1801, 0x1804)):
        dictionary.write(index, 1, dictionary.read(index, 1) | 1 << 31)


@contextmanager
def operational(settings: MachineSettings, cache: Path) -> Iterator[tuple[Machine, list[Bus]]]:
    """Yield the machine with all nodes OPERATIONAL, and a peer on each bus."""
    with ExitStack() as stack:
        tables = settings.buses
        buses = {name: stack.enter_context(Bus(table)) for name, table in tables.items()}
        peers = [stack.enter_context(Bus(table)) for table in tables.values()]
        machine = assemble_machine(settings, buses, cache)
        exchange(peers, [])
        machine.step()
        exchange(peers, [_START_ALL])
        machine.step()
        yield machine, peers


def commands(settings: MachineSettings) -> list[Frame]:
    """Return SYNC and the set points of both valves of a bus: 10 % of the range, valves active."""
    data = struct.pack("<Hh", 0x0F, 1638)
    valves = [a.config.nodes[0].id for a in settings.actuators[:_PER_BUS]]
    return [SYNC, *(Frame(0x200 + valve, data) for valve in valves)]


def exchange(peers: list[Bus], frames: list[Frame]) -> int:
    """Send frames on every bus; return the number of frames that the emulator had sent."""
    count = 0
    for peer in peers:
        while arrived := peer.receive():
            count += len(arrived)
        peer.send(frames)
    return count


def timed_ticks(machine: Machine, peers: list[Bus], frames: list[Frame]) -> tuple[float, int]:
    """Return the time of `TICKS` ticks [s] without the peers' work, and the frames sent."""
    elapsed, sent = 0.0, -exchange(peers, [])
    for _ in range(TICKS):
        sent += exchange(peers, frames)
        begin = time.perf_counter()
        machine.step()
        elapsed += time.perf_counter() - begin
    return elapsed, sent + exchange(peers, [])


def _timed_plants(machine: Machine, settings: MachineSettings) -> float:
    """Return the time in which all actuators are integrated over one tick [s]."""
    steps = settings.actuators[0].config.steps
    begin = time.perf_counter()
    for _ in range(100):
        for rig in machine.rigs.values():
            rig.plant.step(steps)
    return (time.perf_counter() - begin) / 100


def _timed_bus(bus: CanPort, peers: list[Bus]) -> float:
    """Return the time of sending one frame to a bus with one listener [s]."""
    frames = [Frame(0x180, bytes(8))] * 8
    begin = time.perf_counter()
    for _ in range(100):
        bus.send(frames)
    seconds = (time.perf_counter() - begin) / 800
    exchange(peers, [])
    return seconds
