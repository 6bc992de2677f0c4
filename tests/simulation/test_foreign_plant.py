"""The shipped foreign plant: a PLC configures valve, transmitter and encoder by DCF."""

import itertools
import struct
from collections.abc import Iterator
from pathlib import Path

import canopen
import pytest
from plc import configure, parameter_values

from hil_emulator.config.load import load
from hil_emulator.device.eds.load import commissioned
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.emulator import Emulator
from hil_emulator.testing.lockstep_network import LockStepNetwork

FOLDER = shipped("configs/foreign_plant.toml").parent / "foreign"
DEVICES = {5: "valve", 7: "transmitter", 8: "encoder"}
VALVE, TRANSMITTER, ENCODER = DEVICES
ACTIVATION = (0x08, 0x09, 0x0B, 0x0F)
"""Control words that lead to ACTIVE (CiA 408)."""
ACTIVE = 0x0F


def dcf(node_id: int) -> Path:
    """Return a device's DCF."""
    return FOLDER / f"{DEVICES[node_id]}_{node_id}.dcf"


class Plc:
    """A stock master on the plant's bus, after start-up."""

    def __init__(self, emulator: Emulator) -> None:
        self.emulator = emulator
        self.network = LockStepNetwork(emulator)
        emulator.tick()
        self.heard: dict[int, bytes] = {}
        self.nodes = {}
        self.network.send_periodic(0x700 + 0x7F, b"\x05", 0.05)
        for node_id in DEVICES:
            self.nodes[node_id] = configure(self.network, dcf(node_id), node_id)
            self.network.subscribe(0x180 + node_id, self._take)
        self.network.nmt.send_command(1)

    def _take(self, can_id: int, data: bytearray, timestamp: float) -> None:
        self.heard[can_id - 0x180] = bytes(data)

    def command(self, control: int, set_point: int) -> tuple[int, int]:
        """Send control word and set point; return status word and actual value."""
        data = struct.pack("<Hh", control, set_point)
        self.network.send_message(0x200 + VALVE, data)
        self.emulator.run_for("12 ms")
        status, actual = struct.unpack("<Hh", self.heard[VALVE])
        return status, actual


@pytest.fixture
def plc() -> Iterator[Plc]:
    """Return the controller on the configured plant."""
    config = load([shipped("configs/hyq_knee.toml"), shipped("configs/foreign_plant.toml")])
    with Emulator(config) as emulator:
        made = Plc(emulator)
        yield made
        made.network.disconnect()


def test_the_valve_is_activated_and_moves_the_piston(plc: Plc) -> None:
    """The valve is activated by the states of CiA 408, and the encoder shows the motion."""
    begin = plc.emulator.signals.position
    for control in ACTIVATION:
        status, _ = plc.command(control, 0)
    assert status & 0x0F == ACTIVE
    for _ in range(20):
        status, actual = plc.command(0x0F, 3000)
    assert actual == 3000
    assert plc.emulator.rig.value("valve_current") == pytest.approx(3000 / 16384 * 0.010, rel=1e-3)
    (steps,) = struct.unpack("<i", plc.heard[ENCODER])
    assert abs(plc.emulator.signals.position - begin) > 1e-3
    assert steps * 5e-6 == pytest.approx(plc.emulator.signals.position, abs=2e-3)


def test_limits_of_the_dcf_apply(plc: Plc) -> None:
    """0x6320 and 0x6321 limit the set point to 50 %."""
    for control in ACTIVATION:
        plc.command(control, 0)
    assert plc.command(0x0F, 16384)[1] == 8192
    assert plc.command(0x0F, -16384)[1] == -8192


def test_the_transmitter_uses_the_pdo_of_the_dcf(plc: Plc) -> None:
    """Its PDO has pressure in hundredths of a bar and status, every 10 ms."""
    plc.emulator.run_for("50 ms")
    value, status = struct.unpack("<hB", plc.heard[TRANSMITTER])
    assert value / 100 == pytest.approx(plc.emulator.signals.pressure_a / 1e5, abs=0.5)
    assert status == 0
    frames = plc.emulator.recorder.frames
    times = [t // 1_000_000 for t, sent, f in frames if sent and f.can_id == 0x187]
    assert {b - a for a, b in itertools.pairwise(times)} == {10}


def test_the_valve_detects_a_lost_controller(plc: Plc) -> None:
    """By 0x1016: without heartbeat EMCY 0x8130 is sent after 100 ms, and the valve goes to HOLD."""
    for control in ACTIVATION:
        plc.command(control, 0)
    plc.command(0x0F, 3000)
    plc.network.tasks.clear()
    plc.emulator.run_for("150 ms")
    emergencies = [
        f.data for _, sent, f in plc.emulator.recorder.frames if sent and f.can_id == 0x85
    ]
    assert emergencies[-1][:2] == b"\x30\x81"
    assert plc.emulator.rig.value("valve_current") == 0.0


@pytest.mark.parametrize("node_id", DEVICES)
def test_stock_tools_read_the_files_the_same(node_id: int) -> None:
    """EDS and DCF differ only in the parameter values and the node-ID."""
    name = DEVICES[node_id]
    assert commissioned(dcf(node_id)) == node_id
    plain = canopen.import_od(str(FOLDER / f"{name}.eds"), node_id)
    configured = canopen.import_od(str(dcf(node_id)), node_id)
    assert set(plain) == set(configured)
    assert parameter_values(FOLDER / f"{name}.eds", node_id) == {}
    assert len(parameter_values(dcf(node_id), node_id)) >= 5
