"""The suite detects mutants of the device."""

import json

import pytest
from mutants import NOTICED, crashed, notice
from mutations import MUTANTS

SCORE = 0.95
UNNOTICED = {
    "lss_never_identified": "the service is optional, and an EDS does not state it",
    "lss_stored_in_vain": "visible only after a power cycle, which no frame can cause",
    "sdo_block_sequence_zero_ignored": "a server may wait for the correct segment",
    "time_never_produced": "no object has the period of TIME",
}
"""Mutants that pass all cases, with the reason why no case detects them."""

EXAMPLES = (
    "nmt_reset_communication_resets_all", "sdo_block_checksum_unchecked", "rpdo_never_stored",
    "tpdo_reversed", "emcy_stays_after_heartbeat", "lss_any_serial_number", "time_stands_still",
)  # fmt: skip
CASES = json.loads(NOTICED.read_text())


def test_a_correct_device_passes() -> None:
    """The device without a mutation passes all cases, without a skip."""
    assert notice("").case == ""


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_first_failing_case_of_a_mutant_is_the_stored_one(name: str) -> None:
    """The first failing case of the whole suite is the stored case."""
    result = notice(name)
    assert not crashed(result), result.remark
    assert result.case == CASES[name]


@pytest.mark.full(sibling="test_the_first_failing_case_of_a_mutant_is_the_stored_one")
@pytest.mark.parametrize("name", [name for name in MUTANTS if name not in UNNOTICED])
def test_a_mutant_is_detected(name: str) -> None:
    """A mutant is detected by its stored case, without a crash.

    The stored case alone is sufficient, except for faults that depend on earlier cases.
    """
    result = notice(name, CASES[name])
    if not result.case:
        result = notice(name)
    assert not crashed(result), result.remark
    assert result.case == CASES[name]


def test_few_mutants_are_undetected() -> None:
    """At least 95 % are detected; the others are listed with the reason."""
    assert {name for name, case in CASES.items() if not case} == set(UNNOTICED)
    assert CASES.keys() == MUTANTS.keys()
    assert len(UNNOTICED) <= (1 - SCORE) * len(MUTANTS)
