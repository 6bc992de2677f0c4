"""EDS and DCF: an independent checker finds no fault, and who loads them has the same device."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import canopen
import pytest
from canopen.objectdictionary.eds import import_eds
from exported import files

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node

REALS = canopen.objectdictionary.datatypes.FLOAT_TYPES


@pytest.mark.parametrize("ending", ["eds", "dcf"])
def test_the_independent_checker_has_nothing_to_say(
    folder: Path, made: list[Node], ending: str
) -> None:
    """`dcfchk` of dcf-tools ends with 0 and prints no warning."""
    pytest.importorskip("dcf", reason="dcf-tools is not installed")
    program = Path(sys.executable).with_name("dcfchk")
    for node in made:
        command = [program, "-n", str(node.node_id), files(folder, node, ending)]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        assert (result.returncode, result.stderr) == (0, "")


def variables(path: str, node_id: int) -> dict[tuple[int, int], Any]:
    """Return every variable of a file as the stock library reads it."""
    objects_read: dict[tuple[int, int], Any] = {}
    objects = import_eds(path, node_id)
    for index in objects:
        item = objects[index]
        members = [item] if isinstance(item, canopen.objectdictionary.ODVariable) else item.values()
        objects_read |= {(index, member.subindex): member for member in members}
    return objects_read


@pytest.mark.parametrize("ending", ["eds", "dcf"])
def test_the_stock_library_loads_the_same_objects(
    folder: Path, made: list[Node], ending: str
) -> None:
    """Every object is there, with the name, type, access, limits and mapping of the source."""
    for node in made:
        ours = variables(str(files(folder, node, ending)), node.node_id)
        theirs = variables(node.dictionary.source, node.node_id)
        assert ours.keys() == theirs.keys()
        for key, mine in ours.items():
            other = theirs[key]
            for name in ("name", "data_type", "access_type", "pdo_mappable", "min", "max"):
                assert getattr(mine, name) == getattr(other, name), (key, name)


def test_the_stock_library_loads_the_defaults_in_force(folder: Path, made: list[Node]) -> None:
    """The default of each integer and string is the emulator's own."""
    for node in made:
        for key, variable in variables(str(files(folder, node, "eds")), node.node_id).items():
            entry = node.dictionary.entry(*key) if key[0] >= 0x1000 else None
            if entry is None or entry.default is None or variable.data_type in REALS:
                continue
            default = variable.default
            if isinstance(default, str):
                default = default.encode("latin-1")
            assert default == entry.default, entry


def test_no_tool_reads_a_wrong_real_number(folder: Path, made: list[Node]) -> None:
    """A real number other than zero stands where no tool can take it for another one."""
    for node in made:
        for key, variable in variables(str(files(folder, node, "eds")), node.node_id).items():
            if variable.data_type in REALS:
                assert variable.default in (None, node.dictionary.entry(*key).default)


ATTRIBUTES = ("name", "access", "mappable", "low", "high", "unit", "signal", "delta", "type")


@pytest.mark.parametrize("ending", ["eds", "dcf"])
def test_the_emulator_loads_the_same_device(folder: Path, made: list[Node], ending: str) -> None:
    """An exported file can stand in for the original: bindings, scaling and reals included."""
    for node in made:
        again = Dictionary.from_eds(files(folder, node, ending), node.node_id)
        source = Dictionary.from_eds(Path(node.dictionary.source), node.node_id)
        for entry in node.dictionary:
            twin = again.entry(entry.index, entry.subindex)
            origin = source.entry(entry.index, entry.subindex)
            for name in ATTRIBUTES:
                assert getattr(twin, name) == getattr(origin, name), (entry, name)
            assert twin.factor == entry.factor
            if ending == "eds" and entry.default is not None:
                assert twin.default == entry.default, entry


def test_a_dcf_holds_what_was_configured(folder: Path, made: list[Node]) -> None:
    """The DCF names the node-ID, and gives every parameter the value it has now."""
    for node in made:
        path = files(folder, node, "dcf")
        objects = import_eds(str(path), None)
        assert objects.node_id == node.node_id
        assert objects.bitrate == 1_000_000
        objects_read = variables(str(path), node.node_id)
        assert objects_read[0x1017, 0].value == node.dictionary.read(0x1017)
        assert objects_read[0x1800, 1].value == 0x180 + node.node_id


def test_an_export_of_an_export_is_the_same(folder: Path, made: list[Node]) -> None:
    """Nothing is lost or doubled by going round."""
    from hil_emulator.export.electronic_data_sheet import eds

    for node in made:
        path = files(folder, node, "eds")
        again = Dictionary.from_eds(path, node.node_id)
        assert sorted(eds(again, path.name).splitlines()) == sorted(
            path.read_text(encoding="latin-1").splitlines()
        )
