"""Punctuality with a client that sends set points and SYNC over TCP at the loop's rate."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from hil_emulator.bench.cyclictest import lateness_p99_us
from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import Configuration
from hil_emulator.simulation.assembly import assemble
from hil_emulator.simulation.clock import WallClock
from hil_emulator.simulation.loop import Timing, run
from hil_emulator.simulation.rig import Rig

RATES = (1_000, 2_000, 4_000, 5_000)
"""Tick rates to measure [1/s], in this order."""

HELD = 0.01
"""Share of ticks that may begin a whole period late (assumed)."""

_SETTLING_S = 0.5

# Starts the node, then sends a set point and a SYNC each period and reads the received frames.
_CLIENT = """
import socket, sys, time
port, node, period = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
line = socket.create_connection(("127.0.0.1", port))
line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
for command in (b"", b"< open can0 >", b"< rawmode >"):
    line.sendall(command)
    line.recv(100)
time.sleep(0.1)
line.sendall(b"< send 0 2 1 %x >" % node)
line.setblocking(False)
due = time.perf_counter()
while True:
    try:
        line.sendall(b"< send %x 4 20 a1 7 0 >< send 80 0 >" % (0x200 + node))
        line.recv(1 << 16)
    except BlockingIOError:
        pass
    due += period
    time.sleep(max(0.0, due - time.perf_counter()))
"""


@dataclass(frozen=True)
class ClientCost:
    """Timing in real time with a client; durations in microseconds.

    Attributes:
        idle_us: p50, p99, p999 and max of the ticks' duration without a client.
        execution_us: p50, p99, p999 and max of the ticks' duration with the client, at the lowest
            of `RATES`.
        lateness_us: p50, p99, p999 and max of the lateness of these ticks.
        system_us: p99 of the wake-up lateness of `cyclictest` at 1 kHz; None if not installed.
        held_hz: the highest of `RATES` that was held with the client, else 0.

    """

    idle_us: dict[str, float]
    execution_us: dict[str, float]
    lateness_us: dict[str, float]
    system_us: float | None
    held_hz: int


def measure_with_client(config: Configuration, cache: Path, duration: float) -> ClientCost:
    """Run with a client at each rate for `duration` [s]."""
    idle = Timing()
    timings: list[Timing] = []
    for rate in RATES:
        tick_ns = 1_000_000_000 // rate
        steps = max(1, round(tick_ns * 1e-9 / config.step))
        faster = replace(config, tick_ns=tick_ns, steps=steps, step=tick_ns * 1e-9 / steps)
        with Bus({"interface": "socketcand_server", "channel": "can0", "port": 0}) as bus:
            rig, clock = assemble(faster, bus, cache), WallClock(tick_ns)
            if not timings:
                run(rig, clock, round(duration * rate), idle)
            with _client(bus, rig):
                run(rig, clock, round(_SETTLING_S * rate), Timing())
                timings.append(Timing())
                run(rig, clock, round(duration * rate), timings[-1])
        if timings[-1].overruns > HELD * timings[-1].ticks:
            break
    held = [rate for rate, t in zip(RATES, timings, strict=False) if t.overruns <= HELD * t.ticks]
    execution, lateness = timings[0].execution.summary(), timings[0].lateness.summary()
    return ClientCost(
        idle.execution.summary(), execution, lateness, lateness_p99_us(duration),
        max(held, default=0),
    )  # fmt: skip


@contextmanager
def _client(bus: Bus, rig: Rig) -> Iterator[None]:
    """Keep a client in another process connected while the context is open."""
    arguments = [str(bus.port), str(rig.nodes[0].node_id), str(rig.tick_ns * 1e-9)]
    client = subprocess.Popen([sys.executable, "-c", _CLIENT, *arguments])
    try:
        yield
    finally:
        client.kill()
        client.wait()
