"""Chapters 8 and 9, additional cases: scope of resets and storing (CiA 301 7.3.2.2, 7.5.2.13)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_writable
from hil_emulator.conformance.device import (
    HEARTBEAT_PRODUCER,
    LOAD,
    OPERATIONAL,
    PRE_OPERATIONAL,
    RESET_COMMUNICATION,
    RESET_NODE,
    RESTORE_PARAMETERS,
    SAVE,
    STOPPED,
    STORE_PARAMETERS,
    Device,
)
from hil_emulator.conformance.parameters import APPLICATION, free_parameters
from hil_emulator.conformance.patterns import pattern
from hil_emulator.device.entry import Entry

ALL, COMMUNICATION, APPLICATION_PARAMETERS = 1, 2, 3
CAPABILITY = 0b11
"""Bits of the values of 0x1010 and 0x1011 (CiA 301 7.5.2.13): on command, autonomously."""
PAUSE_MS = 50
KEPT_MS = 4321


class Changed:
    """A communication and an application parameter, both changed."""

    def __init__(self, device: Device) -> None:
        self.device = device
        need_writable(device, HEARTBEAT_PRODUCER)
        self.variable = _parameter(device)
        self.defaults = self.read()
        self.values = KEPT_MS.to_bytes(2, "little"), self._other()
        device.sdo.download(HEARTBEAT_PRODUCER, 0, self.values[0])
        device.sdo.download(self.variable.index, self.variable.subindex, self.values[1])
        assert self.read() == self.values, "the parameters do not keep the values written"

    def read(self) -> tuple[bytes, bytes]:
        """Return the values of both parameters."""
        upload = self.device.sdo.upload
        return upload(HEARTBEAT_PRODUCER), upload(self.variable.index, self.variable.subindex)

    def _other(self) -> bytes:
        patterns = [pattern(self.variable, seed) for seed in range(2)]
        return next(p for p in patterns if p != self.defaults[1])


def _parameter(device: Device) -> Entry:
    """Return an application parameter that only SDO writes."""
    for variable in free_parameters(device.eds, APPLICATION):
        plain = variable.type.numeric and variable.access == "rw" and not variable.mappable
        if plain and pattern(variable, 0) != pattern(variable, 1):
            return variable
    pytest.skip("no application parameter can be written")


@case("8.301")
def test_communication_parameters_alone_are_saved(storing: Device) -> None:
    """After saving sub-index 2 and a reset, application parameters are at their defaults."""
    need_writable(storing, STORE_PARAMETERS, COMMUNICATION)
    changed = Changed(storing)
    storing.sdo.download(STORE_PARAMETERS, COMMUNICATION, SAVE)
    storing.reset(RESET_NODE)
    assert changed.read() == (changed.values[0], changed.defaults[1])


@case("8.302")
def test_application_parameters_alone_are_saved(storing: Device) -> None:
    """After saving sub-index 3 and a reset, communication parameters are at their defaults."""
    need_writable(storing, STORE_PARAMETERS, APPLICATION_PARAMETERS)
    changed = Changed(storing)
    storing.sdo.download(STORE_PARAMETERS, APPLICATION_PARAMETERS, SAVE)
    storing.reset(RESET_NODE)
    assert changed.read() == (changed.defaults[0], changed.values[1])


@case("9.321")
def test_reset_communication_leaves_the_application(device: Device) -> None:
    """Communication parameters are at their defaults, application parameters as written."""
    changed = Changed(device)
    device.reset(RESET_COMMUNICATION)
    assert changed.read() == (changed.defaults[0], changed.values[1])


@case("9.322")
def test_reset_node_resets_all(device: Device) -> None:
    """All parameters are at their defaults."""
    changed = Changed(device)
    device.reset(RESET_NODE)
    assert changed.read() == changed.defaults


def check_restored_alone(storing: Device, subindex: int, restored: int) -> None:
    """Check that a sub-index of 0x1011 restores the defaults of its parameters only.

    Args:
        storing: the device.
        subindex: of 0x1011.
        restored: position in `Changed.values` of the parameter that is restored.

    """
    need_writable(storing, STORE_PARAMETERS, ALL)
    need_writable(storing, RESTORE_PARAMETERS, subindex)
    changed = Changed(storing)
    storing.sdo.download(STORE_PARAMETERS, ALL, SAVE)
    storing.sdo.download(RESTORE_PARAMETERS, subindex, LOAD)
    storing.reset(RESET_NODE)
    expected = list(changed.values)
    expected[restored] = changed.defaults[restored]
    assert list(changed.read()) == expected


@case("8.303")
def test_communication_parameters_alone_are_restored(storing: Device) -> None:
    """After restoring sub-index 2 and a reset, application parameters keep their stored values."""
    check_restored_alone(storing, COMMUNICATION, 0)


@case("8.304")
def test_application_parameters_alone_are_restored(storing: Device) -> None:
    """After restoring sub-index 3 and a reset, communication parameters keep stored values."""
    check_restored_alone(storing, APPLICATION_PARAMETERS, 1)


@case("8.305")
def test_storing_shows_its_capability(storing: Device) -> None:
    """0x1010:01 and 0x1011:01 have only bits 0 and 1, before and after a command."""
    need_writable(storing, STORE_PARAMETERS, ALL)
    before = storing.sdo.read(STORE_PARAMETERS, ALL)
    storing.sdo.download(STORE_PARAMETERS, ALL, SAVE)
    assert storing.sdo.read(STORE_PARAMETERS, ALL) == before
    assert before <= CAPABILITY, f"1010:01 reads as {before:08X}"
    if storing.eds.writable(RESTORE_PARAMETERS, ALL):
        value = storing.sdo.read(RESTORE_PARAMETERS, ALL)
        assert value <= CAPABILITY, f"1011:01 reads as {value:08X}"


@case("9.323")
def test_one_boot_up_for_each_reset(device: Device) -> None:
    """A reset sends one boot-up message; other changes of state send no boot-up message."""
    for command in (RESET_NODE, RESET_COMMUNICATION):
        since = len(device.wire.log)
        device.reset(command)
        for state in (OPERATIONAL, STOPPED, PRE_OPERATIONAL):
            device.enter(state)
            device.wire.run(PAUSE_MS)
        boots = device.wire.heard(device.error_control_id, since).count(b"\0")
        assert boots == 1, f"{boots} boot-up messages after NMT command {command}"
