"""Program download (CiA 302-3), by a stock master."""

import random
import zlib
from pathlib import Path

import pytest
from device_master import CHANNELS, NODE_ID, Master, booted
from edited_eds import edited

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node

DATA, CONTROL, IDENTIFICATION, STATUS = 0x1F50, 0x1F51, 0x1F56, 0x1F57
STOP, START, RESET, CLEAR = range(4)
NO_VALID_PROGRAM = 1 << 1
WRONG_DEVICE_STATE, NO_DATA, INVALID_VALUE = 0x0800_0022, 0x0800_0024, 0x0609_0030
DOMAIN, UNSIGNED8, UNSIGNED32 = 0xF, 0x5, 0x7
IMAGE = random.Random(302).randbytes(10_000)


def array(index: int, data_type: int, access: str) -> str:
    """Return the sections of an array of two programs."""
    head = f"[{index:X}]\nParameterName=programs {index:X}\nObjectType=8\nSubNumber=3\n\n"
    count = f"[{index:X}sub0]\nParameterName=Highest\nDataType=5\nAccessType=const\nDefaultValue=2"
    numbers = (
        f"[{index:X}sub{n}]\nParameterName=Program {n}\nDataType={data_type}\nAccessType={access}"
        for n in (1, 2)
    )
    return head + "\n\n".join((count, *numbers)) + "\n\n"


@pytest.fixture
def bootloader(tmp_path: Path) -> Master:
    """Return a master of a device whose EDS has two programs."""
    objects = (
        array(DATA, DOMAIN, "wo"),
        array(CONTROL, UNSIGNED8, "rw"),
        array(IDENTIFICATION, UNSIGNED32, "ro"),
        array(STATUS, UNSIGNED32, "ro"),
    )
    eds = edited(tmp_path, ("[2000]\n", "".join(objects) + "[2000]\n"))
    return booted(Node(Dictionary.from_eds(eds, NODE_ID), CHANNELS, {"valve_current": 0.0}), eds)


def load(master: Master, image: bytes = IMAGE, number: int = 1) -> None:
    """Write a program in blocks."""
    with master.remote.sdo.open(DATA, number, "wb", size=len(image), block_transfer=True) as out:
        out.write(image)


def state(master: Master, number: int = 1) -> tuple[int, int, int]:
    """Return control, identification and flash status of a program."""
    objects = (CONTROL, IDENTIFICATION, STATUS)
    return tuple(master.remote.sdo[index][number].raw for index in objects)  # type: ignore[return-value]


def control(master: Master, command: int, number: int = 1) -> int:
    """Write a command; return its abort code, 0 for success."""
    return master.abort_code(CONTROL, number, bytes([command]))


def test_a_device_without_a_program_refuses_start(bootloader: Master) -> None:
    """Without a program there is no start and no checksum."""
    assert state(bootloader) == (STOP, 0, NO_VALID_PROGRAM)
    assert control(bootloader, START) == NO_DATA
    assert control(bootloader, RESET) == NO_DATA


@pytest.mark.parametrize("size", [1, 8, len(IMAGE)])
def test_the_checksum_is_that_of_the_download(bootloader: Master, size: int) -> None:
    """After stop, clear, download and start the checksum agrees; the other program is unchanged."""
    assert control(bootloader, STOP) == 0
    assert control(bootloader, CLEAR) == 0
    load(bootloader, IMAGE[:size])
    assert state(bootloader) == (STOP, zlib.crc32(IMAGE[:size]), 0)
    assert control(bootloader, START) == 0
    assert state(bootloader) == (START, zlib.crc32(IMAGE[:size]), 0)
    assert state(bootloader, 2) == (STOP, 0, NO_VALID_PROGRAM)


def test_segments_write_the_same_program_as_blocks(bootloader: Master) -> None:
    """A master without block transfer can download, too."""
    load(bootloader)
    assert bootloader.abort_code(DATA, 2, IMAGE) == 0
    assert state(bootloader, 1) == state(bootloader, 2)


def test_a_running_program_is_neither_written_nor_cleared(bootloader: Master) -> None:
    """It has to be stopped first; a refused access changes nothing."""
    load(bootloader)
    control(bootloader, START)
    running = state(bootloader)
    assert bootloader.abort_code(DATA, 1, b"another") == WRONG_DEVICE_STATE
    assert control(bootloader, CLEAR) == WRONG_DEVICE_STATE
    assert state(bootloader) == running
    assert control(bootloader, RESET) == 0
    assert state(bootloader) == running
    assert control(bootloader, STOP) == 0
    assert control(bootloader, CLEAR) == 0
    assert state(bootloader) == (STOP, 0, NO_VALID_PROGRAM)


def test_an_unknown_command_is_refused(bootloader: Master) -> None:
    """A command other than the four defined is refused with 0609 0030."""
    load(bootloader)
    assert control(bootloader, 4) == INVALID_VALUE


@pytest.mark.parametrize("command", [129, 130])
def test_a_program_survives_a_reset(bootloader: Master, command: int) -> None:
    """Programs are not parameters: resets and restored defaults do not change them."""
    load(bootloader)
    control(bootloader, START)
    before = state(bootloader)
    assert bootloader.abort_code(0x1011, 1, b"load") == 0
    bootloader.nmt(command)
    bootloader.run(2)
    assert state(bootloader) == before


def test_a_program_is_not_saved_with_the_parameters(bootloader: Master) -> None:
    """Saving by 0x1010 while a program runs does not restore a program that was cleared."""
    load(bootloader)
    control(bootloader, START)
    assert bootloader.abort_code(0x1010, 1, b"save") == 0
    control(bootloader, STOP)
    control(bootloader, CLEAR)
    bootloader.nmt(129)
    bootloader.run(2)
    assert state(bootloader) == (STOP, 0, NO_VALID_PROGRAM)


def test_the_shipped_device_has_no_program_objects(master: Master) -> None:
    """The objects do not exist if the EDS lacks them."""
    assert {master.abort_code(index, 1) for index in (DATA, CONTROL)} == {0x0602_0000}
