"""What README and pages show works as it stands there."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import canopen
import pytest
from test_end_to_end import emulator

from hil_emulator.__main__ import main
from hil_emulator.config.load import load
from hil_emulator.platform.packaged import packaged, with_named
from hil_emulator.platform.paths import shipped

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PAGES = {"README.md": (ROOT / "README.md").read_text()} | {
    str(file.relative_to(DOCS)): file.read_text()
    for file in sorted(DOCS.rglob("*.md"))
    if file.stem not in {"CHANGELOG", "CONTRIBUTING"}
    and not {"generated", "reference"} & set(file.parts)
}
"""Pages that a reader with an installed wheel follows."""

BLOCK = re.compile(r"^```\{?(\w+)\}?\n(.*?)^```$", re.M | re.S)


def commands(text: str) -> Iterator[str]:
    """Yield the commands of a page, those inside its sentences included."""
    for kind, block in BLOCK.findall(text):
        shell = block.replace("\\\n", "") if kind in {"sh", "command"} else ""
        for line in re.split(r"\n|&&|\|", shell):
            yield re.sub(r" (> \S+|&)$", "", line.partition("#")[0].strip())
    for span in re.findall(r"`([^`]+)`", BLOCK.sub("", text)):
        yield re.sub(r"\s+", " ", span)


COMMANDS = sorted(
    {
        (page, line)
        for page, text in PAGES.items()
        for line in commands(text)
        if re.match(r"(\S*/)?hil-emulator [a-z-]+", line)
    }
)


def made() -> set[str]:
    """Return the files and folders that commands of the pages write, or that they show."""
    text = "\n".join(PAGES.values())
    copied = re.findall(r"--copy (\w+)", text)
    shown = re.findall(r"^```(?:\w+\n# |\{file\} )(\w+\.\w+)", text, re.M)
    names = re.findall(r"(?:--(?:out|record)|hil-emulator init) ([\w./]+)", text)
    return {
        "log.csv",
        "log.mat",
        "run.blf",
        *shown,
        *names,
        *(f.name for c in copied for f in with_named(packaged()[c])),
    }


MADE = made()
"""With the reader's own: a log."""


def block(page: str, kind: str, beginning: str) -> str:
    """Return the code of a page, of a kind, that begins with some words."""
    return next(
        text for k, text in BLOCK.findall(PAGES[page]) if k == kind and text.startswith(beginning)
    )


@pytest.mark.parametrize(("page", "line"), COMMANDS)
def test_every_command_exists_with_its_options(
    page: str, line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each command of a page is understood in an empty folder, or after those before it."""
    monkeypatch.chdir(tmp_path)
    _, name, *arguments = shlex.split(line)
    if not arguments:  # it may be the command alone that is meant
        assert name in main.commands
        return
    context = main.commands[name].make_context(name, arguments)
    for file in context.params.get("files") or ():
        assert Path(file).parts[0] in MADE or Path(file).is_file(), file


@pytest.fixture(scope="module")
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """Yield the port of an emulator that runs, for one client after the other."""
    with emulator(tmp_path_factory.mktemp("emulator")) as (port, _):
        yield port


@pytest.mark.parametrize("page", ["README.md", "how_to/controller.md"])
def test_the_connecting_client_works(
    page: str, port: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """The Python lines connect to a running emulator, move it and print its values."""
    code = block(page, "python", "import canopen").replace('"hyd', f'"{ROOT}/eds/hyd')
    exec(code.replace("29536", str(port)), {})
    *name, values = capsys.readouterr().out.splitlines()
    assert name in ([], ["Hydraulic actuator emulator"])
    position, force = re.fullmatch(r"([\d.]+) mm, (-?\d+) N", values).groups()
    assert 39.0 < float(position) < 81.0
    assert -5000 < int(force) < 5000


def test_the_controller_by_python_can_moves_the_rod_towards_its_target(port: int) -> None:
    """Through TCP, for a second of emulator time."""
    network = canopen.Network()
    network.connect(interface="socketcand", host="127.0.0.1", port=port, channel="can0")
    node = network.add_node(5, str(shipped("eds/hydraulic_actuator.eds")))
    node.nmt.state = "OPERATIONAL"
    before = node.sdo["position"].phys
    code = block("how_to/controller.md", "python", "import logging, struct")
    exec(code.replace("29536", str(port)), {})
    assert abs(node.sdo["position"].phys - 0.05) < abs(before - 0.05)
    network.disconnect()


def test_an_effect_of_ones_own_takes_part(tmp_path: Path) -> None:
    """The example effect file and its layer set a parameter of the reference machine."""
    (tmp_path / "quadratic.py").write_text(
        block("how_to/own_effect.md", "python", "# quadratic.py")
    )
    layer = tmp_path / "drag.toml"
    layer.write_text(block("how_to/own_effect.md", "toml", "# drag.toml"))
    config = load([shipped("configs/hyq_knee.toml"), layer])
    assert config.plant["quadratic_drag_strength"] == 80.0
    assert config.effects[-1](velocity=-2.0, strength=80.0) == -320.0
