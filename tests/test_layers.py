"""Dependencies point one way: every room of the package knows only rooms below its own."""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import hil_emulator

PACKAGE = Path(hil_emulator.__file__).parent
OWN = "hil_emulator"

GROUND = {"errors", "frame", "input_files", "units", "__version__"}
"""What every room but the model may know."""

ROOMS = {
    "platform": {"platformdirs", "distributed"},
    "model": {"numpy", "llvmlite", "numba", "scipy", "platform"},
    "ccode": {"numpy", "model"},
    "fmi": set(),
    "fmi/exporting": {"ccode", "model"},
    "pages": {"jinja2", "markupsafe", "matplotlib", "platform"},
    "signals": {"numpy", "model"},
    "protocol": {"pydantic"},
    "config": {"pydantic", "model"},
    "machines": {"config", "model"},
    "fmi/importing": {"fmpy", "llvmlite", "numba", "numpy", "config", "model"},
    "device": {"canopen"},
    "partners": {"cantools", "crccheck", "e2e", "device"},
    "bus": {"can"},
    "can_timing": set(),
    "export": {"cantools", "device"},
    "faults": {"signals", "device", "model"},
    "recording": {
        "numpy", "scipy", "bus", "config", "device", "export", "model", "platform", "signals",
    },
    "remote": {"can_timing", "device", "faults", "model", "platform", "protocol", "signals"},
    "identify/measured": {"numpy", "scipy", "model"},
    "identify/data_checks": {"numpy", "scipy", "model"},
    "identify/prediction/residuals": {"numpy", "scipy"},
    "identify/prediction/model_run": {"numpy", "model"},
    "identify/prediction/filter": {"numpy", "model"},
    "identify/prediction/plant": {"numpy", "numba", "model", "config"},
    "identify/prediction/free_terms": {"numpy", "model"},
    "identify/prediction/observer": {"numpy", "model"},
    "identify/prediction/parallel": {"numpy", "model", "config", "platform"},
    "identify/prediction/benches": {"numpy", "scipy", "model", "config"},
    "identify/prediction": {"model"},
    "identify/estimation": {"numpy", "scipy"},
    "identify/selection": {"numpy", "scipy"},
    "identify/disagreement": {"numpy", "scipy"},
    "identify/experiment_design": {"numpy", "model"},
    "identify/conclusion": {"numpy", "scipy", "config", "model"},
    "identify/reporting": {"numpy", "matplotlib", "model", "pages"},
    "identify": {"scipy", "threadpoolctl", "config", "platform"},
    "captures": {"numpy", "cantools", "bus", "device", "identify/measured"},
    "characterise": {"numpy", "matplotlib", "model", "pages", "platform"},
    "conformance": {"pytest", "bus", "device", "pages", "platform"},
    "simulation": {
        "cantools", "numpy", "bus", "can_timing", "config", "device", "faults", "fmi/importing",
        "model", "partners", "platform", "recording", "signals",
    },
    "demo": {
        "numpy", "bus", "config", "pages", "platform", "recording", "signals", "simulation",
    },
    "bench": {
        "numpy", "websockets", "bus", "ccode", "config", "identify",
        "identify/conclusion", "identify/estimation", "identify/prediction/observer",
        "identify/selection", "model", "platform", "protocol", "recording", "simulation",
    },
    "scenario": {
        "numpy", "pydantic", "bus", "config", "device", "faults", "model", "pages", "platform",
        "recording", "signals", "simulation",
    },
    "testing": {
        "canopen", "pytest", "bus", "config", "device", "faults", "platform", "recording",
        "scenario", "signals", "simulation",
    },
    "panel": {
        "numpy", "canopen", "websockets", "bus", "config", "device", "faults", "identify/measured",
        "model", "platform", "protocol", "recording", "remote", "scenario", "signals",
        "simulation",
    },
    "api": {
        "gymnasium", "matplotlib", "numpy", "pandas", "xarray", "bus", "captures", "config",
        "device", "identify", "identify/conclusion", "identify/measured", "identify/reporting",
        "model", "pages", "platform", "recording", "scenario", "signals", "simulation",
    },
}  # fmt: skip
"""Rooms from the ground up; the first ones know least. What each may import, besides Python's own
library, the ground and itself: other rooms, and libraries. The rooms of `identify` know those
above them in this list, too, as data goes through them in that order. What stands above all of
these - the command line - may know everything."""

