"""The emulator in a process of its own, for controllers that are processes too."""

import struct
from pathlib import Path
from typing import Any

import can
import pytest

from hil_emulator.errors import UserError
from hil_emulator.testing.process import EmulatorProcess


def test_a_client_joins_over_tcp(emulator_process: Any) -> None:
    """Under the wall clock a stock python-can client gets an answer to an SDO request."""
    with can.Bus(**emulator_process.client) as bus:
        request = bytes.fromhex("4000100000000000")
        bus.send(can.Message(arbitration_id=0x605, data=request, is_extended_id=False))
        answer = next(m for m in iter(lambda: bus.recv(10), None) if m.arbitration_id == 0x585)
        assert answer.data.hex() == "4300100098010000"


@pytest.mark.emulator(clock="follow-sync")
def test_the_clients_sync_is_the_clock(emulator_process: Any) -> None:
    """Ten SYNCs, ten answers, however slow the client is."""
    with can.Bus(**emulator_process.client) as bus:

        def send(can_id: int, data: bytes = b"") -> None:
            bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

        send(0x000, bytes([1, 5]))
        for _ in range(10):
            send(0x205, struct.pack("<i", 0))
            send(0x080)
            assert next(m for m in iter(lambda: bus.recv(10), None) if m.arbitration_id == 0x485)


def test_one_that_cannot_start_says_why(tmp_path: Path) -> None:
    """The emulator's own message is in the error."""
    with pytest.raises(UserError, match=r"did not start: .*nothing\.toml: no such file"):
        EmulatorProcess([tmp_path / "nothing.toml"])
