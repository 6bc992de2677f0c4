"""The README tells the truth."""

import re
import shlex
from pathlib import Path

import pytest
from test_end_to_end import emulator

from hil_emulator.__main__ import main
from hil_emulator.config.load import load
from hil_emulator.platform.packaged import packaged, with_named
from hil_emulator.platform.paths import shipped

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", README, re.M | re.S)
COMMANDS = sorted(
    {
        line.partition("#")[0].strip()
        for kind, text in BLOCKS
        if kind == "sh"
        for line in re.split(r"\n|&&", text.replace("\\\n", ""))
        if "hil-emulator" in line
    }
    | set(re.findall(r"`(hil-emulator \w[^`]*)`", README))
)


MADE = set(re.findall(r"--(?:out|record) (\S+)", README)) | {
    copied.name
    for name in re.findall(r"--copy (\w+)`?", README.replace("\n", " "))
    for copied in with_named(packaged()[name])
}
"""Folders and files that commands of the README write."""


def blocks(kind: str, beginning: str) -> str:
    """Return the code block of a kind that begins with some words."""
    return next(text for k, text in BLOCKS if k == kind and text.startswith(beginning))


@pytest.mark.parametrize("line", COMMANDS)
def test_every_command_exists_with_its_options(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each command of the README is understood in an empty folder, or after those before it."""
    monkeypatch.chdir(tmp_path)
    _, name, *arguments = shlex.split(line)
    context = main.commands[name].make_context(name, arguments)
    for file in context.params.get("files", ()):
        assert Path(file).parts[0] in MADE or Path(file).is_file(), file


def test_the_connecting_client_works(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The Python lines connect to a running emulator, move it and print what it says."""
    code = blocks("python", "import canopen").replace('"hyd', f'"{ROOT}/eds/hyd')
    with emulator(tmp_path) as (port, _):
        exec(code.replace("29536", str(port)), {})
    name, values = capsys.readouterr().out.splitlines()
    assert name == "Hydraulic actuator emulator"
    position, force = re.fullmatch(r"([\d.]+) mm, (-?\d+) N", values).groups()
    assert 39.0 < float(position) < 81.0
    assert -5000 < int(force) < 5000


def test_an_effect_of_ones_own_takes_part(tmp_path: Path) -> None:
    """The example effect file and its layer set a parameter of the reference machine."""
    (tmp_path / "quadratic.py").write_text(blocks("python", "# quadratic.py"))
    layer = tmp_path / "drag.toml"
    layer.write_text(blocks("toml", "# drag.toml"))
    config = load([shipped("configs/hyq_knee.toml"), layer])
    assert config.plant["quadratic_drag_strength"] == 80.0
    assert config.effects[-1](velocity=-2.0, strength=80.0) == -320.0
