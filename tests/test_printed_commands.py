"""Every command that a page shows is run as it is printed, and succeeds.

The blocks of a page are run in their order, in one empty folder. Files that the page shows are
written there. A comment before a block names what it needs and a test lacks:

    <!-- not run: needs root -->
    <!-- not run, "socketcan:": needs vcan0 -->     only the lines that contain the quoted text
"""

import contextlib
import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from glob import glob
from pathlib import Path

import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.platform.file_lock import locked

ROOT = Path(__file__).parent.parent
PAGES = {
    str(file.relative_to(ROOT)): file.read_text()
    for file in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if not {"generated", "_build"} & set(file.parts)
}
SHOWN = {
    page: shown[0]
    for page, text in PAGES.items()
    if (shown := re.match(r".*^ *```sh\n.*?^ *```$", text, re.M | re.S))
}
"""Pages with shell blocks, up to the last of these; what follows runs when the pages are built."""

BLOCK = re.compile(
    r"^(?: *<!-- not run(?:, \"(?P<skipped>[^\"]+)\")?: [^\n]+ -->\n"
    r"(?: *<!-- \w+ -->\n)?(?P<marked>))?"
    r"(?P<indent> *)```(?P<kind>\S+)(?: (?P<name>\S+))?\n"
    r"(?::exit: (?P<exit>\d+)\n)?(?P<code>.*?)^(?P=indent)```$",
    re.M | re.S,
)
FILE = re.compile(r"(?:#|//|/\*) (\w+\.\w+)\b")
"""First line of a block that shows a file."""

REFERENCE = "docs/reference/command_line.md"
"""Its examples are run unless another page has them."""

KNEE = "hil-emulator run hyq_knee --clock lockstep --port 0 --duration 1s --record"
GIVEN = {
    "docs/how_to/panel.md": [
        f"{KNEE} run.rec",
        "hil-emulator configs --copy friction_rig",
        "hil-emulator gap friction_rig.toml oring_1bar.csv --out found",
    ],
    REFERENCE: [f"{KNEE} run.rec", f"{KNEE} log.csv"],
}
"""Commands that make what a page takes as given: a recording, a log, a result."""

PATIENCE_S = 60.0
"""Longest time until an emulator is ready; a test that passes never waits for it."""

LOCK = Path(tempfile.gettempdir()) / "hil-emulator-29536.lock"
"""The pages name this port, so one page is followed at a time."""


class Reader:
    """Follows a page in an empty folder.

    What runs until Ctrl-C has a terminal of its own: it goes on until an emulator is started or the
    page ends. Other commands share the process of the test. Enter answers all questions.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "empty"
        self.folder.mkdir()
        self.printed = folder / "printed.txt"
        self.terminal: subprocess.Popen[bytes] | None = None
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        self.environment = {**os.environ, "PATH": path}

    def follow(self, block: re.Match[str]) -> None:
        """Type the commands of a block, or write the file that it shows."""
        code = re.sub(f"^{block['indent']}", "", block["code"], flags=re.M)
        if block["kind"] in {"sh", "{command}"}:
            if block["marked"] is None or block["skipped"]:
                for line in code.replace("\\\n", "").splitlines():
                    if line and not (block["skipped"] and block["skipped"] in line):
                        self.type(line, int(block["exit"] or 0))
        elif file := block["name"] or FILE.match(code):
            (self.folder / (file if isinstance(file, str) else file[1])).write_text(code)

    def type(self, line: str, expected: int = 0) -> None:
        """Run a line; fail with what it has printed unless it has the expected exit code."""
        if re.match(r"hil-emulator (run|panel) ", line):
            self.end()
        if re.match(r"hil-emulator (run (?!.*--duration)|panel )", line):
            self._open_terminal(line)
        elif re.match(r"hil-emulator (?!run |bench )[^|><&;$]*$", line.partition(" #")[0]):
            self._invoke(line, expected)
        else:
            done = subprocess.run(
                ["bash", "-ec", line], cwd=self.folder, env=self.environment, input="",
                capture_output=True, text=True, check=False,
            )  # fmt: skip
            assert done.returncode == expected, f"{line}\n{done.stdout}{done.stderr}"

    def _invoke(self, line: str, expected: int) -> None:
        """Run a line that uses no more of a shell than quotes and names with stars."""
        _, *words = shlex.split(line, comments=True)
        with contextlib.chdir(self.folder):
            arguments = [a for w in words for a in (sorted(glob(w)) if "*" in w else [w])]
            done = CliRunner().invoke(main, arguments, input=os.linesep * 100)
        assert done.exit_code == expected, f"{line}\n{done.output}"

    def _open_terminal(self, line: str) -> None:
        with self.printed.open("wb") as printed:
            self.terminal = subprocess.Popen(
                ["bash", "-ec", f"exec {line}"], cwd=self.folder, env=self.environment,
                stdin=subprocess.DEVNULL, stdout=printed, stderr=subprocess.STDOUT,
            )  # fmt: skip
        end = time.monotonic() + PATIENCE_S
        started = r"^panel " if line.startswith("hil-emulator panel") else r"^(ready|waits )"
        while not re.search(started, self.printed.read_text(), re.M):
            if self.terminal.poll() is not None or time.monotonic() > end:
                self.terminal.kill()
                self.terminal = None
                pytest.fail(f"{line}\n{self.printed.read_text()}")
            time.sleep(0.02)

    def end(self) -> None:
        """End what runs by Ctrl-C; a scenario ends by itself."""
        if self.terminal is None:
            return
        terminal, self.terminal = self.terminal, None
        if "--scenario" not in str(terminal.args):
            terminal.send_signal(signal.SIGINT)
        try:
            code = terminal.wait(PATIENCE_S)
        finally:
            terminal.kill()
        assert code == 0, self.printed.read_text()


def blocks(page: str) -> Iterator[re.Match[str]]:
    """Yield the blocks of a page; of the reference those that no other page has."""
    others = "".join(text for name, text in SHOWN.items() if name != page)
    for block in BLOCK.finditer(SHOWN[page]):
        if page != REFERENCE or block["code"] not in others:
            yield block


QUICK = {"docs/how_to/practice.md", "docs/how_to/c_export.md"}
"""Pages whose commands take a second together and use no port."""

CASES = [pytest.param(page, marks=[] if page in QUICK else pytest.mark.slow) for page in SHOWN]


@pytest.mark.parametrize("page", CASES)
def test_the_commands_of_a_page_succeed(page: str, tmp_path: Path) -> None:
    """Each has exit code 0, in the folder in which those before it have run."""
    reader = Reader(tmp_path)
    with contextlib.nullcontext() if page in QUICK else locked(LOCK):
        try:
            for line in GIVEN.get(page, []):
                reader.type(line)
            for block in blocks(page):
                reader.follow(block)
        finally:
            reader.end()
