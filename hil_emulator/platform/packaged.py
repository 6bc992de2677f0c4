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
    """Purpose of a packaged file."""

    MACHINE = "machine"
    LAYER = "layer"
    """laid over a machine"""
    BENCH = "bench"
    """a part of an actuator, to hold measurements against"""
    SCENARIO = "scenario"
    EDS = "EDS"


CONFIGURATIONS = (Purpose.MACHINE, Purpose.LAYER, Purpose.BENCH)


def packaged(*purposes: Purpose) -> dict[str, Path]:
    """Return the packaged files for some purposes by name; without an argument all files."""
    configs = shipped("configs/hyq_knee.toml").parent
    files = [*sorted(configs.rglob("*.toml")), *sorted(configs.glob("*.eds"))]
    files += sorted(shipped("eds/hydraulic_actuator.eds").parent.glob("*.eds"))
    return {f.stem: f for f in files if not purposes or purpose_of(f) in purposes}


def purpose_of(file: Path) -> Purpose:
    """Return the purpose of a packaged file."""
    if file.suffix == ".eds":
        return Purpose.EDS
    if file.parent.name == "scenarios":
        return Purpose.SCENARIO
    if file.parent.name != "configs":
        return Purpose.BENCH
    return Purpose.MACHINE if _WHOLE.search(file.read_text(encoding="utf-8")) else Purpose.LAYER


def summary(file: Path) -> str:
    """Return the description in the first line of a packaged file."""
    if file.suffix == ".eds":
        text = file.read_text(encoding="latin-1")
        return (re.search(r"^Description=(.*)$", text, re.M) or [""] * 2)[1].strip()
    line = file.read_text(encoding="utf-8").partition("\n")[0]
    return line.lstrip("# ").partition(". ")[0].rstrip(".:;,")


def found(name: str, *purposes: Purpose) -> Path:
    """Return a file by its path; without such a file, the packaged file of this name.

    Raises:
        UserError: if there is neither; a path with an ending is returned unchecked.

    """
    path = Path(name)
    if path.suffix or path.exists():
        return path
    files = packaged(*purposes)
    if name not in files:
        kinds = " or ".join(purposes)
        raise UserError(
            f"{brief(name)} is no file, and no {kinds} of the package{did_you_mean(name, files)}"
        )
    return files[name]


def copy(name: str, folder: Path, *, overwrite: bool = False) -> list[Path]:
    """Copy a packaged file, and all that it names, into one folder.

    Paths in the copies are changed to the new folder. The logs of a bench are copied, too.

    Returns:
        The new files, beginning with the requested one.

    Raises:
        UserError: for an unknown name, another file of such a name in the folder, or a folder
            that cannot be written.

    """
    files = packaged()
    if name not in files:
        raise UserError(f"{brief(name)}: the package has no such file{did_you_mean(name, files)}")
    contents = {folder / source.name: _flat(source) for source in with_named(files[name])}
    with new_files(overwrite=overwrite) as staged:
        for target, content in contents.items():
            staged(target).write_bytes(content)
    return list(contents)


def with_named(file: Path) -> list[Path]:
    """Return a file and all files that it names, directly or through other files."""
    waiting, every = [file], dict.fromkeys([file])
    while waiting:
        one = waiting.pop()
        companions = sorted(one.parent.iterdir()) if one.stem == one.parent.name else []
        for other in (*_named(one), *companions):
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
    """Return the content of a file, with the named files in the same folder."""
    content = file.read_bytes()
    if file.suffix != ".toml":
        return content

    def without_folder(match: re.Match[str]) -> str:
        named = file.parent / match[1]
        return f'"{named.name}"' if named.is_file() else match[0]

    return _QUOTED.sub(without_folder, content.decode()).encode()
