"""What counts as right: a wrong name is worse than a class, a class than a name."""

import lzma
from pathlib import Path

import pytest

from tests.studies.answer import Answer, Named, from_dict
from tests.studies.answer_file import append, rows
from tests.studies.generator.cases import Case, machine
from tests.studies.scoring import judge
from tests.studies.study import counts
from tests.studies.tables import changed, failed, report, share, wilson


def hidden(group: str, **effects: float) -> Case:
    """Return a case of a group."""
    return Case(f"{group}-00", effects, wide=False, dirty=False, duration=2.0)


LEAK = hidden("medium", internal_leakage=1e-13)


def test_wilson_interval_of_the_text_book() -> None:
    """Nine of ten: 0.596 to 0.982 (Wilson 1927)."""
    low, high = wilson(9, 10)
    assert low == pytest.approx(0.596, abs=1e-3)
    assert high == pytest.approx(0.982, abs=1e-3)


def test_a_name_is_right_alone() -> None:
    """The same name together with a second one is not."""
    named = Named("internal_leakage", value=1.05e-13, low=0.9e-13, high=1.2e-13)
    alone = judge(LEAK, Answer((named,)))
    assert alone.exact
    assert alone.errors == pytest.approx((0.05,))
    assert alone.covered == (True,)
    both = judge(LEAK, Answer((named, Named("null_bias"))))
    assert not both.exact
    assert (both.hits, both.wrong) == (1, 1)


def test_intervals_of_ordinary_parameters_are_held_against_the_machine() -> None:
    """One that holds the true mass counts, one that misses the gain of the valve does not."""
    mass, gain = machine(LEAK).mass, machine(LEAK).kv
    intervals = {"load_mass": (0.9 * mass, 1.1 * mass), "valve_gain": (1.1 * gain, 1.2 * gain)}
    answer = Answer((Named("internal_leakage"),), parameters=intervals)
    assert judge(LEAK, answer).ordinary == {"load_mass": True, "valve_gain": False}
    counted = share("right answers: ordinary parameter in its interval", 1, 2, "0.90 ... 0.99")
    assert counted in report([judge(LEAK, answer)])


def test_a_group_of_three_counts_if_the_separating_experiment_is_named() -> None:
    """Without that advice, or with four members, it does not; but it is no wrong name."""
    three = Named("null_bias", ("internal_leakage", "gravity"))
    four = Named("null_bias", ("internal_leakage", "gravity", "overlap"))
    assert judge(LEAK, Answer((three,), separates="steps of another size")).exact
    assert not judge(LEAK, Answer((three,))).exact
    large = judge(LEAK, Answer((four,), separates="steps of another size"))
    assert not large.exact
    assert not large.wrong


def test_one_class_does_not_answer_for_two_effects() -> None:
    """Two hidden effects need two names, each with one of them."""
    pair = hidden("pairs", internal_leakage=1e-13, gravity=60.0)
    leak, other = Named("internal_leakage"), Named("gravity")
    assert judge(pair, Answer((leak, other))).exact
    assert not judge(pair, Answer((leak, Named("internal_leakage", ("null_bias",))))).exact
    assert not judge(pair, Answer((leak,))).exact


def test_a_foreign_law_may_be_named_or_flagged_with_the_true_one_nearest() -> None:
    """A wrong name is hushed only if nothing in the answer is flagged."""
    law = hidden("foreign", internal_leakage=1e-13)
    assert judge(law, Answer((Named("internal_leakage"),))).known
    unknown = Answer(unknown=(("leakage from a to b", "time"),), nearest="internal_leakage")
    assert judge(law, unknown).known
    wrong = Answer((Named("gravity"),))
    assert judge(law, wrong).hushed
    flagged = judge(law, Answer((Named("gravity", form_differs=True),)))
    assert not flagged.known
    assert not flagged.hushed


def test_nothing_is_right_where_nothing_is_hidden() -> None:
    """A name and an unexplained term are both wrong there."""
    healthy = hidden("none")
    assert judge(healthy, Answer()).exact
    assert not judge(healthy, Answer((Named("gravity"),))).exact
    assert not judge(healthy, Answer(unknown=(("spool", "time"),))).exact


def test_an_outside_effect_must_be_found_where_it_sits() -> None:
    """The strongest term decides; without one, the place of the name that is flagged."""
    jam = hidden("outside", jam=60.0)
    there = judge(jam, Answer(unknown=(("force on the piston", "position"),)))
    assert there.flagged
    assert there.place
    assert not judge(jam, Answer(unknown=(("spool", "time"),))).place
    near = judge(jam, Answer((Named("position_friction", form_differs=True),)))
    assert near.place
    assert not near.hushed
    assert judge(jam, Answer((Named("position_friction"),))).hushed


def test_values_are_compared_with_the_catalogues_knob() -> None:
    """A pump's size is the reciprocal of the flow that the catalogue states."""
    small = hidden("medium", variable_pump=2e4)
    outcome = judge(small, Answer((Named("variable_pump", value=5e-5, low=4e-5, high=6e-5),)))
    assert outcome.errors == pytest.approx((0.0,), abs=1e-12)
    assert outcome.covered == (True,)


def test_answers_survive_a_file_and_appear_in_the_report() -> None:
    """A failure is printed with the hidden effects and the answer."""
    answer = Answer((Named("gravity", ("null_bias",)),), (("spool", "time"),), evidence=("a",))
    assert from_dict(answer.to_dict()) == answer
    outcome = judge(LEAK, answer)
    assert failed(outcome)
    text = report([outcome])
    assert "medium-00: hidden internal_leakage 1e-13" in text
    assert "named gravity" in text


def test_a_selection_names_groups_and_numbers() -> None:
    """An unknown group ends in a message."""
    assert counts("none:3,medium:5") == {"none": 3, "medium": 5}
    with pytest.raises(SystemExit, match="no such group: nine"):
        counts("nine:3")


def test_a_case_that_was_right_and_is_wrong_is_listed() -> None:
    """One that was right before and after is not."""
    right, wrong = Answer((Named("internal_leakage"),)), Answer((Named("null_bias"),))
    same, lost = (judge(LEAK, right), judge(LEAK, right)), (judge(LEAK, wrong), judge(LEAK, right))
    listed = changed([same, lost])
    assert listed.startswith("of 2 cases 0 are better and 1 worse")
    assert listed.count("worse: medium-00: hidden internal_leakage") == 1
    assert changed([same]) == "of 1 cases 0 are better and 0 worse than before"


def test_compressed_answers_are_those_that_were_kept(tmp_path: Path) -> None:
    """Row by row; a file that does not exist has no rows."""
    file = tmp_path / "study.jsonl"
    assert rows(file) == []
    for case in ("medium-00", "none-00"):
        append(file, {"case": case, "answer": Answer().to_dict()})
    compressed = tmp_path / "study.jsonl.xz"
    compressed.write_bytes(lzma.compress(file.read_bytes()))
    assert rows(compressed) == rows(file)
    assert [row["case"] for row in rows(compressed)] == ["medium-00", "none-00"]
