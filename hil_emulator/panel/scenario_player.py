"""The scenarios of the panel, and the present one."""

import asyncio
import json
import sys
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError, brief, did_you_mean
from hil_emulator.platform.helper_process import ending, report
from hil_emulator.platform.paths import shipped

_SHIPPED = "configs/scenarios/stuck_spool_at_speed.toml"


class ScenarioPlayer:
    """Plays one scenario at a time, in a separate process.

    Args:
        folders: folders of further scenarios.

    Attributes:
        files: the scenarios, by name.
        progress: of the last one, see `play`; None before the first.

    """

    def __init__(self, folders: set[Path]) -> None:
        places = [shipped(_SHIPPED).parent, *(folder / "scenarios" for folder in folders)]
        self.files = {f.stem: f for place in places for f in sorted(place.glob("*.toml"))}
        self.progress: dict[str, Any] | None = None
        self._player: asyncio.subprocess.Process | None = None
        self._stopped = False
        self._task: asyncio.Task[None] | None = None

    async def start(self, name: str) -> None:
        """Play a scenario from its beginning; the present one ends.

        Raises:
            UserError: for an unknown one.

        """
        if name not in self.files:
            raise UserError(f"no scenario '{brief(name)}'{did_you_mean(name, self.files)}")
        await self.stop()
        self.progress = {"title": name, "time": 0.0, "checks": []}
        self._stopped = False
        self._task = asyncio.create_task(self._play(self.files[name]))

    async def stop(self) -> None:
        """End the present scenario."""
        self._stopped = True
        if self._player is not None and self._player.returncode is None:
            self._player.kill()
        if self._task is not None:
            await self._task

    async def _play(self, file: Path) -> None:
        self._player = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "hil_emulator.panel.play", str(file),
            stdout=asyncio.subprocess.PIPE,
        )  # fmt: skip
        assert self._player.stdout is not None
        async for line in self._player.stdout:
            if line.endswith(b"\n"):  # not one that was cut off
                self.progress = json.loads(line)
        code = await self._player.wait()
        if code and not self._stopped:
            trouble = f"scenario {file.stem}: its process {ending(code)}; play it again"
            self.progress = {"trouble": trouble}
            report(trouble)