IDENTIFY = [room for room in ROOMS if room.startswith("identify")]

NARROW = {
    ("identify/conclusion", "config"): {"config.datasheet"},
    ("conformance", "device"): {"device.eds", "device.entry", "device.datatype"},
    ("model", "platform"): {"platform.file_lock", "platform.supported_numba"},
}
"""Where a room needs little of another, all that it may take: the suite reads an EDS as a node
does, and knows nothing of how a node works; a conclusion states values as data sheets do; what
compiles the physics does so once, with a numba that it knows."""

OUTERMOST = {"command_line", "commands", "learning.py", "__main__.py", "__init__.py"}

INDEPENDENT = (
    {"identify/prediction/residuals", "identify/prediction/model_run"},
    {"identify/prediction/parallel", "identify/prediction/benches"},
    {"identify/disagreement", "identify/experiment_design"},
)
"""Pairs of rooms that do not import each other."""

# Modules by which time, threads and randomness would come in unasked.
FORBIDDEN = {
    "model": {"time", "threading", "random", "logging", "socket", "asyncio"},
    "device": {"time", "threading", "random", "socket", "asyncio", "datetime", "can"},
    "can_timing": {"time", "threading", "random", "logging", "socket", "asyncio"},
}


def imports(file: Path) -> set[str]:
    """Return the modules a file imports, with the names it takes from them."""
    modules: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            modules |= {f"{node.module}.{alias.name}" for alias in node.names}
    return modules


def room_of(path: str) -> str:
    """Return the room of a file of the package, or of a module; "" for the ground."""
    parts = path.replace(".py", "").replace(".", "/").split("/")
    for depth in (3, 2, 1):
        if "/".join(parts[:depth]) in ROOMS:
            return "/".join(parts[:depth])
    return "" if parts[0] in GROUND else parts[0]


def files(room: str) -> list[Path]:
    """Return the files of a room, without those of rooms inside it."""
    inside = sorted((PACKAGE / room).rglob("*.py"))
    return [f for f in inside if room_of(str(f.relative_to(PACKAGE))) == room]


def known(room: str) -> set[str]:
    """Return what a room may import, itself included."""
    allowed = ROOMS[room] | {room}
    if room in IDENTIFY:
        independent = set().union(*(pair for pair in INDEPENDENT if room in pair))
        allowed |= set(IDENTIFY[: IDENTIFY.index(room)]) - independent
    return allowed


def begins(module: str, prefixes: set[str]) -> bool:
    """Tell whether a module is one of some packages or inside them."""
    return any(module == p or module.startswith(f"{p}.") for p in prefixes)


def foreign(file: Path) -> Iterator[str]:
    """Yield the rooms and libraries that a file takes something from."""
    for module in imports(file):
        first = module.split(".")[0]
        if first == OWN:
            yield room_of(module.removeprefix(f"{OWN}."))
        elif first not in sys.stdlib_module_names:
            yield first


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_knows_only_what_lies_below_it(room: str) -> None:
    """No room of the package reaches up to, or across to, a room it may not know."""
    for file in files(room):
        for taken in foreign(file):
            assert taken in known(room) | {""}, f"{file.name} of {room} imports {taken}"


