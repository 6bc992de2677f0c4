"""A bench that only measures has no device on a bus and no node in its configuration."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.platform.paths import shipped


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    """Return the reference machine's configuration without its node."""
    text = shipped("configs/hyq_knee.toml").read_text(encoding="utf-8")
    file = tmp_path / "bench.toml"
    file.write_text(re.sub(r"\[\[node\]\].*?(?=\n\[)", "", text, flags=re.DOTALL))
    assert "[[node]]" not in file.read_text()
    return file


def asked(*arguments: object) -> tuple[int, str]:
    """Run the command line and return exit code and output."""
    done = CliRunner().invoke(main, [str(a) for a in arguments])
    return done.exit_code, done.output


@pytest.mark.parametrize("words", [
    ("linear",), ("experiment", "steps", "--out", "steps.csv"),
    pytest.param(("characterise", "leakage", "--out", "pages"), marks=pytest.mark.slow),
    ("hide", "nothing", "--duration", "0.8 s", "--out", "practice"),
])  # fmt: skip
def test_commands_without_a_bus_need_no_node(
    bench: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    """Linear model, stimuli, bench tests and practice data concern the plant alone."""
    monkeypatch.chdir(bench.parent)
    where = ["--config", bench] if words[0] in ("hide", "experiment") else [bench]
    code, output = asked(*words, *where)
    assert code == 0, output


def test_commands_on_a_bus_require_a_node(bench: Path, tmp_path: Path) -> None:
    """One message names the missing part and its syntax; no file is left over."""
    scenario = tmp_path / "play.toml"
    scenario.write_text('title = "x"\nconfig = ["bench.toml"]\nduration = "1 s"\n[[step]]\n'
                        'at = "10 ms"\nnmt = "start"\n[[expect]]\n'
                        'signal = "position"\nwithin = ["0 mm", "80 mm"]\n')  # fmt: skip
    for words in (
        ("run", bench, "--clock", "lockstep", "--duration", "1 s"), ("check", bench),
        ("export", bench, "--out", tmp_path / "out"), ("scenario", scenario),
        ("experiment", "steps", "--config", bench, "--out", tmp_path / "new.csv",
         "--scenario", tmp_path / "new.toml"),
    ):  # fmt: skip
        code, output = asked(*words)
        assert code == 2, output
        assert "bench.toml: node: missing: nothing is on a bus" in output, output
    assert not list(tmp_path.glob("new.*"))


def test_a_capture_needs_a_description_of_its_frames(bench: Path, tmp_path: Path) -> None:
    """Without a node, a DBC or an EDS is required; otherwise one message asks for it."""
    capture = tmp_path / "run.log"
    capture.write_text("(0.000000) can0 185#0000000000000000\n")
    code, output = asked("gap", bench, capture)
    assert code == 2
    assert "name a --dbc or --eds" in output
