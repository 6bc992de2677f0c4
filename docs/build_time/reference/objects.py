"""`objects.md`: the dictionary objects of every EDS of the package, as `canopen` reads them."""

import re
from pathlib import Path

import canopen

from build_time.reference.markdown import code, page, table, text
from hil_emulator.platform.paths import shipped

_TYPES = {
    getattr(canopen.objectdictionary.datatypes, name): name
    for name in dir(canopen.objectdictionary.datatypes)
    if re.fullmatch(r"[A-Z]+[A-Z_]*\d*", name)
    and isinstance(getattr(canopen.objectdictionary.datatypes, name), int)
}
_HEADER = ("object", "name", "type", "access", "PDO", "one digit", "default")
_NODE = 5


def write() -> str:
    """Return the page."""
    folder = shipped("eds/hydraulic_actuator.eds").parent
    parts = [f"## {file.name}\n\n{_objects(file)}" for file in sorted(folder.glob("*.eds"))]
    head = (
        f"The objects of the EDS files that come with the package. Defaults are those of node "
        f"{_NODE}. `hil-emulator configs --copy NAME` copies a file."
    )
    return page("Dictionary objects", head, *parts)


def _objects(file: Path) -> str:
    entries = canopen.import_od(str(file), _NODE).values()
    variables = [v for e in entries for v in (e.values() if hasattr(e, "values") else [e])]
    return table(_HEADER, map(_row, variables))


def _row(variable: canopen.objectdictionary.ODVariable) -> tuple[str, ...]:
    digit = f"{variable.factor:g} {variable.unit}" if variable.unit else ""
    return (
        f"0x{variable.index:04X}:{variable.subindex}", text(variable.name),
        _TYPES.get(variable.data_type, str(variable.data_type)), variable.access_type,
        "mappable" if variable.pdo_mappable else "", text(digit),
        "" if variable.default is None else code(variable.default),
    )  # fmt: skip
