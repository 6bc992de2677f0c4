"""The files that come with the package, by name: machines, layers, benches, scenarios, EDS."""

import re
from enum import StrEnum
from pathlib import Path

from hil_emulator.errors import UserError, brief, did_you_mean
from hil_emulator.platform.output_files import new_files
from hil_emulator.platform.paths import shipped

_WHOLE = re.compile(r"^(\[valve\]|\[\[actuator\]\])", re.M)
_QUOTED = re.compile(r'"([\w./-]+\.\w+)"')


class Purpose(StrEnum):
    """What a file is for."""

    MACHINE = "machine"
    LAYER = "layer"
    """laid over a machine"""
    BENCH = "bench"
    """a part of an actuator, to hold measurements against"""
    SCENARIO = "scenario"
    EDS = "EDS"


CONFIGURATIONS = (Purpose.MACHINE, Purpose.LAYER, Purpose.BENCH)


def packaged(*purposes: Purpose) -> dict[str, Path]:
    """Return the files for some purposes, all without any, by the name that stands for them."""
    configs = shipped("configs/hyq_knee.toml").parent
    found = [*sorted(configs.rglob("*.toml")), *sorted(configs.glob("*.eds"))]
    found += sorted(shipped("eds/hydraulic_actuator.eds").parent.glob("*.eds"))
    return {f.stem: f for f in found if not purposes or purpose_of(f) in purposes}


def purpose_of(file: Path) -> Purpose:
    """Return what a packaged file is for."""
    if file.suffix == ".eds":
        return Purpose.EDS
    if file.parent.name == "scenarios":
        return Purpose.SCENARIO
    if file.parent.name != "configs":
        return Purpose.BENCH
    return Purpose.MACHINE if _WHOLE.search(file.read_text(encoding="utf-8")) else Purpose.LAYER


def summary(file: Path) -> str:
    """Return what the first line of a packaged file says of it."""
    if file.suffix == ".eds":
        text = file.read_text(encoding="latin-1")
        return (re.search(r"^Description=(.*)$", text, re.M) or [""] * 2)[1].strip()
    line = file.read_text(encoding="utf-8").partition("\n")[0]
    return line.lstrip("# ").partition(". ")[0].rstrip(".:;,")


def found(name: str, *purposes: Purpose) -> Path:
    """Return a file by its path or, where none is there, by the name of a packaged one.

    Raises:
        UserError: lists the names that there are; a path with an ending is left to who reads it.

    """
    path = Path(name)
    if path.suffix or path.exists():
        return path
    known = packaged(*purposes)
    if name not in known:
        kinds = " or ".join(purposes)
        raise UserError(
            f"{brief(name)} is no file, and no {kinds} of the package{did_you_mean(name, known)}"
        )
    return known[name]


def copy(name: str, folder: Path, *, overwrite: bool = False) -> list[Path]:
    """Copy a packaged file, and all that it names, into one folder.

    What the copies say of where the others are is written anew. A bench with logs of its own
    brings these along.

    Returns:
        The new files, the one that was asked for first.

    Raises:
        UserError: for an unknown name, another file of such a name in the folder, or a folder
            that cannot be written.

    """
    known = packaged()
    if name not in known:
        raise UserError(f"{brief(name)}: the package has no such file{did_you_mean(name, known)}")
    contents = {folder / source.name: _flat(source) for source in with_named(known[name])}
    with new_files(overwrite=overwrite) as staged:
        for target, content in contents.items():
            staged(target).write_bytes(content)
    return list(contents)


def with_named(file: Path) -> list[Path]:
    """Return a file, those that it names, those that these name, and so on."""
    waiting, every = [file], dict.fromkeys([file])
    while waiting:
        one = waiting.pop()
        beside = sorted(one.parent.iterdir()) if one.stem == one.parent.name else []
        for other in (*_named(one), *beside):
            if other.is_file() and other not in every:
                every[other] = None
                waiting.append(other)
    return list(every)


def _named(file: Path) -> list[Path]:
    if file.suffix != ".toml":
        return []
    names = _QUOTED.findall(file.read_text(encoding="utf-8"))
    return [path for name in names if (path := (file.parent / name).resolve()).is_file()]


def _flat(file: Path) -> bytes:
    """Return the content of a file, what it names being beside it."""
    content = file.read_bytes()
    if file.suffix != ".toml":
        return content

    def beside(match: re.Match[str]) -> str:
        named = file.parent / match[1]
        return f'"{named.name}"' if named.is_file() else match[0]

    return _QUOTED.sub(beside, content.decode()).encode()
