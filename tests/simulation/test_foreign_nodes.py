"""Nodes with the EDS of any maker: objects, frames and answers to a stock master."""

import struct
from pathlib import Path

import canopen
import pytest
from foreign_nodes import TRANSMITTER, plant

from hil_emulator.errors import UserError

NODE = '[[node]]\nid = 7\neds = "transmitter.eds"\n'
OPERATIONAL, PRE_OPERATIONAL = 5, 127
WAITING = 0


def test_a_makers_transmitter_uses_its_layout(tmp_path: Path) -> None:
    """The PV is in tenths of a bar by 0x6131 and 0x6132, with status and a constant temperature."""
    with plant(tmp_path, NODE + 'map = { "0x7130:1" = "pressure_a" }\n') as rig:
        rig.network.nmt.send_command(1)
        rig.emulator.run_for("100 ms")
        value, status, temperature = struct.unpack("<hBh", rig.data(0x187)[-1])
        assert value == pytest.approx(rig.emulator.signals.pressure_a / 1e4, abs=2)
        assert (status, temperature) == (0, 250)
        assert len(rig.data(0x187)) == 10


def test_without_a_map_it_is_a_silent_partner(tmp_path: Path) -> None:
    """It boots, answers, sends the configured heartbeat, and has defaults in its PDO."""
    with plant(tmp_path, NODE) as rig:
        assert rig.data(0x707) == [b"\0"]
        node = rig.master(7)
        assert node.sdo[0x1008].raw == "PT-404 250bar"
        node.sdo[0x1017].raw = 20
        rig.emulator.run_for("50 ms")
        assert rig.data(0x707)[1:] == [bytes([PRE_OPERATIONAL])] * 3
        assert rig.data(0x187) == []
        node.nmt.state = "OPERATIONAL"
        rig.emulator.run_for("15 ms")
        assert rig.data(0x187)[0] == struct.pack("<hBh", 0, 0, 250)


def test_a_digit_may_be_set_in_the_configuration(tmp_path: Path) -> None:
    """`unit` is the value of a digit, with priority over the EDS; one channel at two objects."""
    text = """
        [node.map]
        "0x7130:1" = { channel = "supply_pressure", unit = "1 mbar" }
        "0x2090" = { channel = "supply_pressure", unit = "1 bar" }
    """
    with plant(tmp_path, NODE + text) as rig:
        rig.network.nmt.send_command(1)
        rig.emulator.run_for("20 ms")
        value, _, bar = struct.unpack("<hBh", rig.data(0x187)[-1])
        assert value == 0x7FFF  # 160 bar are more than 16 bits of millibar: saturated
        assert bar == pytest.approx(rig.emulator.signals.supply_pressure / 1e5, abs=1)


@pytest.mark.parametrize(
    ("course", "shown"),
    [
        ("300", [300, 300, 300]),
        ('{ ramp = [100, 300], time = "20 ms" }', [210, 300, 300]),
        ('{ table = [["0 s", 0], ["10 ms", 100], ["20 ms", 0]], repeat = true }', [90, 10, 90]),
        ('{ file = "oil.csv", column = "oil" }', [41, 50, 50]),
        ('{ ramp = [0, 1e6], time = "1 ms" }', [0x7FFF, 0x7FFF, 0x7FFF]),
        ('{ constant = "30 °C", unit = "0.1 °C" }', [300, 300, 300]),
        ('{ constant = "30 °C", unit = "0.1 K" }', [3031, 3031, 3031]),
        ('{ ramp = ["1 bar", "3 bar"], time = "20 ms", unit = "1 kPa" }', [210, 300, 300]),
    ],
)
def test_objects_follow_a_course(tmp_path: Path, course: str, shown: list[int]) -> None:
    """A constant, a ramp, a table or a CSV file, within the type; values at 11, 21 and 31 ms."""
    (tmp_path / "oil.csv").write_text("time,water,oil\n0,1,30\n0.02,1,50\n")
    with plant(tmp_path, NODE + f'autostart = true\nmap = {{ "0x2090" = {course} }}\n') as rig:
        rig.emulator.run_for("40 ms")
        assert rig.times(0x187) == [11, 21, 31]
        assert [struct.unpack("<hBh", data)[2] for data in rig.data(0x187)] == shown


def test_autostart_needs_no_master(tmp_path: Path) -> None:
    """The node is OPERATIONAL after its boot-up, and again after a reset."""
    with plant(tmp_path, NODE + "autostart = true\n") as rig:
        node = rig.emulator.rig.nodes[1]
        assert (rig.data(0x707), node.state) == ([b"\0"], OPERATIONAL)
        rig.network.nmt.send_command(129)
        rig.emulator.tick()
        assert (rig.data(0x707), node.state) == ([b"\0", b"\0"], OPERATIONAL)


@pytest.mark.parametrize(("startup", "state"), [(0, 5), (4, 127), (1, 127), (8, 5)])
def test_the_eds_may_start_the_node(tmp_path: Path, startup: int, state: int) -> None:
    """Bits 0 and 2 of 0x1F80: a slave that does not wait for its master (CiA 302-2)."""
    more = f"[1F80]\nParameterName=NMT startup\nDataType=7\nAccessType=rw\nDefaultValue={startup}\n"
    (tmp_path / "own.eds").write_text(TRANSMITTER + more)
    with plant(tmp_path, NODE.replace("transmitter", "own")) as rig:
        assert rig.emulator.rig.nodes[1].state == state


