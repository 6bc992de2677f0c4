"""The EDS of a device: its required content, and the messages for wrong content."""

from pathlib import Path

import canopen
import pytest
from device_master import CHANNELS, EDS, NODE_ID
from edited_eds import added, edited

from hil_emulator.device.abort import SdoAbort
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node
from hil_emulator.errors import UserError

COMMANDS = {"valve_current": 0.0}


def test_shipped_eds_loads_without_loss() -> None:
    """Every object and default of the stock import is in the dictionary."""
    dictionary = Dictionary.from_eds(EDS, NODE_ID)
    stock = canopen.import_od(str(EDS), NODE_ID)
    variables = [
        variable
        for index, item in stock.items()
        if index >= 0x1000
        for variable in (item.values() if hasattr(item, "subindices") else [item])
    ]
    assert len(variables) == len(list(dictionary))
    for variable in variables:
        entry = dictionary.entry(variable.index, variable.subindex)
        stock_default = 0 if variable.default is None else variable.default
        if isinstance(stock_default, str):
            stock_default = stock_default.encode()
        assert (entry.name, entry.access, entry.default) == (
            variable.name,
            variable.access_type,
            stock_default,
        )


def test_shipped_eds_lists_its_objects() -> None:
    """The object lists of CiA 306 name each object once, and no other."""
    stock = canopen.import_od(str(EDS), NODE_ID)
    listed = [
        int(line.split("=")[1], 16)
        for line in EDS.read_text().splitlines()
        if line.split("=")[0].isdigit() and "=0x" in line
    ]
    assert sorted(listed) == [index for index in stock if index >= 0x1000]


@pytest.mark.parametrize("node_id", [-1, 0, 128])
def test_node_id_has_a_range(node_id: int) -> None:
    """A node-ID outside 1 to 127 is refused with the range."""
    with pytest.raises(UserError, match="1 to 127"):
        Dictionary.from_eds(EDS, node_id)


def test_missing_file_is_named() -> None:
    """The message for a missing file has its path."""
    with pytest.raises(UserError, match=r"nowhere\.eds"):
        Dictionary.from_eds(Path("nowhere.eds"), NODE_ID)


@pytest.mark.filterwarnings("ignore:The 'warn' method:DeprecationWarning:canopen")
@pytest.mark.parametrize("text", ["hello", "[2000]\nno=name\n", "[2000]\nParameterName=x\n", ""])
def test_other_files_are_refused(tmp_path: Path, text: str) -> None:
    """A file that is not an EDS is refused, and the message has its path."""
    path = tmp_path / "other.eds"
    path.write_text(text)
    with pytest.raises(UserError, match=r"other\.eds"):
        Dictionary.from_eds(path, NODE_ID)


@pytest.mark.parametrize("index", ["1000", "1001"])
def test_mandatory_objects_are_required(tmp_path: Path, index: str) -> None:
    """An EDS without device type or error register is refused."""
    with pytest.raises(UserError, match=f"0x{index}"):
        Dictionary.from_eds(edited(tmp_path, (f"[{index}]\n", "[5FFF]\n")), NODE_ID)


@pytest.mark.parametrize("section", ["2010", "1A00Sub0"])
def test_objects_are_described_once(tmp_path: Path, section: str) -> None:
    """A second section of the same object is refused, in any case of letters."""
    with pytest.raises(UserError, match=rf"(?i)describes one object twice: .*{section}"):
        Dictionary.from_eds(edited(tmp_path, added(section, 7)), NODE_ID)


@pytest.mark.parametrize(
    ("data_type", "line", "message"),
    [
        (0x05, "DefaultValue=256", "DefaultValue: 256 does not fit a UNSIGNED8"),
        (0x04, "DefaultValue=0x100000000", "DefaultValue: .* does not fit a INTEGER32"),
        (0x05, "CompactSubObj=many", "CompactSubObj: 'many' is not a number"),
        (0x05, "CompactSubObj=255", "CompactSubObj: 255 is not 0 to 254"),
        (0x00, "", "DataType: is missing"),
    ],
)
def test_bad_values_are_refused_with_their_place(
    tmp_path: Path, data_type: int, line: str, message: str
) -> None:
    """The message for a value beyond the range of its type has the section."""
    path = edited(tmp_path, added("2FFF", data_type, line))
    with pytest.raises(UserError, match=message) as refusal:
        Dictionary.from_eds(path, NODE_ID)
    assert "[2FFF]" in str(refusal.value)


