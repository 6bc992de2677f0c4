"""Chapters 8 and 9, own cases: what resetting and storing are about (CiA 301 7.3.2.2, 7.5.2.13)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_writable
from hil_emulator.conformance.device import (
    HEARTBEAT_PRODUCER,
    RESET_COMMUNICATION,
    RESET_NODE,
    SAVE,
    STORE_PARAMETERS,
    Device,
)
from hil_emulator.conformance.parameters import APPLICATION, free_parameters
from hil_emulator.conformance.patterns import pattern
from hil_emulator.device.entry import Entry

COMMUNICATION, APPLICATION_PARAMETERS = 2, 3
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
        assert self.read() == self.values, "the parameters do not take values"

    def read(self) -> tuple[bytes, bytes]:
        """Return both."""
        upload = self.device.sdo.upload
        return upload(HEARTBEAT_PRODUCER), upload(self.variable.index, self.variable.subindex)

    def _other(self) -> bytes:
        patterns = [pattern(self.variable, seed) for seed in range(2)]
        return next(p for p in patterns if p != self.defaults[1])


def _parameter(device: Device) -> Entry:
    """Return an application parameter: one that nothing but SDO writes."""
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
