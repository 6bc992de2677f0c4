"""Headline of a result: the effect in words, the fall of the error, the rest."""

import re
from dataclasses import replace

import pytest

from hil_emulator.commands.gap_table import gap_lines
from hil_emulator.identify.conclusion.findings import Finding, Unexplained
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.reporting.headline import headline
from hil_emulator.model.effects import CATALOGUE

GROWTH = Finding(
    name="pressure_friction", knob="area", value=6.8412e-6, unit="m^2", shown="mm^2",
    interval=(5.9e-6, 7.7e-6), explained=0.93, delta_chi2=60.0, held_out=40.0, group=(),
    form_differs=False, rivals=(), words="the seals' friction grows with pressure",
)  # fmt: skip
HELD_OUT = {
    "before": 5.08, "before_rms": 5.08, "after": 0.686, "after_rms": 0.686, "least_squares": 0.7,
    "least_squares_rms": 0.7,
}  # fmt: skip
GAP = {"load_force": {"training": {"before": 4.2, "after": 0.6}, "validation": HELD_OUT}}
NOISE = "standard deviations of the noise"


def found(*effects: Finding) -> Result:
    """Return a result that names effects."""
    return Result("missing_effects", "", effects=list(effects), gap=GAP, measure="N")


def test_the_headline_has_the_effect_its_size_and_the_error() -> None:
    """The effect, its size with as many digits as it deserves, the error on other data."""
    assert headline(found(GROWTH)) == [
        "The seals' friction grows with pressure: 6.84 +- 0.9 mm^2.",
        "On logs not used for the fit, the error of the load force falls from 5.08 N to 0.686 N. "
        "Plain least squares reaches 0.7 N.",
    ]


def errors(before: float, after: float, floor: float, noise: float) -> dict[str, float]:
    """Return the errors of a channel in SI, one step ahead the same as in the free run."""
    values = {"before": before, "after": after, "floor": floor}
    return {
        f"{kind}{when}{suffix}": value / unit
        for kind in ("", "free_") for when, value in values.items()
        for suffix, unit in (("", noise), ("_rms", 1.0))
    }  # fmt: skip


def test_an_error_stands_in_the_unit_of_its_data_sheet() -> None:
    """Pressures in bar and positions in mm, each with its multiple of the channel's noise."""
    channels = {"pressure_b": errors(9.04e5, 0.326e5, 0.262e5, 1e4),
                "position": errors(12.2302e-3, 0.71e-3, 0.6e-3, 4e-6)}  # fmt: skip
    result = found(GROWTH)
    result.gap = {channel: {"training": values} for channel, values in channels.items()}
    result.measure = NOISE
    assert headline(result)[1] == (
        "Predicting 0.5 s ahead on the logs of the fit, the error of the pressure b falls from "
        "9.04 bar to 0.326 bar, 90.4 and 3.26 times its noise. "
        "A perfect model would reach 0.262 bar."
    )
    table = "\n".join(gap_lines(result))
    assert "in brackets: multiple of the channel's noise" in table
    assert re.search(r"pressure b \[bar\] +training .* 9\.04 \(90\.4\) ", table)
    assert re.search(r"position \[mm\] +training .* 12\.2 \(3060\) +0\.71 \(178\)", table)


def test_without_a_name_the_headline_has_the_channel_furthest_from_a_perfect_model() -> None:
    """A model that is 20 times its noise off is still right where a perfect one is as well."""
    result = Result("disagrees", "the spool", measure=NOISE)
    result.gap = {"position": {"training": errors(80e-6, 80e-6, 79e-6, 4e-6)},
                  "pressure_a": {"training": errors(3e4, 3e4, 1e4, 1e4)}}  # fmt: skip
    assert headline(result)[1].endswith(
        "the error of the pressure a is 0.3 bar, 3 times its noise. "
        "A perfect model would reach 0.1 bar."
    )


def test_the_headline_has_the_rest_and_the_rivals() -> None:
    """An unexplained rest, and effects that look alike, are in the headline, not in a footnote."""
    result = found(replace(GROWTH, group=("coulomb_friction",)))
    result.unknown = [
        Unexplained("force on the piston", "position", "N", (), (), "up to 1 N, bent", 90.0)
    ]
    sentences = headline(result)
    assert "No effect explains a part of the rest: on the force on the piston over position, " \
           "up to 1 N, bent." in sentences  # fmt: skip
    assert "These data do not distinguish pressure_friction from coulomb_friction." in sentences


def test_the_headline_has_implausible_parameters() -> None:
    """Implausible ordinary parameters next to a name are evidence of another effect."""
    result = found(GROWTH)
    result.implausible = ["load_mass is 1.8 times its configured value"]
    assert headline(result)[-1] == (
        "Implausible: load_mass is 1.8 times its configured value. "
        "Another effect is missing as well, or is the true one."
    )
    assert result.to_dict()["hardly_believed"] == result.implausible


@pytest.mark.parametrize(
    ("value", "interval", "size"),
    [(100.0, (90.0, 110.0), "100 +- 10 N"), (100.0, (10.0, 110.0), "100 N (10 N to 110 N)"),
     (0.0123, (0.0111, 0.0135), "0.0123 +- 0.0012 N"), (5.0, (5.0, 5.0), "5 +- 0 N")],
)  # fmt: skip
def test_a_size_has_the_digits_that_its_doubt_leaves(
    value: float, interval: tuple[float, float], size: str
) -> None:
    """Both ends are shown if the value does not lie in their middle."""
    assert replace(GROWTH, value=value, unit="N", shown="N", interval=interval).size == size


@pytest.mark.parametrize(("share", "words"), [(0.001, "less than 1 %"), (0.93, "93 %")])
def test_no_share_is_zero(share: float, words: str) -> None:
    """A named effect explains a part of the error."""
    assert replace(GROWTH, explained=share).share == words


def test_every_effect_of_the_catalogue_has_words() -> None:
    """A sentence without jargon, beginning small, without a full stop."""
    for effect in CATALOGUE:
        assert effect.words[:1].islower(), effect.name
        assert not effect.words.endswith("."), effect.name
        assert "_" not in effect.words, effect.name


def test_an_error_that_does_not_fall_stays() -> None:
    """A weak effect may leave every free run as it was to three digits."""
    result = found(GROWTH)
    result.gap = {"position": {"training": errors(80.01e-6, 80.0e-6, 79e-6, 4e-6)}}
    result.measure = NOISE
    assert "the error of the position stays at 0.08 mm, 20 times its noise." in headline(result)[1]
