"""Measures integration step, tick, lock-step speed, punctuality and TCP throughput."""

import struct
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from hil_emulator.bench.fleet import FleetSpeed, measure_combined, measure_fleet
from hil_emulator.bench.fleet_on_cores import FleetOnCores, measure_on_cores
from hil_emulator.bench.frames_digest import frames_digest
from hil_emulator.bench.recording_cost import measure_recording
from hil_emulator.bench.starting import StartCost, measure_start
from hil_emulator.bench.with_client import ClientCost, measure_with_client
from hil_emulator.bus.bus import Bus
from hil_emulator.ccode.compiler import CompilerError
from hil_emulator.ccode.library import CompiledPlant
from hil_emulator.ccode.plant_source import Exported
from hil_emulator.config.load import Configuration
from hil_emulator.frame import Frame
from hil_emulator.model.plant import Plant, on_one_supply
from hil_emulator.model.stages import SAMPLED
from hil_emulator.simulation import realtime
from hil_emulator.simulation.active_effects import acting
from hil_emulator.simulation.assembly import assemble, compiled
from hil_emulator.simulation.clock import LockStep, WallClock
from hil_emulator.simulation.loop import Timing, run
from hil_emulator.simulation.rig import Rig

_CHANNEL = "hil-emulator bench"
_STEPS = 100_000  # integration steps timed at once
_STEPS_IN_C = 1_000  # of them in one call: the sensors' share is small
_TICKS = 5_000  # lock-step ticks timed at once
_REPEATS = 5  # the best is kept: everything else on the machine can only slow it down
_TCP_FRAMES = 20_000

# A stock python-can client: receives {frames} frames, then prints the time that they took.
_CLIENT = """
import can, time
bus = can.Bus(interface="socketcand", host="127.0.0.1", port={port}, channel="can0")
bus.send(can.Message(arbitration_id=0x7FF, is_extended_id=False))
bus.recv(10)
begin = time.perf_counter()
for _ in range({frames} - 1):
    bus.recv(10)
print(time.perf_counter() - begin)
bus.shutdown()
"""


@dataclass(frozen=True)
class Speeds:
    """Measured speeds; durations in microseconds.

    Attributes:
        rk4_step_us: one integration step of the configured actuator.
        rk4_step_c_us: that step in the exported C; None without a C compiler.
        rk4_step_all_us: a step with every effect of the catalogue at its typical value.
        rk4_step_all_c_us: a step with every effect in the exported C; None without a C compiler.
        rk4_step_shared_us: a step of each of two configured actuators on one supply.
        tick_us: p50 and p99 of a full tick in lock-step: one set point and a SYNC in, four TPDOs
            out to one listener on the virtual bus.
        recording_us: p50 and p99 of a tick's time for recording its frames and row to a file.
        lockstep_x: emulated over elapsed time of such ticks.
        frames_sha256: digest of the frames that the node sends in such ticks.
        lateness_us: p50, p99, p999 and max of the ticks' lateness in real time.
        execution_us: p50, p99, p999 and max of the ticks' duration in real time.
        overruns: number of ticks that began a whole period late.
        tcp_frames_per_s: frames per second that a stock client in another process received by TCP.
        realtime: real-time measures that were in force.
        fleet: eight actuators on four buses, in lock-step.
        full_buses: 32 actuators with a node and a TPDO each, which fill four buses of 1 Mbit/s.
        fleet_on_cores: both machines with a process for each core, and sixteen actuators in real
            time.
        start: time from the command line to the first ticks.
        client: punctuality in real time with a client on TCP.

    """

    rk4_step_us: float
    rk4_step_c_us: float | None
    rk4_step_all_us: float
    rk4_step_all_c_us: float | None
    rk4_step_shared_us: float
    tick_us: dict[str, float]
    recording_us: dict[str, float]
    lockstep_x: float
    frames_sha256: str
    lateness_us: dict[str, float]
    execution_us: dict[str, float]
    overruns: int
    tcp_frames_per_s: float
    realtime: list[str]
    fleet: FleetSpeed
    full_buses: FleetSpeed
    fleet_on_cores: FleetOnCores
    start: StartCost
    client: ClientCost


