"""The main job on real input: a stock CANopen master in another process drives the emulator."""

import itertools
import re
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import canopen
import pytest

from hil_emulator.platform.paths import shipped

NODE = 5


@contextmanager
def emulator(tmp_path: Path, *options: str) -> Iterator[tuple[int, subprocess.Popen[str]]]:
    """Run the emulator on a free TCP port in another process; yield the port and the process."""
    layer = tmp_path / "port.toml"
    layer.write_text('[bus]\ninterface = "socketcand_server"\nport = 0\n')
    command = [sys.executable, "-m", "hil_emulator", "run", str(shipped("configs/hyq_knee.toml"))]
    process = subprocess.Popen(
        [*command, str(layer), *options], stdout=subprocess.PIPE, text=True, bufsize=1
    )
    try:
        assert process.stdout is not None
        lines = iter(process.stdout.readline, "")
        match = next(m for line in lines if (m := re.search(r"127\.0\.0\.1:(\d+)", line)))
        yield int(match[1]), process
    finally:
        process.terminate()
        process.communicate(timeout=30)


@pytest.fixture
def network(tmp_path: Path) -> Iterator[canopen.Network]:
    """Yield a stock master connected to an emulator."""
    with emulator(tmp_path) as (port, _):
        network = canopen.Network()
        network.connect(interface="socketcand", host="127.0.0.1", port=port, channel="can0")
        yield network
        network.disconnect()


class Counters:
    """Collects the sample counters of the TPDOs."""

    def __init__(self, network: canopen.Network) -> None:
        self.seen: dict[int, list[int]] = {0x185: [], 0x285: [], 0x385: []}
        for can_id in self.seen:
            network.subscribe(can_id, self._take)

    def _take(self, can_id: int, data: bytearray, timestamp: float) -> None:
        self.seen[can_id].append(struct.unpack_from("<H", data, len(data) - 2)[0])

    def missing(self) -> dict[int, int]:
        """Return how many samples each TPDO has skipped."""
        return {
            can_id: sum((b - a - 1) % 0x10000 for a, b in itertools.pairwise(c))
            for can_id, c in self.seen.items()
        }


def drive(network: canopen.Network, seconds: float) -> Counters:
    """Start the node, send 1 kHz of set points for a while, and collect the counters."""
    counters = Counters(network)
    node = network.add_node(NODE, str(shipped("eds/hydraulic_actuator.eds")))
    node.nmt.state = "OPERATIONAL"
    period = network.send_periodic(0x200 + NODE, struct.pack("<i", 300_000), 0.001)
    time.sleep(seconds)
    period.stop()
    return counters


def test_a_stock_master_finds_configures_and_drives_the_node(network: canopen.Network) -> None:
    """Boot-up after a reset, identity and name by SDO, then motion seen in the PDOs."""
    node = network.add_node(NODE, str(shipped("eds/hydraulic_actuator.eds")))
    booted = threading.Event()
    # a master that begins to wait after the command may do so after the boot-up
    node.nmt.add_heartbeat_callback(lambda state: booted.set() if state == 0 else None)
    node.nmt.send_command(129)
    assert booted.wait(10)
    assert node.sdo[0x1008].raw == "Hydraulic actuator emulator"
    assert node.sdo[0x1018][0].raw >= 1
    node.tpdo.read()
    before = node.sdo["position"].phys
    node.nmt.state = "OPERATIONAL"
    for _ in range(200):
        node.sdo["valve_current"].phys = 1e-3
    node.nmt.wait_for_heartbeat(5)
    assert node.nmt.state == "OPERATIONAL"
    assert node.sdo["position"].phys > before + 0.001
    assert node.sdo["pressure_a"].phys > 1e5


def test_no_sample_is_missed(network: canopen.Network) -> None:
    """Through 2 s of set points at 1 kHz every TPDO carries every sample."""
    counters = drive(network, 2.0)
    assert counters.missing() == {0x185: 0, 0x285: 0, 0x385: 0}
    assert all(len(c) > 500 for c in counters.seen.values())


@pytest.mark.slow
def test_no_sample_is_missed_in_twenty_seconds(network: canopen.Network) -> None:
    """Through 20 s of set points at 1 kHz every TPDO carries every sample."""
    counters = drive(network, 20.0)
    assert counters.missing() == {0x185: 0, 0x285: 0, 0x385: 0}
    assert all(len(c) > 10_000 for c in counters.seen.values())


def test_the_clients_sync_can_be_the_clock(tmp_path: Path) -> None:
    """Under follow-SYNC a master gets exactly one synchronous PDO per SYNC, at its own pace."""
    with emulator(tmp_path, "--clock", "follow-sync") as (port, _):
        bus = can.Bus(interface="socketcand", host="127.0.0.1", port=port, channel="can0")

        def send(can_id: int, data: bytes) -> None:
            bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

        def wait_for(can_id: int) -> can.Message:
            while (message := bus.recv(10)) is not None:
                if message.arbitration_id == can_id:
                    return message
            raise AssertionError(f"no {can_id:X}")

        send(0x600 + NODE, bytes.fromhex("4000100000000000"))
        assert wait_for(0x580 + NODE).data.hex() == "4300100098010000"
        send(0x000, bytes([1, NODE]))
        for _ in range(20):
            send(0x080, b"")
            wait_for(0x480 + NODE)
        late = [m for m in iter(lambda: bus.recv(0.2), None) if m.arbitration_id == 0x485]
        assert late == []
        bus.shutdown()


@pytest.mark.skipif(
    signal.getsignal(signal.SIGINT) == signal.SIG_IGN,
    reason="a background job of a shell ignores Ctrl-C, and so does what it starts",
)
def test_ctrl_c_ends_with_a_summary(tmp_path: Path) -> None:
    """An interrupted run prints its punctuality and exits with code 0."""
    with emulator(tmp_path) as (_, process):
        threading.Event().wait(0.3)
        process.send_signal(signal.SIGINT)
        text, _ = process.communicate(timeout=30)
        assert "lateness  p50" in text
        assert "frames " in text
        assert process.returncode == 0
