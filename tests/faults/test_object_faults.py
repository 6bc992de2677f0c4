"""Faults of single objects of a node by anybody's EDS, seen in its PDO and by SDO."""

import statistics
import struct
from collections.abc import Iterator
from pathlib import Path

import pytest
from foreign_nodes import Plant, plant

from hil_emulator.errors import UserError

TABLE = '{ table = [["0 s", 0], ["1 s", 1000]], repeat = true }'
NODE = (
    f'[[node]]\nid = 7\neds = "transmitter.eds"\nautostart = true\nmap = {{ "0x2090" = {TABLE} }}\n'
)


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Plant]:
    """Return a transmitter whose temperature rises by one digit in a millisecond."""
    with plant(tmp_path, NODE) as made:
        yield made


def shown(rig: Plant) -> list[tuple[int, int]]:
    """Return time [ms] and temperature of each of its PDOs."""
    values = [struct.unpack("<hBh", data)[2] for data in rig.data(0x187)]
    return list(zip(rig.times(0x187), values, strict=True))


def test_one_object_keeps_its_value(rig: Plant) -> None:
    """From its beginning to its end; then it shows the time again."""
    rig.emulator.run_for("30 ms")
    with rig.emulator.fault("node7.0x2090", "stuck"):
        rig.emulator.run_for("30 ms")
    rig.emulator.run_for("30 ms")
    assert [value for _, value in shown(rig)] == [11, 21, 31, 31, 31, 61, 71, 81]


def test_one_object_shows_something_else(rig: Plant) -> None:
    """The PDO shows it and so does SDO; it does not add up, and nothing of it stays."""
    with rig.emulator.fault("node7.0x2090:0", "offset", value=-5, duration="15 ms"):
        rig.emulator.run_for("20 ms")
    with rig.emulator.fault("0x2090", "constant", value=77, duration="15 ms"):
        rig.emulator.run_for("20 ms")
    rig.emulator.run_for("5 ms")
    assert shown(rig) == [(11, 6), (21, 77), (31, 77), (41, 41)]
    with rig.emulator.fault("0x7130:1", "offset", value="300"):
        rig.emulator.run_for("5 ms")
        assert rig.master(7).sdo[0x7130][1].raw == 300
    rig.emulator.tick()
    assert rig.master(7).sdo[0x7130][1].raw == 0


def test_noise_has_its_deviation(rig: Plant) -> None:
    """White noise of 20 digits on an object that stands still."""
    with rig.emulator.fault("node7.0x7130:1", "noise", deviation=20):
        rig.emulator.run_for("4 s")
    values = [struct.unpack("<hBh", data)[0] for data in rig.data(0x187)]
    assert statistics.pstdev(values) == pytest.approx(20, rel=0.15)
    assert statistics.fmean(values) == pytest.approx(0, abs=4)


def test_a_fault_grows(rig: Plant) -> None:
    """With a ramp an offset is half way there in the middle; no type is exceeded."""
    with rig.emulator.fault("node7.0x7130:1", "offset", value=100_000, ramp="1 s"):
        rig.emulator.run_for("111 ms")
        value, _, _ = struct.unpack("<hBh", rig.data(0x187)[-1])
        assert value == pytest.approx(11_000, rel=0.02)
        rig.emulator.run_for("500 ms")
        assert struct.unpack("<hBh", rig.data(0x187)[-1])[0] == 0x7FFF


@pytest.mark.parametrize("target", ["node7.0x3333:1", "node7.0x1008", "node5.0x7130:1"])
def test_an_object_must_be_there(rig: Plant, target: str) -> None:
    """One that no node has, or that is no number, is refused."""
    with pytest.raises(UserError, match="no node has such an object"):
        rig.emulator.fault(target, "stuck")