def test_identity_is_the_configurations(tmp_path: Path) -> None:
    """Vendor, product, revision, serial number and name replace those of the file."""
    identity = 'identity = { vendor_id = 1, product_code = 2, device_name = "X" }\n'
    with plant(tmp_path, NODE + "serial_number = 99\n" + identity) as rig:
        sdo = rig.master(7).sdo
        assert [sdo[0x1018][n].raw for n in (1, 2, 3, 4)] == [1, 2, 0x10000, 99]
        assert sdo[0x1008].raw == "X"


def test_three_transmitters_have_one_eds(tmp_path: Path) -> None:
    """Each transmitter shows only its channel."""
    channels = ("pressure_a", "pressure_b", "supply_pressure")
    text = "".join(
        NODE.replace("7", str(7 + n), 1) + f'map = {{ "0x7130:1" = "{channel}" }}\n'
        for n, channel in enumerate(channels)
    )
    with plant(tmp_path, text) as rig:
        rig.network.nmt.send_command(1)
        rig.emulator.run_for("50 ms")
        shown = [struct.unpack_from("<h", rig.data(0x187 + n)[-1])[0] for n in range(3)]
        truth = [rig.emulator.rig.value(channel) / 1e4 for channel in channels]
        assert shown == pytest.approx(truth, abs=2)
        serials = {node.dictionary.read(0x1018, 4) for node in rig.emulator.rig.nodes}
        assert len(serials) == 4


def test_a_new_device_gets_its_node_id_by_lss(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two equal nodes without a node-ID are silent until a stock master assigns node-IDs."""
    monkeypatch.setattr("canopen.lss.time.sleep", lambda seconds: None)
    monkeypatch.setattr(canopen.lss.LssMaster, "RESPONSE_TIMEOUT", 0)
    unconfigured = NODE.replace("id = 7", 'id = "unconfigured"')
    with plant(tmp_path, unconfigured * 2) as rig:
        heard = {f.can_id for _, sent, f in rig.emulator.recorder.frames if sent}
        assert heard == {0x705}
        for node_id in (0x31, 0x32):
            there, _ = rig.network.lss.fast_scan()
            assert there
            rig.network.lss.configure_node_id(node_id)
            rig.network.lss.send_switch_state_global(WAITING)
            rig.emulator.tick()
            node = rig.master(node_id)
            assert node.sdo[0x1800][1].raw == 0x40000180 + node_id
        assert rig.data(0x731) == rig.data(0x732) == [b"\0"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('map = { "0x5FFF" = 1 }', "has no object 0x5FFF:00"),
        ('map = { "0x1008" = "position" }', "a VISIBLE_STRING is not a number"),
        ('map = { "0x2090" = 70000 }', "0x2090:00 Temperature: 70000 is refused"),
        ('map = { "2090" = 1 }', "node.1.map: '2090' is not an object; write it as"),
        ('map = { "0x2090" = "presure" }', "0x2090: no channel or command 'presure', did you"),
        ('map = { "0x2090" = "presure", "6130" = 1 }', "\n    '6130' is not an object"),
        (
            'map = { "0x2090" = { channel = "position", unit = "1 bar" } }',
            "is a pressure; a",
        ),
        ('map = { "0x2090" = { ramp = [1, 2, 3] } }', "a ramp goes from one value to another"),
        ('map = { "0x2090" = { ramp = [1, 2] } }', "0x2090: "),
        ('map = { "0x2090" = { table = [["1 s", 1], ["0 s", 2]] } }', "rise from row to row"),
        ('map = { "0x2090" = { table = [["1 s", "x"]] } }', "'x' is no number of a course"),
        ('map = { "0x2090" = { file = "no.csv" } }', "no.csv: cannot be read"),
        ('map = { "0x2090" = { table = [["0 s", 1], ["1e300 s", 2]] } }', "later than 1e+09 s"),
        ('map = { "0x2090" = { constant = 1, unit = "1 m" } }', "1 has no unit; write it as text"),
        ('map = { "0x2090" = { constant = "1 s", unit = "1 m" } }', '"1 s" cannot be counted in'),
        ('map = { "0x2090" = { file = "x", unit = "1 m" } }', "unknown key 'unit'"),
        ('map = { "0x2090" = { value = 1 } }', "give one of channel, command, constant"),
        ('map = { "0x2090" = 1, "0x2090:0" = 2 }', "0x2090:00 stands there twice"),
        ('map = "position"', "is a table of objects"),
        ('map = { "0x2090" = "valve_current" }', "no RPDO-mappable object"),
        ('identity = { hardware_version = "1" }', "no object 0x1009:00 for the identity"),
        ('bit_rate = "1 Mbit/s"', "not supported by the device, which has 250, 500"),
        ('commands = ["valve_current"]', "no RPDO-mappable object 'valve_current'"),
    ],
)
def test_a_mistake_is_reported_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    """Wrong entries are refused before the run."""
    with pytest.raises(UserError) as refusal, plant(tmp_path, NODE + text + "\n"):
        pass
    assert message in str(refusal.value)
