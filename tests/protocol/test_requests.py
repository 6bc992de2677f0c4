"""The declared requests: what the page sends is among them, and each mistake has its reason."""

import json
import re
from pathlib import Path
from typing import Any, get_args

import pytest
from build_time.reference.requests import schema, write

import hil_emulator
from hil_emulator.errors import UserError
from hil_emulator.faults.catalogue import KINDS
from hil_emulator.protocol.base import MOST_OPTIONS
from hil_emulator.protocol.dispatch import json_object, parsed
from hil_emulator.protocol.offered import OF_PANEL, OF_RIG, TO_LOOP
from hil_emulator.protocol.operation import NmtRequest, SdoRequest
from hil_emulator.protocol.page import MOST_COLUMNS, MOST_PIXELS
from hil_emulator.protocol.stream import HEAD, HEAD_FIELDS, LIVE, offset
from hil_emulator.remote.http_server import ROUTES
from hil_emulator.scenario.names import NMT
from hil_emulator.signals.inputs import SETTINGS

SCRIPTS = Path(hil_emulator.__file__).parent / "panel/static"
SCRIPT = "\n".join(file.read_text() for file in sorted(SCRIPTS.glob("*.js")))
VIEW = {"do": "view", "columns": "time", "pixels": 9, "generation": 1}


def test_the_page_sends_declared_requests_only() -> None:
    """A request that a script of the page sends is one of those that its stream offers."""
    sent = set(re.findall(r'\bdo: "(\w+)"', SCRIPT))
    assert len(sent) > 10
    assert sent <= {verb.verb() for verb in OF_PANEL}


def test_the_control_port_has_a_path_for_each_request_on_the_rig() -> None:
    """Control port and stream offer the same requests on the rig."""
    assert set(ROUTES.values()) == set(OF_RIG)
    assert set(OF_RIG) <= set(OF_PANEL)


def test_nmt_commands_are_those_of_scenarios() -> None:
    """One name for an NMT command, wherever it is sent from."""
    assert get_args(NmtRequest.model_fields["command"].annotation) == tuple(NMT)


def test_every_fault_and_all_settings_fit_into_a_request() -> None:
    """The limit of further fields leaves room for each option of each kind of fault."""
    common = ("start", "duration", "ramp", "probability", "seed", "condition")
    assert max(len(kind.params) for kind in KINDS) + len(common) <= MOST_OPTIONS
    assert len(SETTINGS) <= MOST_OPTIONS


def test_the_page_reads_the_head_of_a_binary_message_where_it_is() -> None:
    """Offset and type of every field that the script reads are the declared ones."""
    types = {"Uint16": "H", "Uint32": "I", "Float64": "d"}
    codes = {field.name: field.code for field in HEAD_FIELDS}
    read = re.findall(r"(\w+)\s*[:=] head\.get(\w+)\((\d+), true\)", SCRIPT)
    names = {"live": "kind"}
    assert len(read) == len(HEAD_FIELDS) - 1  # it has no use for the clock of the machine
    for name, kind, place in read:
        declared = names.get(name, name)
        assert (int(place), types[kind]) == (offset(declared), codes[declared])
    assert f"const HEAD = {HEAD.size};" in SCRIPT
    assert f"const LIVE = {LIVE};" in SCRIPT
    assert f"const MOST_PIXELS = {MOST_PIXELS};" in SCRIPT


