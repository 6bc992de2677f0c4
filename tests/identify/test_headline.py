"""What a workshop reads first: the effect in words, how far the error fell, what remains."""

from dataclasses import replace

import pytest

from hil_emulator.identify.conclusion.findings import Finding, Unexplained
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.reporting.headline import headline
from hil_emulator.model.effects import CATALOGUE

GROWTH = Finding(
    name="pressure_friction", knob="area", value=6.8412e-6, unit="m^2", shown="mm^2",
    interval=(5.9e-6, 7.7e-6), explained=0.93, delta_chi2=60.0, held_out=40.0, group=(),
    form_differs=False, rivals=(), words="the seals' friction grows with pressure",
)  # fmt: skip
HELD_OUT = {"before": 5.08, "after": 0.686, "least_squares": 0.7}
GAP = {"load_force": {"training": {"before": 4.2, "after": 0.6}, "validation": HELD_OUT}}


def found(*effects: Finding) -> Result:
    """Return a result that names effects."""
    return Result("missing_effects", "", effects=list(effects), gap=GAP, measure="N")


def test_it_says_what_the_machine_does_and_how_well_that_holds() -> None:
    """The effect, its size with as many digits as it deserves, the error on other data."""
    assert headline(found(GROWTH)) == [
        "The seals' friction grows with pressure: 6.84 +- 0.9 mm^2.",
        "On logs not used for the fit, the error of the load force falls from 5.08 N to 0.686 N. "
        "Plain least squares reaches 0.7.",
    ]


def test_it_says_what_remains_and_what_is_in_doubt() -> None:
    """An unexplained rest, and effects that look alike, are in the headline, not in a footnote."""
    result = found(replace(GROWTH, group=("coulomb_friction",)))
    result.unknown = [
        Unexplained("force on the piston", "position", "N", (), (), "up to 1 N, bent", 90.0)
    ]
    sentences = headline(result)
    assert "No effect explains a part of the rest: on the force on the piston over position, " \
           "up to 1 N, bent." in sentences  # fmt: skip
    assert "These data do not distinguish pressure_friction from coulomb_friction." in sentences


def test_it_says_what_hardly_any_machine_has() -> None:
    """Ordinary parameters that have to be far off beside a name speak for something else."""
    result = found(GROWTH)
    result.hardly_believed = ["load_mass is 1.8 times its configured value"]
    assert headline(result)[-1] == (
        "Implausible: load_mass is 1.8 times its configured value. "
        "Another effect is missing as well, or is the true one."
    )
    assert result.to_dict()["hardly_believed"] == result.hardly_believed


@pytest.mark.parametrize(
    ("value", "interval", "size"),
    [(100.0, (90.0, 110.0), "100 +- 10 N"), (100.0, (10.0, 110.0), "100 N (10 N to 110 N)"),
     (0.0123, (0.0111, 0.0135), "0.0123 +- 0.0012 N"), (5.0, (5.0, 5.0), "5 +- 0 N")],
)  # fmt: skip
def test_a_size_has_the_digits_that_its_doubt_leaves(
    value: float, interval: tuple[float, float], size: str
) -> None:
    """Both ends are told where the value does not lie in their middle."""
    assert replace(GROWTH, value=value, unit="N", shown="N", interval=interval).size == size


@pytest.mark.parametrize(("share", "words"), [(0.001, "less than 1 %"), (0.93, "93 %")])
def test_no_share_is_none(share: float, words: str) -> None:
    """What was named takes something."""
    assert replace(GROWTH, explained=share).share == words


def test_every_effect_of_the_catalogue_has_words() -> None:
    """A sentence without jargon, beginning small, without a full stop."""
    for effect in CATALOGUE:
        assert effect.words[:1].islower(), effect.name
        assert not effect.words.endswith("."), effect.name
        assert "_" not in effect.words, effect.name
