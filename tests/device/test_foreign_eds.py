"""EDS files of makers: harmless deviations are accepted with a remark, others are refused."""

import contextlib
import re
from pathlib import Path

import canopen
import pytest
from data_sheets import LEAST, described, mapped, written
from edited_eds import edited
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.eds.load import commissioned
from hil_emulator.device.eds.report import lines
from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame

NODE_ID = 5
SHIPPED = sorted((Path(__file__).parents[2] / "eds").glob("*.eds"))


def loaded(folder: Path, *parts: str) -> Dictionary:
    """Return the dictionary of an EDS of these parts."""
    return Dictionary.from_eds(written(folder, *parts), NODE_ID)


def notes(dictionary: Dictionary) -> list[tuple[str, str]]:
    """Return section and key of every remark."""
    return [(remark.section, remark.key) for remark in dictionary.remarks]


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_files_have_no_remarks(path: Path) -> None:
    """The shipped EDS files have no remark."""
    assert list(Dictionary.from_eds(path, NODE_ID).remarks) == []


@pytest.mark.parametrize(
    ("data_type", "text", "value"),
    [
        (0x07, "$NODEID+0x180", 0x185),
        (0x07, "0x180+$NODEID", 0x185),
        (0x07, "$NodeID + 0x180", 0x185),
        (0x07, "0xC0000180 + $nodeid", 0xC0000185),
        (0x07, "$NODEID", 5),
        (0x07, "$NODEID+384", 0x185),
        (0x03, "0xFFFF", -1),
        (0x04, "0x80000000", -(1 << 31)),
        (0x10, "0xFFFFF0", -16),
        (0x04, "-5", -5),
        (0x04, "0x-5", -5),
        (0x05, "017", 15),
        (0x08, "2.5", 2.5),
        (0x08, "0x40200000", 2.5),
        (0x11, "0x4004000000000000", 2.5),
        (0x09, "1.0 ; a remark", b"1.0"),
        (0x0A, "00 ff", b"\x00\xff"),
        (0x0B, "ab", b"a\0b\0"),
    ],
)
def test_values_of_cia_306(tmp_path: Path, data_type: int, text: str, value: object) -> None:
    """Numbers in every notation of the standard have no remark."""
    dictionary = loaded(tmp_path, described("2000", data_type, f"DefaultValue={text}"))
    assert dictionary.read(0x2000) == value
    assert notes(dictionary) == []


@pytest.mark.parametrize(
    ("data_type", "key", "text", "value"),
    [
        (0x0F, "DefaultValue", "0", b""),
        (0x0F, "DefaultValue", "0x0", b""),
        (0x06, "DefaultValue", "Manufacturer-specific", 0),
        (0x1B, "DefaultValue", "0x1234567890ABCDEFLL", 0x1234567890ABCDEF),
        (0x07, "DefaultValue", "0000 00FFh", 255),
        (0x06, "DefaultValue", "3.00", 3),
        (0x06, "DefaultValue", "3 # three", 3),
        (0x05, "DefaultValue", "09", 9),
        (0x01, "DefaultValue", "true", 1),
        (0x0A, "DefaultValue", "text", b"text"),
        (0x06, "HighLimit", "65536", 0),
        (0x06, "LowLimit", "low", 0),
        (0x06, "Factor", "0", 0),
        (0x06, "Delta", "a bit", 0),
        (0x40, "DataType", "", b""),
    ],
)
def test_odd_values_are_read_and_noted(
    tmp_path: Path, data_type: int, key: str, text: str, value: object
) -> None:
    """A value in a notation outside the standard is accepted with a remark on section and key."""
    line = f"{key}={text}" if text else ""
    dictionary = loaded(tmp_path, described("2000", data_type, line))
    assert dictionary.read(0x2000) == value
    assert notes(dictionary) == [("2000", key)]


def test_empty_keys_are_absent(tmp_path: Path) -> None:
    """An empty key counts as absent, without a remark."""
    empty = ("DefaultValue=", "LowLimit=", "HighLimit=", "ObjectType=", "PDOMapping=")
    path = written(tmp_path, described("2000", 5, *empty))
    path.write_text(path.read_text().replace("VendorNumber=0x0000029C", "VendorNumber="))
    dictionary = Dictionary.from_eds(path, NODE_ID)
    assert dictionary.read(0x2000) == 0
    assert notes(dictionary) == []


