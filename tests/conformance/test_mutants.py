"""The suite tells broken devices from sound ones, and the same way wherever the fault is."""

import json

import pytest
from mutants import NOTICED, crashed, notice
from mutations import MUTANTS

SCORE = 0.95
UNNOTICED = {
    "lss_never_identified": "the service is optional, and no EDS says whether a slave has it",
    "lss_stored_in_vain": "shows when the power is off and on again, which no frame can do",
    "sdo_block_sequence_zero_ignored": "a server may wait for the segment that was meant",
    "time_never_produced": "no object says how often TIME comes",
}
"""Mutants that pass all cases, and why no case asks for what they break."""

EXAMPLES = (
    "nmt_reset_communication_resets_all", "sdo_block_checksum_unchecked", "rpdo_never_stored",
    "tpdo_reversed", "emcy_stays_after_heartbeat", "lss_any_serial_number", "time_stands_still",
)  # fmt: skip
CASES = json.loads(NOTICED.read_text())


def test_a_sound_device_passes() -> None:
    """The device of which the mutants are made passes all cases: none is skipped."""
    assert notice("").case == ""


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_mutant_is_noticed_where_it_is_broken(name: str) -> None:
    """Of the whole suite, the first case that fails is the one that is kept."""
    found = notice(name)
    assert not crashed(found), found.remark
    assert found.case == CASES[name]


@pytest.mark.full(sibling="test_a_mutant_is_noticed_where_it_is_broken")
@pytest.mark.parametrize("name", [name for name in MUTANTS if name not in UNNOTICED])
def test_a_mutant_is_noticed(name: str) -> None:
    """By the case that is kept for it, as a device that misbehaves and not one that breaks down.

    That case alone will do, but for faults that show in what earlier cases left behind.
    """
    found = notice(name, CASES[name])
    if not found.case:
        found = notice(name)
    assert not crashed(found), found.remark
    assert found.case == CASES[name]


def test_few_are_unnoticed() -> None:
    """At least 95 % are noticed; the others are known, with the reason."""
    assert {name for name, case in CASES.items() if not case} == set(UNNOTICED)
    assert CASES.keys() == MUTANTS.keys()
    assert len(UNNOTICED) <= (1 - SCORE) * len(MUTANTS)