def test_the_schema_has_every_request_and_its_answer() -> None:
    """The documentation's JSON Schema and page leave out no request, no field and no limit."""
    made, text = schema(), write()
    for verb in {*OF_PANEL, *TO_LOOP}:
        declared = made["$defs"][verb.__name__]
        assert {"$ref": f"#/$defs/{verb.__name__}"} in made["anyOf"]
        assert "do" in declared["required"]
        answer = made["$defs"][declared["x-answer"].rpartition("/")[2]]
        assert (
            answer["properties"].keys() == verb.answer.model_fields.keys()
            if (verb.answer.model_fields)
            else True
        )
        assert f"### {verb.verb()}\n" in text
    json.dumps(made)


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        ({"do": "jump"}, "cannot do jump; there are status, signals"),
        ({}, "cannot do None"),
        ({"do": ["set"]}, "cannot do"),
        ({"do": "fault", "target": "supply"}, "fault: kind is missing"),
        ({"do": "fault", "target": "0x" + "0" * 70, "kind": "drop"}, "at most 64 characters"),
        ({"do": "set", "external_force": "1 N" + " " * 300}, "at most 200 characters"),
        ({"do": "set", "external_force": []}, "[]: wanted is a valid string or a valid integer or"),
        ({"do": "set", "external_force": float("nan")}, "finite number"),
        ({"do": "set", "external_force": 10**400}, "less than or equal to"),
        ({"do": "set", **{f"n{i}": 1 for i in range(17)}}, "set: at most 16 further fields"),
        ({"do": "end", "number": -1}, "end: number: -1: input should be greater than"),
        ({"do": "end", "number": True}, "end: number: True: wanted is a valid integer"),
        ({"do": "end", "nummer": 1}, "end: nummer: 1: extra inputs are not permitted"),
        ({"do": "nmt", "command": "jump", "node": 5}, "'start', 'stop'"),
        ({"do": "nmt", "command": "start", "node": 128}, "less than or equal to 127"),
        ({"do": "record", "file": "x" * 300}, "not understood (name of a new file"),
        ({"do": "record", "file": "../x.rec"}, "without a folder"),
        ({"do": "record", "file": "x\0.rec"}, "without a folder"),
        ({"do": "row", "time": 1e300}, "less than or equal to"),
        ({"do": "watch", "what": "all"}, "'nodes'"),
        (VIEW, "view: give span, or from and to"),
        (VIEW | {"span": 1.0, "from": 0.0, "to": 1.0}, "view: give span, or from and to"),
        (VIEW | {"from": 1e300, "to": -1e300}, "view: from: 1e+300"),
        (VIEW | {"from": 1.0, "to": 0.0}, "view: from is after to"),
        (VIEW | {"span": 1.0, "columns": "a " * (MOST_COLUMNS + 1)}, "at most 128 signals"),
        (VIEW | {"span": 1.0, "pixels": 10**9}, "less than or equal to 4096"),
        (VIEW | {"span": 1e9}, "less than or equal to 600"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_a_request_beyond_its_limits_is_refused_in_one_sentence(
    request_: dict[str, Any], reason: str
) -> None:
    """The sentence names request and argument, quotes what was given, and is short."""
    with pytest.raises(UserError) as refused:
        parsed(request_, OF_PANEL)
    assert reason in str(refused.value)
    assert len(str(refused.value)) < 300
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("data", [b"", b"[]", b"null", b"\xff", b"[" * 5000, b"9" * 5000, "{"])
def test_what_is_no_json_object_is_refused_in_one_sentence(data: bytes | str) -> None:
    """Empty, cut off, nested too deep, not UTF-8, or another type of JSON."""
    with pytest.raises(UserError, match=r"not JSON|nested too deep|send an object"):
        json_object(data)


@pytest.mark.parametrize(
    ("index", "subindex", "place"),
    [
        ("0x1008", "0", (0x1008, 0)),
        ("1018", "0x04", (0x1018, 4)),
        (4104, 255, (0x1008, 255)),
        ("ffff", "255", (0xFFFF, 255)),
        ("0X1", "08", (1, 8)),
        ("1", "0XfF", (1, 255)),
    ],
)
def test_an_object_is_named_by_numbers_or_text(
    index: int | str, subindex: int | str, place: tuple[int, int]
) -> None:
    """Text of an index is hexadecimal; text of a sub-index is decimal, unless it begins with 0x."""
    fields = {"do": "sdo", "node": 5, "index": index, "subindex": subindex}
    request = parsed(fields, OF_PANEL)
    assert isinstance(request, SdoRequest)
    assert request.place == place


@pytest.mark.parametrize("index", ["10000", 0x10000, -1, "-1", "", "0x", None, "1g"])
def test_an_index_has_16_bits(index: object) -> None:
    """Anything else is refused before a frame is made of it."""
    with pytest.raises(UserError, match="sdo: index"):
        parsed({"do": "sdo", "node": 5, "index": index, "subindex": 0}, OF_PANEL)


@pytest.mark.parametrize("subindex", ["256", 256, -1, "-1", "", "0x100", None, "999"])
def test_a_subindex_has_8_bits(subindex: object) -> None:
    """Anything else is refused before a frame is made of it."""
    with pytest.raises(UserError, match="sdo: subindex"):
        parsed({"do": "sdo", "node": 5, "index": "0x1008", "subindex": subindex}, OF_PANEL)
