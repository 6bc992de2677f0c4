"""A controller that configures devices by DCF, as a PLC does at start-up, with stock `canopen`."""

import configparser
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import canopen

INVALID = 1 << 31
COB_ID = 1
_SECTION = re.compile(r"([0-9A-Fa-f]{4})(?:sub([0-9A-Fa-f]{1,2}))?")
_RPDO, _TPDO, _TO_MAPPING = range(0x1400, 0x1600), range(0x1800, 0x1A00), 0x200

Place = tuple[int, int]


def parameter_values(dcf: Path, node_id: int) -> dict[Place, int]:
    """Return every ParameterValue of a DCF by index and sub-index."""
    parser = configparser.RawConfigParser(strict=False)
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    parser.read(dcf)
    values = {}
    for section in parser.sections():
        match = _SECTION.fullmatch(section)
        text = parser.get(section, "ParameterValue", fallback="")
        if match and text:
            offset = node_id if "$NODEID" in text else 0
            number = int(text.replace("$NODEID", "").strip("+"), 0)
            values[int(match[1], 16), int(match[2] or "0", 16)] = number + offset
    return values


def in_order(values: dict[Place, int], now: dict[Place, int]) -> Iterator[tuple[Place, int]]:
    """Yield what to write, in the order that CiA 301 asks for: a PDO is deleted, mapped, made.

    Args:
        values: what is to be.
        now: COB-IDs of the PDOs at present.

    """
    records = {i for i, _ in values}
    pdos = sorted(
        {i for i in records if i in _RPDO or i in _TPDO}
        | {i - _TO_MAPPING for i in records if i - _TO_MAPPING in (*_RPDO, *_TPDO)}
    )
    for place in sorted(values):
        if not any(place[0] in (i, i + _TO_MAPPING) for i in pdos):
            yield place, values[place]
    for index in pdos:
        mapping = index + _TO_MAPPING
        yield (index, COB_ID), now[index, COB_ID] | INVALID
        yield (mapping, 0), 0
        for place in sorted(p for p in values if p[0] == mapping and p[1]):
            yield place, values[place]
        if (mapping, 0) in values:
            yield (mapping, 0), values[mapping, 0]
        for place in sorted(p for p in values if p[0] == index and p[1] != COB_ID):
            yield place, values[place]
        yield (index, COB_ID), values.get((index, COB_ID), now[index, COB_ID])


def configure(network: canopen.Network, dcf: Path, node_id: int) -> Any:
    """Write a DCF into a device; return the stock master's view of it."""
    node = network.add_node(node_id, canopen.import_od(str(dcf), node_id))
    values = parameter_values(dcf, node_id)
    cob_ids = {(i, COB_ID): node.sdo[i][COB_ID].raw for i in (*_RPDO, *_TPDO) if i in node.sdo}
    counts = {i: node.sdo[i + _TO_MAPPING][0].raw for i, _ in cob_ids}
    written = {i for i, s in values if s == 0}
    for (index, _), _ in cob_ids.items():
        # only the COB-ID of this PDO changes, its mapping stays
        if index + _TO_MAPPING not in written:
            values.setdefault((index + _TO_MAPPING, 0), counts[index])
    for (index, subindex), value in in_order(values, cob_ids):
        _variable(node, index, subindex).raw = value
    for (index, subindex), value in values.items():
        assert _variable(node, index, subindex).raw == value, f"{index:04X}:{subindex:02X}"
    return node


def _variable(node: Any, index: int, subindex: int) -> Any:
    item = node.sdo[index]
    return item if isinstance(item, canopen.sdo.SdoVariable) else item[subindex]
