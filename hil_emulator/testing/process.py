"""The emulator in a separate process, for controllers that are processes."""

import re
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError

_START_S = 60.0  # compiling the model for the first time takes some seconds (assumed limit)

_ANY_PORT = """
[bus]
interface = "socketcand_server"
channel = "can0"
host = "127.0.0.1"
port = 0
"""


class EmulatorProcess(AbstractContextManager["EmulatorProcess"]):
    """`hil-emulator run` in the background, on TCP or SocketCAN.

    Args:
        files: configuration files.
        clock: "wall" or "follow-sync".
        bus: "interface:channel"; without one a TCP server on a free port of 127.0.0.1.
        options: further options of `hil-emulator run`.

    Attributes:
        port: the TCP port of a TCP server.
        client: settings with which a stock `can.Bus` or `canopen.Network` joins.

    Raises:
        UserError: if it does not start; with its output.

    """

    def __init__(
        self,
        files: Sequence[Path],
        clock: str = "wall",
        bus: str | None = None,
        options: Sequence[str] = (),
    ) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="hil-emulator-")
        layer = Path(self._folder.name) / "bus.toml"
        layer.write_text(_ANY_PORT)
        command = [sys.executable, "-m", "hil_emulator", "run", *map(str, files), str(layer)]
        command += ["--clock", clock, *(["--bus", bus] if bus else []), *options]
        self._process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1
        )
        text = self._until("ready\n")
        match = re.search(r"on 127\.0\.0\.1:(\d+)", text)
        self.port = int(match[1]) if match else None
        self.client: dict[str, Any] = {
            "interface": "socketcand", "host": "127.0.0.1", "port": self.port, "channel": "can0",
        }  # fmt: skip
        if bus is not None:
            interface, _, channel = bus.partition(":")
            self.client = {"interface": interface, "channel": channel}

    def stop(self) -> str:
        """End it and return its output; repeated calls have no effect."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
        text = self._process.communicate(timeout=30)[0] or ""
        self._folder.cleanup()
        return text

    def __exit__(self, *error: object) -> None:
        self.stop()

    def _until(self, last: str) -> str:
        """Read its output up to the line that reports the start."""
        assert self._process.stdout is not None
        watchdog = threading.Timer(_START_S, self._process.kill)
        watchdog.start()
        lines: list[str] = []
        for line in self._process.stdout:
            lines.append(line)
            if last in line:
                watchdog.cancel()
                return "".join(lines)
        watchdog.cancel()
        self._process.wait()
        self._folder.cleanup()
        output = " ".join("".join(lines).split())
        raise UserError(f"the emulator did not start: {output}")
