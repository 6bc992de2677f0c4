"""Program download: 0x1F50, 0x1F51, 0x1F56 and 0x1F57 (CiA 302-3).

A master stops a program, clears it, writes another program and starts it. Each sub-index is one
program. The programs are not executed; only their checksum is computed, so that the download of a
master can be tested. They survive every reset, like flash memory, and the device starts without a
program, like a bootloader. Only objects of the EDS exist.
"""

import zlib
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.deadline import NEVER
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry

PROGRAM_DATA = 0x1F50
PROGRAM_CONTROL = 0x1F51
PROGRAM_IDENTIFICATION = 0x1F56
FLASH_STATUS = 0x1F57


class Control(IntEnum):
    """What a master may write into 0x1F51; it reads as STOP or START."""

    STOP = 0
    START = 1
    RESET = 2
    CLEAR = 3


class FlashError(IntEnum):
    """What 0x1F57 reports in bits 1 to 7; bit 0, an operation in progress, is never seen set."""

    NONE = 0
    NO_VALID_PROGRAM = 1


@dataclass
class Program:
    """One program in the flash memory.

    Attributes:
        data: its bytes, empty without a program.
        runs: whether it has been started.

    """

    data: bytes = b""
    runs: bool = False


class ProgramDownload:
    """The flash memory behind the objects.

    Args:
        dictionary: the node's dictionary.

    """

    quiet_until_ns = NEVER  # acts when a program is written

    def __init__(self, dictionary: Dictionary) -> None:
        self._dictionary = dictionary
        owned = (PROGRAM_DATA, PROGRAM_CONTROL)
        self._programs = {e.subindex: Program() for e in dictionary if e.index in owned}
        self._programs.pop(0, None)  # sub-index 0 is the number of programs
        for index in owned:
            dictionary.watch(index, self)
        self.reset()

    def reset(self) -> None:
        """Show the programs again; a reset does not change them."""
        for number in self._programs:
            self._show(number)

    def check(self, entry: Entry, value: Any) -> None:
        """Refuse commands that are unknown (0609 0030) or not allowed (0800 0022, 0800 0024)."""
        program = self._programs.get(entry.subindex)
        if program is None:
            return  # in some files a master may write the number of programs
        if entry.index == PROGRAM_CONTROL and value not in list(Control):
            raise SdoAbort(AbortCode.INVALID_VALUE)
        if entry.index == PROGRAM_CONTROL and value in (Control.START, Control.RESET):
            if not program.data:
                raise SdoAbort(AbortCode.NO_DATA)
        elif program.runs and (entry.index == PROGRAM_DATA or value == Control.CLEAR):
            raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)

    def changed(self, entry: Entry) -> None:
        """Store a program, or execute a command."""
        program = self._programs.get(entry.subindex)
        if program is None:
            return
        if entry.index == PROGRAM_DATA:
            program.data = entry.value
        else:
            program.runs = entry.value in (Control.START, Control.RESET)
            if entry.value == Control.CLEAR:
                program.data = b""
        self._show(entry.subindex)

    def _show(self, number: int) -> None:
        """Update the objects of a program: bytes, state and CRC-32 (IEEE 802.3)."""
        program = self._programs[number]
        error = FlashError.NONE if program.data else FlashError.NO_VALID_PROGRAM
        for index, value in (
            (PROGRAM_DATA, program.data),
            (PROGRAM_CONTROL, Control.START if program.runs else Control.STOP),
            (PROGRAM_IDENTIFICATION, zlib.crc32(program.data)),
            (FLASH_STATUS, error << 1),
        ):
            entry = self._dictionary.get(index, number)
            if entry is not None:
                entry.value = value