def test_keys_and_sections_in_any_case(tmp_path: Path) -> None:
    """Upper or lower case and blanks make no difference."""
    text = "[2FfFSUB0]\n  PARAMETERNAME = x\n\tdatatype = 0X05\naccesstype=RW\ndefaultvalue = 7\n"
    dictionary = loaded(tmp_path, "[2fff]\nparametername=y\nobjecttype=8\n" + text)
    assert (dictionary.read(0x2FFF), dictionary.entry(0x2FFF).name) == (7, "x")
    assert notes(dictionary) == []


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    """A byte order mark or a letter beyond ASCII is decoded correctly."""
    text = described("2000", 5).replace("object 2000", "Öldruck")
    path = written(tmp_path, text.replace("\n", "\r\n"), encoding=encoding)
    assert Dictionary.from_eds(path, NODE_ID).entry(0x2000).name == "Öldruck"


def test_compact_arrays_have_values_and_names(tmp_path: Path) -> None:
    """[xxxxValue] and [xxxxName] of CiA 306 set values and names of their members."""
    compact = described("1016", 7, "ObjectType=8", "CompactSubObj=3", "DefaultValue=0")
    values = "[1016Value]\nNrOfEntries=2\n1=0x000A05DC\n3=$NODEID+0x10000\n"
    names = "[1016Name]\nNrOfEntries=1\n2=second\n"
    dictionary = loaded(tmp_path, compact, values, names)
    assert [dictionary.read(0x1016, n) for n in range(4)] == [3, 0x000A05DC, 0, 0x10005]
    assert dictionary.entry(0x1016, 2).name == "second"


def test_compact_pdos_exist(tmp_path: Path) -> None:
    """CompactPDO creates PDOs without sections, with identifiers of the predefined set."""
    value = described("2000", 6, "PDOMapping=1", "DefaultValue=0x1234")
    info = ("NrOfTXPDO=1", "CompactPDO=0x13\nNrOfTXPDO=2")
    mapping = "[1A00Value]\nNrOfEntries=1\n1=0x20000010\n"
    path = written(tmp_path, value, mapping)
    path.write_text(path.read_text().replace(*info))
    node = Node(Dictionary.from_eds(path, NODE_ID), (), {})
    first, second = node.pdo_map()
    assert (first.can_id, first.transmission_type, first.entries) == (0x185, 255, ("object 2000",))
    assert (second.can_id, second.entries) == (0x285, ())
    assert {e.subindex for e in node.dictionary if e.index == 0x1800} == {0, 1, 2, 5}


def test_a_dcf_has_parameter_values_and_a_node_id(tmp_path: Path) -> None:
    """ParameterValue has priority over DefaultValue, and the node-ID is that of the file."""
    path = written(
        tmp_path,
        described("2000", 6, "DefaultValue=1", "ParameterValue=2"),
        "[DeviceComissioning]\nNodeID=0x2A\n",
    )
    assert Dictionary.from_eds(path, NODE_ID).read(0x2000) == 2
    assert commissioned(path) == 42


def test_identity_may_stand_in_device_info(tmp_path: Path) -> None:
    """A vendor-ID without a value is the VendorNumber, which a master expects."""
    path = written(tmp_path)
    path.write_text(LEAST.replace("DefaultValue=0x0000029C", "DefaultValue="))
    dictionary = Dictionary.from_eds(path, NODE_ID)
    assert dictionary.read(0x1018, 1) == 0x29C
    assert notes(dictionary) == [("1018sub1", "DefaultValue")]


def test_a_cob_id_without_value_is_not_that_of_nmt(tmp_path: Path) -> None:
    """The first PDOs and EMCY have predefined identifiers, further PDOs and SDOs do not exist."""
    mapping = [mapped(n, cob_id="0") for n in (1, 5)]
    sdo = "[1201]\nParameterName=SDO\nObjectType=9\n" + described("1201sub1", 7, "DefaultValue=0")
    dictionary = loaded(tmp_path, described("1014", 7), *mapping, sdo)
    assert dictionary.read(0x1201, 1) == 0x80000000
    assert dictionary.read(0x1014) == 0x085
    assert dictionary.read(0x1800, 1) == 0x185
    assert dictionary.read(0x1804, 1) == 0x80000000