def measure(
    config: Configuration, cache: Path, duration: float, report: Callable[[str], None]
) -> Speeds:
    """Measure everything; `duration` [s] is the length of each run in real time."""
    settings = {"interface": "virtual", "channel": _CHANNEL}
    report("Starts ...")
    start = measure_start(config.files)
    with Bus(settings) as emulator, Bus(settings) as listener:
        report("Preparing the model ...")
        rig = assemble(config, emulator, cache)
        master = _Master(listener, config.nodes[0].id)
        master.start(rig)
        report("Integration step ...")
        step_us = _step_us(rig.plant)
        step_c_us = _step_in_c_us(acting(config), cache)
        step_all_us = _step_us(_with_everything(config, cache))
        step_all_c_us = _step_in_c_us(replace(config, plant=_typical(config)), cache)
        step_shared_us = _step_us(_two_on_one_supply(config, cache)) / 2
        report("Lock-step ...")
        lockstep_x, tick = _lockstep(rig, master)
        frames_sha256 = frames_digest(config, cache)
        report("Recording ...")
        recording_us = measure_recording(config, rig)
        report("Eight actuators ...")
        fleet = measure_fleet(cache)
        full_buses = measure_combined(cache)
        fleet_on_cores = measure_on_cores(cache, duration)
        report("TCP ...")
        tcp_rate = _tcp_rate()
        report(f"Wall clock, {duration:g} s ...")
        measures = realtime.apply()
        wall = _wall_clock(rig, master, duration)
        report(f"Wall clock with a TCP client, {duration:g} s at each rate ...")
        client = measure_with_client(config, cache, duration)
    return Speeds(
        rk4_step_us=step_us,
        rk4_step_c_us=step_c_us,
        rk4_step_all_us=step_all_us,
        rk4_step_all_c_us=step_all_c_us,
        rk4_step_shared_us=step_shared_us,
        tick_us={key: tick.execution.summary()[key] for key in ("p50", "p99")},
        recording_us=recording_us,
        lockstep_x=lockstep_x,
        frames_sha256=frames_sha256,
        lateness_us=wall.lateness.summary(),
        execution_us=wall.execution.summary(),
        overruns=wall.overruns,
        tcp_frames_per_s=tcp_rate,
        realtime=[str(m) for m in measures],
        fleet=fleet,
        full_buses=full_buses,
        fleet_on_cores=fleet_on_cores,
        start=start,
        client=client,
    )


class _Master:
    """Sends a set point and a SYNC in each tick and receives the node's frames."""

    def __init__(self, bus: Bus, node_id: int) -> None:
        self._bus = bus
        self._id = node_id
        self._frames = [Frame(0x200 + node_id, struct.pack("<i", 500_000)), Frame(0x080)]

    def start(self, rig: Rig) -> None:
        """Bring the node into OPERATIONAL."""
        rig.step()
        self._bus.send([Frame(0x000, bytes([1, self._id]))])
        rig.step()

    def exchange(self) -> None:
        """Send this tick's frames and empty the receive queue."""
        self._bus.send(self._frames)
        while self._bus.receive():
            pass


def _typical(config: Configuration) -> dict[str, float]:
    """Return the actuator's parameters with every effect of the plant at its typical value."""
    plain = [e for e in config.effects if e.stage not in SAMPLED]
    return {**config.plant, **{e.field_of(p): p.typical for e in plain for p in e.params}}


def _with_everything(config: Configuration, cache: Path) -> Plant:
    """Return the actuator with every effect of the plant at its typical value."""
    return Plant(compiled(config.effects, cache), _typical(config), config.step)


def _two_on_one_supply(config: Configuration, cache: Path) -> Plant:
    """Return one of two equal actuators on one supply; a step of it integrates both."""
    lean = acting(config)
    return on_one_supply(compiled(lean.effects, cache, 2), [lean.plant] * 2, config.step)[0]


def _step_us(plant: Plant) -> float:
    def once() -> float:
        begin = time.perf_counter()
        plant.step(_STEPS)
        return (time.perf_counter() - begin) / _STEPS * 1e6

    return min(once() for _ in range(_REPEATS))


def _step_in_c_us(config: Configuration, cache: Path) -> float | None:
    exported = Exported(
        "bench", "bench", config.effects, config.plant, config.sensors, config.step, _STEPS_IN_C
    )
    try:
        plant = CompiledPlant(exported, compiled(config.effects, cache))
    except CompilerError:
        return None
    plant.start()

    def once() -> float:
        begin = time.perf_counter()
        for _ in range(_STEPS // _STEPS_IN_C):
            plant.tick()
        return (time.perf_counter() - begin) / _STEPS * 1e6

    return min(once() for _ in range(_REPEATS))


def _lockstep(rig: Rig, master: _Master) -> tuple[float, Timing]:
    """Return the best speed of several runs, and the ticks of that run.

    The master works between the ticks; its time is not counted.
    """
    best: tuple[float, Timing] = (0.0, Timing())
    for _ in range(_REPEATS):
        timing = Timing()
        elapsed = 0.0
        for _ in range(_TICKS):
            master.exchange()
            begin = time.perf_counter()
            run(rig, LockStep(), 1, timing)
            elapsed += time.perf_counter() - begin
        speed = _TICKS * rig.tick_ns * 1e-9 / elapsed
        if speed > best[0]:
            best = (speed, timing)
    return best


def _wall_clock(rig: Rig, master: _Master, duration: float) -> Timing:
    timing = Timing()
    origin_ns = rig.now_ns
    clock = WallClock(rig.tick_ns)
    while rig.now_ns - origin_ns < duration * 1e9:
        run(rig, clock, 1, timing)
        master.exchange()
    return timing


def _tcp_rate() -> float:
    """Return how many frames per second a client in another process takes from the server."""
    with Bus({"interface": "socketcand_server", "channel": "can0", "port": 0}) as bus:
        text = _CLIENT.format(port=bus.port, frames=_TCP_FRAMES)
        client = subprocess.Popen(
            [sys.executable, "-c", text],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # python-can warns of every frame that spans two reads
            text=True,
        )
        sent = 0
        burst = [Frame(0x180 + i, bytes(8)) for i in range(4)]
        while client.poll() is None:
            if bus.receive() or sent:
                bus.send(burst)
                sent += len(burst)
            else:
                bus.wait(0.1)
        return _TCP_FRAMES / float(client.communicate()[0])