@pytest.mark.parametrize("door", NARROW, ids=" to ".join)
def test_a_narrow_door_stays_narrow(door: tuple[str, str]) -> None:
    """A room that needs one thing of another takes that alone."""
    room, other = door
    allowed = {f"{OWN}.{name}" for name in NARROW[door]}
    for file in files(room):
        taken = {m for m in imports(file) if begins(m, {f"{OWN}.{other}"})}
        assert all(begins(m, allowed) for m in taken), f"{file.name} imports {taken}"


def test_the_model_knows_nothing_of_this_package() -> None:
    """Not even its errors and units: it is the ground floor."""
    for file in files("model"):
        assert "" not in set(foreign(file)), file


def test_every_room_has_a_rule() -> None:
    """Every folder has a list of permitted imports; only the outermost folders have no limit."""
    for file in PACKAGE.rglob("*.py"):
        room = room_of(str(file.relative_to(PACKAGE)))
        assert not room or room in ROOMS or file.relative_to(PACKAGE).parts[0] in OUTERMOST, file


def test_a_folder_next_to_rooms_is_a_room() -> None:
    """A room that holds rooms holds no other folders: a new one gets its own rule."""
    divided = {room.rpartition("/")[0] for room in ROOMS} - {""}
    folders = {str(f.parent.relative_to(PACKAGE)) for f in PACKAGE.rglob("*.py")}
    inside = {folder for folder in folders if folder.rpartition("/")[0] in divided}
    assert inside <= ROOMS.keys()


def test_rules_point_down() -> None:
    """The list begins at the ground: no rule allows a room that comes later in it."""
    order = list(ROOMS)
    for room in order:
        above = [
            other for other in known(room) & set(order) if order.index(other) > order.index(room)
        ]
        assert not above, f"{room} may know {above}"


def test_no_rule_allows_what_nobody_takes() -> None:
    """What a room has ceased to need, it may no longer know."""
    for room, allowed in ROOMS.items():
        taken = {other for file in files(room) for other in foreign(file)}
        assert allowed <= taken, f"{room} does not import {allowed - taken}"


def test_no_files_import_each_other_in_a_circle() -> None:
    """Every file can be read after the files that it imports."""
    modules = {_dotted(f): f for f in PACKAGE.rglob("*.py")}
    needs = {name: {m for i in imports(f) if (m := _module(i, modules)) and m != name}
             for name, f in modules.items()}  # fmt: skip
    while needs:
        ready = {name for name, others in needs.items() if not others & needs.keys()}
        assert ready, f"in a circle, or above one: {sorted(needs)}"
        needs = {name: others for name, others in needs.items() if name not in ready}


def _dotted(file: Path) -> str:
    parts = file.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _module(name: str, modules: dict[str, Path]) -> str:
    """Return the module that an imported name is, or comes from; "" for a foreign one."""
    return (
        name if name in modules else name.rpartition(".")[0] * (name.rpartition(".")[0] in modules)
    )


@pytest.mark.parametrize("room", FORBIDDEN)
def test_a_room_cannot_tell_the_time(room: str) -> None:
    """Physics and device get time and randomness handed in; they cannot take them."""
    for file in files(room):
        taken = {m for m in imports(file) if begins(m, FORBIDDEN[room])}
        assert not taken, f"{file.name} of {room} imports {taken}"


def test_only_the_bus_touches_python_can() -> None:
    """A frame enters and leaves through one door."""
    outside = [f for f in PACKAGE.rglob("*.py") if "bus" not in f.relative_to(PACKAGE).parts]
    touching = [f.name for f in outside if any(begins(m, {"can"}) for m in imports(f))]
    assert touching == []


def test_a_class_name_means_one_thing() -> None:
    """A class name exists once in the package."""
    homes: dict[str, list[str]] = {}
    for file in PACKAGE.rglob("*.py"):
        for node in ast.parse(file.read_text()).body:
            if isinstance(node, ast.ClassDef):
                homes.setdefault(node.name, []).append(str(file.relative_to(PACKAGE)))
    assert not {name: where for name, where in homes.items() if len(where) > 1}
