"""Chapter 2, last part: additional SDO servers and clients (CiA 301 7.5.2.33, 7.5.2.34)."""

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import NO_SUCH_OBJECT
from hil_emulator.conformance.device import RESET_COMMUNICATION, SAVE, STORE_PARAMETERS, Device
from hil_emulator.conformance.expectation import where

SERVERS = range(0x1201, 0x1280)
CLIENTS = range(0x1280, 0x1300)


def has_exactly(device: Device, channels: range) -> None:
    """Check that all entries of the EDS's channels can be read, and that no others exist."""
    for index in channels:
        if index not in device.eds:
            code = device.sdo.read_code(index)
            assert code in NO_SUCH_OBJECT, f"{index:04X} is not in the EDS, abort {code:08X}"
    for (index, subindex), variable in device.eds.variables.items():
        if index in channels:
            assert device.sdo.read_code(index, subindex) == 0, where(variable)


@case("2.28")
def test_additional_servers_are_those_of_the_eds(device: Device) -> None:
    """0x1201 to 0x127F exist exactly if the EDS has them."""
    has_exactly(device, SERVERS)


@case("2.29")
def test_additional_servers_survive_a_reset(device: Device) -> None:
    """After reset communication the same servers exist."""
    device.reset(RESET_COMMUNICATION)
    has_exactly(device, SERVERS)


@case("2.30")
def test_clients_survive_saving_and_a_reset(storing: Device) -> None:
    """With all parameters saved, the clients of the EDS exist after reset communication."""
    if storing.eds.writable(STORE_PARAMETERS, 1):
        storing.sdo.download(STORE_PARAMETERS, 1, SAVE)
    storing.reset(RESET_COMMUNICATION)
    has_exactly(storing, CLIENTS)
