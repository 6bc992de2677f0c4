"""`hil-emulator panel`: a recording or an identification on the panel's page."""

import contextlib
import signal
from pathlib import Path

import click

from hil_emulator.panel.server_process import require_server


def panel(path: Path) -> None:
    """Serve a page until it is interrupted.

    Raises:
        UserError: if there is no data to show, or the server is not installed.

    """
    require_server()
    from hil_emulator.panel.offline_source import opened
    from hil_emulator.panel.show import show

    source = opened(path)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with contextlib.suppress(KeyboardInterrupt):
        show(source, lambda address: click.echo(f"panel     {address}\nCtrl-C ends."))
