"""The DBC: every PDO of a recorded run decodes to what the sensors have reported."""

import re
import struct
from pathlib import Path

import canopen
import cantools
import numpy as np
import pytest
from rigs import bench

from hil_emulator.config.load import Configuration
from hil_emulator.device.node import Node
from hil_emulator.frame import Frame
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.simulation.emulator import Emulator
from hil_emulator.testing.lockstep_network import LockStepNetwork

SYNC = Frame(0x080)
START_ALL = Frame(0x000, b"\x01\x00")
NAMES = {channel.name for channel in CHANNELS}


def channel_of(signal: str) -> str:
    """Return the channel of a DBC signal, or ""."""
    name = re.sub(r"_(net_)?PV_(16|32)bit$|_value$", "", signal)
    return name if name in NAMES else ""


def load(folder: Path) -> cantools.database.Database:
    """Return the exported database."""
    return cantools.database.load_file(folder / "bus.dbc")


def test_every_pdo_is_there(folder: Path, made: list[Node]) -> None:
    """Identifier, length and cycle time of each active PDO are those of the node."""
    database = load(folder)
    expected = {
        (row.can_id, row.size, row.name) for node in made for row in node.pdo_map() if row.entries
    }
    messages = {(m.frame_id, m.length, m.name.rpartition("_")[2]) for m in database.messages}
    assert {message for message in messages if "PDO" in message[2]} == expected
    cycles = {m.frame_id: m.cycle_time for m in database.messages}
    for node in made:
        for row in node.pdo_map():
            if row.name.startswith("TPDO") and row.transmission_type >= 254 and row.entries:
                assert cycles[row.can_id] == (row.event_timer_ms or None)


def test_units_are_si(folder: Path) -> None:
    """Pressures are in pascal, forces in newton, positions in metre, set points in ampere."""
    units = {"pressure_a": "Pa", "load_force": "N", "position": "m"}
    for message in load(folder).messages:
        for signal in message.signals:
            channel = channel_of(signal.name)
            if channel in units:
                assert signal.unit == units[channel]
            if signal.name in ("set_point", "valve_current"):
                assert signal.unit == "A"
                assert signal.maximum == pytest.approx(0.010)


def drive(config: Configuration, folder: Path, ticks: int) -> int:
    """Run in lock-step with a moving set point; check each frame; return how many were."""
    database = load(folder)
    checked = 0
    with bench(config) as rig:
        rig.ticks(1)
        rig.tick(START_ALL)
        for tick in range(ticks):
            share = 0.5 * np.sin(tick * 2e-3 * np.pi)
            # The combined node takes INTEGER32 in nanoampere, the valve driver 0F and a share.
            combined = struct.pack("<i", round(share * 1e7))
            separate = struct.pack("<Hh", 0x0F, round(share * 16384))
            data = combined if len(config.nodes) == 1 else separate
            rig.tick(Frame(0x205, data), *([SYNC] if tick % 10 == 0 else []))
        table = rig.recorder.table()
        row_of = {round(t * 1e9): row for row, t in enumerate(table["time"])}
        for now_ns, sent, frame in rig.recorder.frames:
            described = sent and any(m.frame_id == frame.can_id for m in database.messages)
            if not described:
                continue
            message = database.get_message_by_frame_id(frame.can_id)
            for name, value in message.decode(frame.data).items():
                channel = channel_of(name)
                if channel:
                    signal = message.get_signal_by_name(name)
                    recorded = table[channel][row_of[now_ns]]
                    assert abs(value - recorded) <= signal.scale, (name, value, recorded)
                    checked += 1
        assert np.ptp(table["position"]) > 1e-4  # the actuator has moved
    return checked


def test_pdos_decode_to_the_sensors_readings(config: Configuration, folder: Path) -> None:
    """One second of all PDOs: each signal within one step of the recorded channel."""
    assert drive(config, folder, 1000) > 4000


@pytest.mark.full(sibling="test_pdos_decode_to_the_sensors_readings")
def test_ten_seconds_of_pdos_decode(config: Configuration, folder: Path) -> None:
    """Nothing drifts within ten seconds."""
    assert drive(config, folder, 10_000) > 40_000


def test_every_frame_of_a_run_has_its_message(config: Configuration, folder: Path) -> None:
    """Boot-up, NMT, SYNC, SDO with a stock master, EMCY and its end, heartbeat: all in words."""
    database = load(folder)
    decoded: dict[str, list[dict[str, object]]] = {}
    with Emulator(config) as emulator:
        network = LockStepNetwork(emulator)
        emulator.tick()
        master = network.add_node(5, canopen.import_od(str(config.nodes[0].eds), 5))
        master.sdo[0x1017].raw = 20
        network.nmt.send_command(1)
        network.sync.transmit()
        with emulator.fault("node5", "emcy", code="0x8130"):
            emulator.run_for("30 ms")
        emulator.run_for("30 ms")
        network.disconnect()
        for _, _, frame in emulator.recorder.frames:
            message = database.get_message_by_frame_id(frame.can_id)
            assert message.length == len(frame.data)
            name = message.name.removeprefix(f"{message.senders[0]}_")
            decoded.setdefault(name, []).append(message.decode(frame.data))
    assert {"command": "start", "node": 0} in decoded["NMT"]
    assert [m["error_code"] for m in decoded["EMCY"]] == ["life_guard_or_heartbeat", "none"]
    states = {str(m["state"]) for m in decoded["heartbeat"]}
    assert states == {"boot_up", "pre_operational", "operational"}
    assert decoded["SYNC"] == [{}]
    (request,) = (r for name in decoded if name.endswith("SDO_request") for r in decoded[name])
    assert request == {"command": "download_2_bytes", "index": 0x1017, "subindex": 0, "data": 20}
    assert [m["command"] for m in decoded["SDO_answer"]] == ["downloaded"]


def test_services_have_their_sender_and_period(folder: Path, made: list[Node]) -> None:
    """A node sends EMCY, answers and heartbeat; requests, NMT and SYNC are the controller's."""
    by_id = {m.frame_id: m for m in load(folder).messages}
    for node in made:
        number = node.node_id
        names = [by_id[base + number].senders for base in (0x080, 0x580, 0x700)]
        assert names[0] == names[1] == names[2] != ["controller"]
        period = node.dictionary.read(0x1017, 0)
        assert by_id[0x700 + number].cycle_time == (period or None)
        assert by_id[0x600 + number].senders == ["controller"]
        assert by_id[0x600 + number].signals[0].receivers == names[0]
    assert by_id[0x000].senders == by_id[0x080].senders == ["controller"]
    assert len(by_id[0x000].signals[0].receivers) == len(made)
