"""Storing and restoring parameters with 0x1010 and 0x1011 (CiA 301 7.5.2.13)."""

import pytest
from device_master import CHANNELS, EDS, NODE_ID, TPDO2, Master, booted

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node
from hil_emulator.device.storage import MemoryStorage, Storage, Values
from hil_emulator.errors import UserError

RESET_NODE, RESET_COMMUNICATION = 129, 130


class BrokenStorage:
    """A storage that cannot be written."""

    def load(self) -> Values:
        """Return nothing."""
        return {}

    def save(self, values: Values) -> None:
        """Fail."""
        raise OSError


def switched_on(storage: Storage) -> Master:
    """Return a master of a device that has just got power."""
    dictionary = Dictionary.from_eds(EDS, NODE_ID)
    return booted(Node(dictionary, CHANNELS, {"valve_current": 0.001}, storage))


def change(master: Master) -> None:
    """Write one communication and one application parameter."""
    master.remote.sdo[0x1017].raw = 50
    master.remote.sdo["valve_current_safe"].raw = 7


def parameters(master: Master) -> tuple[int, int]:
    """Return the two parameters `change` writes."""
    return master.remote.sdo[0x1017].raw, master.remote.sdo["valve_current_safe"].raw


@pytest.mark.parametrize(("subindex", "kept"), [(1, (50, 7)), (2, (50, 1_000_000)), (3, (100, 7))])
def test_stored_parameters_survive_power_off(subindex: int, kept: tuple[int, int]) -> None:
    """All, communication or application parameters are kept over a new start."""
    storage = MemoryStorage()
    master = switched_on(storage)
    change(master)
    assert master.abort_code(0x1010, subindex, b"save") == 0
    assert parameters(switched_on(storage)) == kept


def test_stored_parameters_survive_resets(master: Master) -> None:
    """An NMT reset reloads the stored values, not later ones."""
    change(master)
    master.abort_code(0x1010, 1, b"save")
    master.remote.sdo[0x1017].raw = 60
    master.remote.sdo["valve_current_safe"].raw = 8
    master.nmt(RESET_COMMUNICATION)
    assert parameters(master) == (50, 8)
    master.nmt(RESET_NODE)
    assert parameters(master) == (50, 7)


def test_restored_defaults_show_after_the_reset(master: Master) -> None:
    """Restoring changes nothing until the node is reset."""
    change(master)
    master.abort_code(0x1010, 1, b"save")
    assert master.abort_code(0x1011, 1, b"load") == 0
    assert parameters(master) == (50, 7)
    master.nmt(RESET_NODE)
    assert parameters(master) == (100, 1_000_000)


def test_a_stored_mapping_is_in_force(master: Master) -> None:
    """A PDO with a stored identifier has this identifier after a reset."""
    master.remote.sdo[0x1801][1].raw = 1 << 31 | TPDO2
    master.remote.sdo[0x1801][1].raw = 0x190
    master.abort_code(0x1010, 2, b"save")
    master.nmt(RESET_NODE)
    master.run(1)
    master.start()
    master.run(3)
    assert (len(master.data(0x190)), len(master.data(TPDO2))) == (3, 0)


@pytest.mark.parametrize("index", [0x1010, 0x1011])
@pytest.mark.parametrize("signature", [b"evas", b"wron", b"\1\0\0\0"])
def test_wrong_signature_does_nothing(master: Master, index: int, signature: bytes) -> None:
    """Any value but "save" or "load" aborts with 0800 0020."""
    assert master.abort_code(index, 1, signature) == 0x08000020
    assert master.remote.sdo[index][1].raw == 1


def test_process_data_is_not_stored() -> None:
    """A set point is not a parameter: after a new start the safe value is in force."""
    storage = MemoryStorage()
    master = switched_on(storage)
    master.remote.sdo.download(0x2000, 0, (5_000_000).to_bytes(4, "little"))
    master.abort_code(0x1010, 1, b"save")
    assert {(0x2000, 0), (0x2001, 0)} & set(storage.load()) == {(0x2001, 0)}
    master = switched_on(storage)
    master.nmt(1)
    assert master.commands["valve_current"] == pytest.approx(0.001)


def test_failing_storage_aborts() -> None:
    """A failing storage aborts with 0606 0000."""
    assert switched_on(BrokenStorage()).abort_code(0x1010, 1, b"save") == 0x06060000


def test_stored_value_of_another_device_is_refused() -> None:
    """The error at the start names a stored value that does not fit the EDS."""
    storage = MemoryStorage()
    storage.save({(0x1017, 0): b"\1"})
    with pytest.raises(UserError, match="0x1017:00"):
        switched_on(storage)


def test_stored_safe_value_holds_from_the_start() -> None:
    """A stored safe value, not the configured one, is in force from power-up on."""
    storage = MemoryStorage()
    master = switched_on(storage)
    master.remote.sdo["valve_current_safe"].raw = 3_000_000
    master.abort_code(0x1010, 1, b"save")
    for device in (master, switched_on(storage)):
        device.nmt(RESET_NODE)
        device.run(1)
        device.nmt(1)
        assert device.commands["valve_current"] == pytest.approx(0.003)
