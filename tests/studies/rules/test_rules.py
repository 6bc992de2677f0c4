"""The table of rules against the product: it is complete, and each rule can be left out."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import hil_emulator.identify.selection
from tests.studies.rules.rules import DERIVED, EFFORT, LEVELS, RULES, changed, holder

ROOM = Path(hil_emulator.identify.selection.__file__).parent


def constants() -> Iterator[str]:
    """Yield every constant of the room, as `module.NAME`."""
    for file in sorted(ROOM.glob("*.py")):
        for node in ast.parse(file.read_text()).body:
            if isinstance(node, ast.Assign):
                names = [t.id for t in node.targets if isinstance(t, ast.Name)]
                yield from (f"{file.stem}.{name}" for name in names if name.isupper())


def test_every_constant_belongs_to_a_rule_or_decides_nothing() -> None:
    """A number that decides is never without a name for what it protects from."""
    listed = {*EFFORT, *LEVELS, *DERIVED}
    listed |= {name for rule in RULES.values() for name in rule.constants}
    left_out = {name for rule in RULES.values() for name in rule.without}
    existing = set(constants())
    assert listed <= existing <= listed | left_out


def test_ten_numbers_decide() -> None:
    """Whatever a rule asks, it asks with one of them."""
    deciding = set(constants()) - {*EFFORT, *DERIVED}
    assert len(deciding) <= 10, sorted(deciding)


def test_the_readme_states_the_worth_of_each_rule() -> None:
    """Its first table has one row per rule, in the order of the rules."""
    text = (Path(__file__).parent / "README.md").read_text()
    table = text.partition("## Each rule alone")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (.+?) \|(?:.*\|){3}$", table, re.M)
    assert rows == ["rule", *RULES]


@pytest.mark.parametrize("name", RULES)
def test_a_rule_is_left_out_for_a_while(name: str) -> None:
    """What leaves it out is something else than what the product has, and goes away again."""
    without = RULES[name].without
    before = {target: vars(holder(target)[0])[holder(target)[1]] for target in without}
    with changed(without):
        for target, value in without.items():
            owner, attribute = holder(target)
            assert vars(owner)[attribute] is value
            assert value != before[target]
    for target, value in before.items():
        owner, attribute = holder(target)
        assert vars(owner)[attribute] is value
