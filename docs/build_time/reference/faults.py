"""`faults.md`: every kind of fault."""

from itertools import groupby

from build_time.reference.markdown import code, page, table, text
from hil_emulator.commands.faults import bounds, usual
from hil_emulator.faults.catalogue import KINDS
from hil_emulator.faults.connection import MESSAGES
from hil_emulator.faults.declare import FaultKind
from hil_emulator.faults.fault import OPTIONS
from hil_emulator.faults.objects import EXAMPLE

_HEAD = """\
A fault is written `TARGET KIND NAME=VALUE ...`, the same on the command line, in scenarios and in
Python; `hil-emulator faults` prints the list.
[Faults and scenarios](../how_to/faults.md) shows how to inject one."""


def write() -> str:
    """Return the page."""
    parts = [
        _HEAD,
        "## Options of every fault",
        table(("option", "meaning"), [(code(n), text(m)) for n, m in OPTIONS.items()]),
        "## Targets",
        f"`message` stands for {', '.join(map(code, MESSAGES))}, or a COB-ID such as `0x185`. "
        f"`object` stands for an object such as {code(EXAMPLE)}. Of several nodes, `node5.tpdo1` "
        f"and `node5.{EXAMPLE}` are those of node 5.",
    ]
    for layer, kinds in groupby(KINDS, key=lambda kind: kind.layer):
        group = list(kinds)
        parts += [f"## Layer {layer.value}", _kinds(group), _params(group)]
    return page("Faults", *parts)


def _kinds(kinds: list[FaultKind]) -> str:
    rows = [
        (code(k.name), text(k.meaning), ", ".join(map(code, k.targets)), f"{k.probability:g}",
         code(f"0x{k.emergency.code:04X}") if k.emergency else "")
        for k in kinds
    ]  # fmt: skip
    return table(("kind", "meaning", "targets", "default probability", "emergency"), rows)


def _params(kinds: list[FaultKind]) -> str:
    rows = [
        (code(k.name), code(p.name), text(usual(p)), text(bounds(p)), text(p.meaning))
        for k in kinds
        for p in k.params
    ]
    header = ("kind", "parameter", "default", "bounds", "meaning")
    return f"Parameters:\n\n{table(header, rows)}" if rows else ""
