"""The suite tells broken devices from sound ones, and the same way wherever the fault is."""

import pytest
from mutants import crashed, notice, notices
from mutations import MUTANTS

SCORE = 0.95
UNNOTICED = {
    "lss_stored_in_vain": "shows when the power is off and on again, which no frame can do",
    "sdo_block_sequence_zero_ignored": "a server may wait for the segment that was meant",
    "time_never_produced": "no object says how often TIME comes",
}
"""Mutants that pass all cases, and why no case asks for what they break."""

FIRST_NOTICED_BY = {
    "nmt_reset_communication_resets_all": "9.321",
    "sdo_block_checksum_unchecked": "2.309",
    "rpdo_never_stored": "3.303",
    "tpdo_reversed": "3.301",
    "emcy_history_oldest_first": "5.304",
    "lss_any_serial_number": "11.3",
    "time_stands_still": "12.5",
}


def test_a_sound_device_passes() -> None:
    """The device of which the mutants are made passes all cases: none is skipped."""
    assert notice("").case == ""


@pytest.mark.parametrize(("name", "case"), FIRST_NOTICED_BY.items())
def test_a_mutant_is_noticed_where_it_is_broken(name: str, case: str) -> None:
    """The first case that fails is one about the service that is broken."""
    found = notice(name)
    assert not crashed(found), found.remark
    assert found.case == case


@pytest.mark.slow
def test_mutants_are_noticed() -> None:
    """At least 95 % are; those that are not are known, with the reason."""
    found = notices(list(MUTANTS))
    assert [one.mutant for one in found if crashed(one)] == []
    unnoticed = {one.mutant for one in found if not one.case}
    assert unnoticed == set(UNNOTICED)
    assert len(unnoticed) <= (1 - SCORE) * len(MUTANTS)