def test_cob_ids_that_lack_their_node_id_get_it(tmp_path: Path) -> None:
    """EMCY at 0x80 would be SYNC; the SDO server always has the identifiers of the node-ID."""
    server = "[1200]\nParameterName=SDO\nObjectType=9\n" + "".join(
        described(f"1200sub0{n}", 7, f"DefaultValue={base}+$NODEID", f"ParameterValue={base}+32")
        for n, base in ((1, "0x600"), (2, "0x580"))
    )
    dictionary = loaded(tmp_path, server, described("1014", 7, "DefaultValue=0x80"), mapped(
        1, cob_id="0x40000180"))  # fmt: skip
    places = (0x1014, 0), (0x1200, 1), (0x1200, 2), (0x1800, 1)
    assert [dictionary.read(*place) for place in places] == [0x085, 0x605, 0x585, 0x40000185]


def test_a_default_mapping_stands_above_attributes(tmp_path: Path) -> None:
    """An object in a default mapping is mapped despite PDOMapping=0, with a remark."""
    value = described("2000", 6, "PDOMapping=0", "DefaultValue=3", access="ro")
    dictionary = loaded(tmp_path, value, mapped(1, "0x20000010", "0x00000000"))
    (row,) = Node(dictionary, (), {}).pdo_map()
    assert row.entries == ("object 2000",)
    assert notes(dictionary) == [("1A00", ""), ("2000", "")]


def test_repeated_keys_are_accepted(tmp_path: Path) -> None:
    """The first of two values of a key counts; a section may be repeated word for word."""
    text = described("2000", 5, "DefaultValue=1", "DefaultValue=2")
    dictionary = loaded(tmp_path, text, text)
    assert dictionary.read(0x2000) == 1
    assert notes(dictionary) == [("2000", "DefaultValue")] * 2 + [("2000", "")]


def test_modular_devices_are_refused(tmp_path: Path) -> None:
    """An EDS does not list the modules in use; the message has the remedy."""
    modules = "[SupportedModules]\nNrOfEntries=3\n[M1ModuleInfo]\nProductName=8 DI\n"
    with pytest.raises(UserError, match=r"\[SupportedModules\].*modular.*DCF of your combination"):
        loaded(tmp_path, modules)
    assert 0x1000 in loaded(tmp_path, modules.replace("=3", "=0"))


def test_the_report_has_one_line_for_one_deviation(tmp_path: Path) -> None:
    """Fifty equal remarks are one line with some places and the number of the others."""
    odd = [described(f"{0x2000 + n:04X}", 0x0F, "DefaultValue=0") for n in range(50)]
    (line,) = lines(loaded(tmp_path, *odd).remarks)
    assert line.startswith("[2000] [2001] [2002] [2003] and 46 more DefaultValue: ")


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_stock_import_finds_the_same(path: Path) -> None:
    """Integer defaults agree with those that stock `canopen` reads."""
    stock = canopen.import_od(str(path), NODE_ID)
    for entry in Dictionary.from_eds(path, NODE_ID):
        if entry.type.kind == "integer":
            item = stock[entry.index]
            variable = item[entry.subindex] if hasattr(item, "subindices") else item
            assert entry.default == (variable.default or 0), entry


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_text_is_an_eds_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    """A file with any changed lines loads and runs, or is refused with a message."""
    text = edited(tmp_path).read_text().splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text) - 1))
        key, equals, _ = text[at].partition("=")
        text[at] = key + equals + data.draw(st.text("0x-9F$N;[]=.#é ", max_size=8))
    path = tmp_path / "mutated.eds"
    path.write_text("\n".join(text))
    with contextlib.suppress(UserError):
        Node(Dictionary.from_eds(path, NODE_ID), (), {})


@pytest.mark.parametrize(
    ("name", "section", "reason"),
    [("load_cell", "1A00sub1", "CiA 301 has an integer"),
     ("valve_driver", "6040", "profile has a number"),
     ("pressure_transmitter", "6126sub1", "profile has a number")],
)  # fmt: skip
def test_text_in_the_place_of_a_number_is_refused(
    tmp_path: Path, name: str, section: str, reason: str
) -> None:
    """A number that a device computes with cannot be a string; the message has section and key."""
    before, mark, after = _sheet(name).partition(f"[{section}]\n")
    path = tmp_path / "text.eds"
    path.write_text(before + mark + re.sub(r"DataType=\w+", "DataType=9", after, count=1))
    with pytest.raises(
        UserError, match=rf"\[{section}\] DataType: VISIBLE_STRING, where .*{reason}"
    ):
        Node(Dictionary.from_eds(path, NODE_ID), (), {})


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_data_type_runs_or_is_refused(tmp_path: Path, data: st.DataObject) -> None:
    """With any type of a profile's object the node runs, or is refused with a message."""
    lines = _sheet(data.draw(st.sampled_from(["valve_driver", "pressure_transmitter"]))).split("\n")
    at = data.draw(st.sampled_from([i for i, line in enumerate(lines) if "DataType=" in line]))
    lines[at] = f"DataType={data.draw(st.sampled_from([1, 8, 9, 10, 15, 27]))}"
    path = tmp_path / "typed.eds"
    path.write_text("\n".join(lines))
    with contextlib.suppress(UserError):
        node = Node(Dictionary.from_eds(path, NODE_ID), (), {})
        for tick in range(3):
            start = [Frame(0, bytes([1, NODE_ID]))] if tick == 1 else []
            node.receive(tick * 100_000_000, [*start, Frame(0x80, b"")])
            node.publish(tick * 100_000_000, Measured([], []))


