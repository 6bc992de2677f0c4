"""Objects of a node for a stock master if stock `canopen` cannot read the EDS."""

from pathlib import Path

import canopen
from canopen.objectdictionary import ODRecord, ODVariable

from hil_emulator.device.datatype import DATA_TYPES
from hil_emulator.device.dictionary import Dictionary

_CODES = {kind.name: code for code, kind in DATA_TYPES.items()}


def known_objects(eds: Path, dictionary: Dictionary) -> canopen.ObjectDictionary:
    """Return a node's objects as stock `canopen` has them.

    Args:
        eds: the node's file; read by `canopen` if possible.
        dictionary: the emulator's dictionary of it; records are then named by their index.

    """
    try:
        return canopen.import_od(str(eds), dictionary.node_id)
    except Exception:  # `canopen` raises many kinds of exception for unexpected entries
        return _converted(dictionary)


def _converted(dictionary: Dictionary) -> canopen.ObjectDictionary:
    converted = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
    converted.node_id = dictionary.node_id
    several = {entry.index for entry in dictionary if entry.subindex}
    for entry in dictionary:
        variable = ODVariable(entry.name, entry.index, entry.subindex)
        variable.data_type = _CODES[entry.type.name]
        variable.access_type = entry.access
        variable.pdo_mappable = entry.mappable
        variable.default = entry.default
        variable.factor, variable.unit = entry.factor, entry.unit
        if entry.index not in several:
            converted.add_object(variable)
            continue
        if entry.index not in converted:
            converted.add_object(ODRecord(f"0x{entry.index:04X}", entry.index))
        record = converted[entry.index]
        assert isinstance(record, ODRecord)
        record.add_member(variable)
    return converted
