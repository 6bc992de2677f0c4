"""Pages that are made of declarations: effects, faults, objects of dictionaries, requests."""

import re
from collections.abc import Callable, Iterable, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import canopen
from sphinx.application import Sphinx

from build_time import protocol_page
from build_time.execute import GENERATED
from build_time.step_pictures import drawn, response
from hil_emulator.faults.catalogue import KINDS
from hil_emulator.model.declare import Effect, Param
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.platform.paths import shipped
from hil_emulator.units import show

_TYPES = {
    getattr(canopen.objectdictionary.datatypes, name): name
    for name in dir(canopen.objectdictionary.datatypes)
    if re.fullmatch(r"[A-Z]+[A-Z_]*\d*", name)
    and isinstance(getattr(canopen.objectdictionary.datatypes, name), int)
}


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table in Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    cells = [" | ".join(str(c).replace("|", "\\|").replace("\n", " ") for c in r) for r in lines]
    return "\n".join(f"| {line} |" for line in cells)


def effect_section(effect: Effect, picture: str) -> str:
    """Return what the declaration of an effect says, with a picture."""
    words = effect.words
    parts = [
        f"## {effect.name}",
        f"`{effect.equation}`",
        f"{words[:1].upper()}{words[1:]}." if words else "",
        table(("parameter", "is", "typical", "range", "source"),
              [(f"`{p.name}`", plain(p.meaning), _amount(p.typical, p),
                f"{_amount(p.low, p)} ... {_amount(p.high, p)}", p.source)
               for p in effect.params]),
        f"Off at `{effect.knob.name}` = {_amount(effect.off, effect.knob)}. "
        f"Shows: {plain(effect.signature)}. Source: {plain(effect.source)}.",
        f"Not modelled: {effect.not_modelled}." if effect.not_modelled else "",
        picture,
    ]  # fmt: skip
    return "\n\n".join(part for part in parts if part)


def _amount(value: float, param: Param) -> str:
    if param.unit.startswith("span"):
        return f"{value:g} {param.unit}"
    return plain(show(value, param.unit, param.shown))


def plain(text: str) -> str:
    """Return text that Markdown shows as it is: a product's star is no emphasis."""
    return text.replace("*", "\\*")


def effects(folder: Path) -> None:
    """Write a page for each table of the configuration, with its effects."""
    pages = []
    by_table = sorted(CATALOGUE, key=lambda e: e.stage.table)
    for name, group in groupby(by_table, key=lambda e: e.stage.table):
        sections = [effect_section(e, _picture(e, folder)) for e in group]
        head = (
            f"# Effects of [{name}]\n\nEach on the reference machine, 1.5 mA from 0.02 to 0.18 s."
        )
        (folder / f"effects_{name}.md").write_text("\n\n".join([head, *sections]) + "\n")
        pages.append(f"effects_{name}")
    listed = "\n".join(pages)
    (folder / "effects.md").write_text(
        f"# The catalogue of effects\n\n{len(CATALOGUE)} effects, made from their declarations; "
        "`hil-emulator effects` prints them.\n\n"
        f"```{{toctree}}\n:maxdepth: 2\n\n{listed}\n```\n"
    )


def _picture(effect: Effect, folder: Path) -> str:
    found = response(effect)
    if not found.visible:
        return "A step on the reference machine does not show it at its typical size."
    drawn(found).savefig(folder / f"effect_{effect.name}.png", dpi=80.0)
    return f"![{effect.name}: {found.signal}](effect_{effect.name}.png)"


def faults(folder: Path) -> None:
    """Write the table of faults."""
    rows = [
        (k.layer.value, f"`{k.name}`", k.meaning, ", ".join(f"`{p.name}`" for p in k.params),
         ", ".join(k.targets))
        for k in KINDS
    ]  # fmt: skip
    head = "# Every kind of fault\n\nIt is named by target, kind and values: `hil-emulator faults`."
    text = table(("layer", "kind", "meaning", "parameters", "targets"), rows)
    (folder / "faults.md").write_text(f"{head}\n\n{text}\n")


def objects(folder: Path) -> None:
    """Write the objects of every EDS, as a stock `canopen` reads them."""
    parts = ["# Every object of the dictionaries"]
    for file in sorted(shipped("eds/hydraulic_actuator.eds").parent.glob("*.eds")):
        read = canopen.import_od(str(file), 5)
        rows = [
            (f"0x{v.index:04X}:{v.subindex}", v.name, _TYPES.get(v.data_type, v.data_type),
             v.access_type, "" if v.default is None else f"`{v.default}`",
             "yes" if v.pdo_mappable else "")
            for entry in read.values()
            for v in (entry.values() if hasattr(entry, "values") else [entry])
        ]  # fmt: skip
        head = ("object", "name", "type", "access", "default (node 5)", "PDO")
        parts += [f"## {file.name}", table(head, rows)]
    (folder / "objects.md").write_text("\n\n".join(parts) + "\n")


def requests(folder: Path) -> None:
    """Write the page of every request, and their JSON Schema."""
    protocol_page.write(folder, table)


MADE: tuple[Callable[[Path], None], ...] = (effects, faults, objects, requests)


def make(app: Sphinx) -> None:
    """Write every page before Sphinx looks for pages."""
    folder = Path(app.srcdir) / GENERATED
    folder.mkdir(exist_ok=True)
    for write in MADE:
        write(folder)


def setup(app: Sphinx) -> dict[str, Any]:
    """Have the pages made."""
    app.connect("builder-inited", make)
    return {"parallel_read_safe": True}