def _sheet(name: str) -> str:
    return next(path for path in SHIPPED if path.stem == name).read_text()


BOOLEAN_AS_BYTE = (
    described("2001", 1, "PDOMapping=1", "DefaultValue=1"),
    described("2002", 6, "PDOMapping=1", "DefaultValue=0x1234"),
)


def test_a_boolean_may_be_mapped_as_a_byte(tmp_path: Path) -> None:
    """A BOOLEAN mapped with 8 bits takes a byte, has a remark, and can be written back."""
    dictionary = loaded(tmp_path, *BOOLEAN_AS_BYTE, mapped(1, "0x20010008", "0x20020010"))
    assert ("2001", "") in notes(dictionary)
    node = Node(dictionary, [], {})
    (pdo,) = [p for p in node.pdo_map() if p.exists]
    assert pdo.size == 3
    node.publish(0, Measured([], []))
    node.receive(1, [Frame(0, bytes([1, NODE_ID]))])
    sent = [f.data for f in node.publish(1, Measured([], [])) if f.can_id == 0x185]
    assert sent == [bytes([1, 0x34, 0x12])]
    for subindex in (0, 1, 2):
        value = dictionary.read(0x1A00, subindex)
        assert value == (2, 0x20010008, 0x20020010)[subindex]


def test_a_boolean_is_a_bit_elsewhere(tmp_path: Path) -> None:
    """A BOOLEAN mapped with one bit stays one bit, without a remark."""
    dictionary = loaded(tmp_path, *BOOLEAN_AS_BYTE, mapped(1, "0x20010001", "0x20020010"))
    assert ("2001", "") not in notes(dictionary)
    assert dictionary.entry(0x2001).type.bits == 1


def test_a_wrong_length_is_noted_of_a_pdo_that_is_off(tmp_path: Path) -> None:
    """A default mapping with a wrong length has a remark, whether the PDO is valid or not."""
    mapping = mapped(1, "0x20020008", cob_id="$NODEID+0x80000180")
    dictionary = loaded(tmp_path, *BOOLEAN_AS_BYTE, mapping)
    (text,) = [r.text for r in dictionary.remarks if r.section == "1A00"]
    assert "cannot be enabled with its default mapping: 0x2002:00 has 16 bits, not 8" in text


def test_unknown_access_is_that_of_stock_canopen(tmp_path: Path) -> None:
    """`AccessType=unknown` is write-only as in stock `canopen`, with a remark."""
    part = described("2003", 6, "DefaultValue=3", access="unknown")
    dictionary = loaded(tmp_path, part)
    stock = canopen.import_od(str(written(tmp_path, part)), NODE_ID)[0x2003]
    entry = dictionary.entry(0x2003)
    assert (entry.readable, entry.writable) == (stock.readable, stock.writable) == (False, True)
    assert ("2003", "AccessType") in notes(dictionary)


MAKERS = sorted((Path(__file__).parents[2] / "configs" / "foreign").glob("*.eds"))


@pytest.mark.parametrize("path", MAKERS, ids=lambda path: path.stem)
def test_defaults_can_be_written_back(path: Path) -> None:
    """Every parameter of a file without a map accepts its default, as a master restores it."""
    node = Node(Dictionary.from_eds(path, NODE_ID), [], {})
    dictionary = node.dictionary
    for entry in dictionary:
        application = entry.index >= 0x2000 and entry.writable and entry.readable
        if application and entry.value is not None:
            dictionary.write(entry.index, entry.subindex, entry.value)