@pytest.mark.parametrize(
    ("data_type", "low", "high", "inside", "outside"),
    [
        (0x08, "-0.5", "1.5", 1.5, 1.6),  # REAL32
        (0x10, "0xFFFFF0", "0x10", -16, -17),  # INTEGER24, limits in hexadecimal
        (0x16, "$NODEID+1", "100", 6, 5),  # UNSIGNED24 relative to the node-ID
    ],
)
def test_limits_lost_by_the_stock_import_are_kept(
    tmp_path: Path, data_type: int, low: str, high: str, inside: float, outside: float
) -> None:
    """An SDO client cannot exceed limits of REAL32 and of unusual widths."""
    path = edited(tmp_path, added("2FFF", data_type, f"LowLimit={low}", f"HighLimit={high}"))
    dictionary = Dictionary.from_eds(path, NODE_ID)
    dictionary.write(0x2FFF, 0, inside)
    with pytest.raises(SdoAbort):
        dictionary.write(0x2FFF, 0, outside)
    assert dictionary.read(0x2FFF) == inside


def test_compact_arrays_have_their_members(tmp_path: Path) -> None:
    """CompactSubObj creates its number of members, and sub-index 0 is this number."""
    lines = ("ObjectType=0x8", "CompactSubObj=3", "DefaultValue=4")
    dictionary = Dictionary.from_eds(edited(tmp_path, added("2FFF", 7, *lines)), NODE_ID)
    assert [dictionary.read(0x2FFF, n) for n in range(4)] == [3, 4, 4, 4]
    with pytest.raises(SdoAbort):
        dictionary.read(0x2FFF, 4)


def test_parameter_value_of_a_dcf_counts(tmp_path: Path) -> None:
    """A DCF's ParameterValue is the value after a reset."""
    path = edited(tmp_path, ("DefaultValue=100\n", "DefaultValue=100\nParameterValue=250\n"))
    assert Dictionary.from_eds(path, NODE_ID).read(0x1017) == 250


def test_an_object_that_nothing_feeds_is_named_with_its_tpdo(tmp_path: Path) -> None:
    """It is transmitted with its default value."""
    path = edited(tmp_path, ("ParameterName=pressure_a", "ParameterName=pressure_x"))
    node = Node(Dictionary.from_eds(path, NODE_ID), CHANNELS, COMMANDS)
    ((name, entry),) = node.unfed()
    assert (name, entry.where, entry.value) == ("TPDO1", "0x2010:00", 0)
    assert Node(Dictionary.from_eds(EDS, NODE_ID), CHANNELS, COMMANDS).unfed() == []


def test_command_without_object_stops_the_start() -> None:
    """The message names a command without a set point in the EDS."""
    with pytest.raises(UserError, match="'flow'"):
        Node(Dictionary.from_eds(EDS, NODE_ID), CHANNELS, {**COMMANDS, "flow": 0.0})


def test_command_must_be_mappable(tmp_path: Path) -> None:
    """A read-only object cannot be a set point."""
    with pytest.raises(UserError, match="'load_force'"):
        Node(Dictionary.from_eds(EDS, NODE_ID), CHANNELS, {"load_force": 0.0})


def test_safe_value_beyond_the_limits_stops_the_start() -> None:
    """A safe current of 20 mA does not fit limits of 10 mA."""
    with pytest.raises(UserError, match="valve_current"):
        Node(Dictionary.from_eds(EDS, NODE_ID), CHANNELS, {"valve_current": 0.02})


@pytest.mark.parametrize(
    ("old", "new", "section", "message"),
    [
        ("DefaultValue=0x20100010", "DefaultValue=0x2FFF0010", "1A00", "0x2FFF:00 does not exist"),
        ("DefaultValue=0x20100010", "DefaultValue=0x20100020", "1A00", "16 bits, not 32"),
        ("DefaultValue=0x20000020", "DefaultValue=0x20100010", "1600", "0x2010:00 is ro"),
    ],
)
def test_a_pdo_that_cannot_be_mapped_does_not_exist(
    tmp_path: Path, old: str, new: str, section: str, message: str
) -> None:
    """The first PDO is disabled, the report has the reason, and the others are unchanged."""
    dictionary = Dictionary.from_eds(edited(tmp_path, (old, new)), NODE_ID)
    (remark,) = dictionary.remarks
    assert remark.section == section
    assert message in remark.text
    node = Node(dictionary, CHANNELS, COMMANDS)
    assert [pdo.name for pdo in node.pdo_map() if not pdo.exists] == [
        "RPDO1" if section == "1600" else "TPDO1"
    ]


def test_ambiguous_names_stop_the_start(tmp_path: Path) -> None:
    """Two objects with the name of a channel are refused."""
    path = edited(tmp_path, ("ParameterName=pressure_b", "ParameterName=pressure_a"))
    with pytest.raises(UserError, match=r"0x2010:00.*0x2011:00"):
        Node(Dictionary.from_eds(path, NODE_ID), CHANNELS, COMMANDS)
