"""Names of faults, targets and parameters: valid ones, and messages for the others."""

import math
import re
from pathlib import Path

import pytest

from hil_emulator.errors import UserError
from hil_emulator.faults.catalogue import KINDS
from hil_emulator.faults.declare import TEXT, FaultKind, FaultParam, Layer
from hil_emulator.faults.fault import fault, kinds_of, targets
from hil_emulator.faults.plant import plant_fault
from hil_emulator.model.declare import DeclarationError


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: f"{k.layer}-{k.name}")
def test_every_kind_has_defaults(kind: FaultKind) -> None:
    """Each kind has defaults for each of its targets, or requires a twin."""
    for target in kind.targets:
        name = {"message": "tpdo1", "object": "0x6130:1"}.get(target, target)
        other = {"pressure_b": "pressure_a"}.get(name, "pressure_b")
        options = {p.name: other for p in kind.params if p.default is None}
        assert fault(name, kind.name, **options).kind is kind


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: f"{k.layer}-{k.name}")
def test_every_kind_is_shown_on_the_bus(kind: FaultKind) -> None:
    """A test names it: this guards the tests of this folder, which see it on the bus."""
    text = "".join(
        file.read_text()
        for file in Path(__file__).parent.glob("test_*.py")
        if file.name != Path(__file__).name
    )
    anything = kind.targets[-1] in ("message", "object")
    names = r"[\w.:]+" if anything else "|".join(kind.targets)
    assert re.search(rf'"({names})",\s*"{kind.name}"', text)


def test_an_unknown_target_lists_what_there_is() -> None:
    """A misspelt channel is answered with the right one, and the list."""
    with pytest.raises(
        UserError, match=r"did you mean 'pressure_a'.*load_force.*coil.*tpdo4, 0x7130:1"
    ):
        fault("presure_a", "stuck")


def test_a_fault_that_a_target_cannot_have_lists_those_it_can() -> None:
    """A position has no twin to be swapped with, a supply no spool to stick."""
    with pytest.raises(
        UserError, match=r"position cannot have 'swapped'.*there are off, wire_break"
    ):
        fault("position", "swapped")
    with pytest.raises(UserError, match=r"supply cannot have 'stuck'.*there are loss, droop"):
        fault("supply", "stuck")


def test_a_value_of_another_dimension_shows_the_usual_one() -> None:
    """In the unit and the size in which people write it."""
    with pytest.raises(UserError, match='a pressure is wanted, such as "40 bar"'):
        fault("supply", "droop", drop="60 mm")
    with pytest.raises(UserError, match='a pressure is wanted, such as "'):
        fault("pressure_a", "offset", value="60 mm")


def test_an_unknown_parameter_lists_the_known_ones() -> None:
    """The kind's own parameters and those of every fault are named."""
    with pytest.raises(UserError, match=r"no parameter 'much'.*value, start, duration, ramp"):
        fault("pressure_a", "offset", much="3 bar")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"value": "3 mm"}, "is a length; a pressure is wanted"),
        ({"value": 3}, "has no unit"),
        ({"duration": "3 bar"}, "duration: .* a time is wanted"),
        ({"start": "-1 s"}, "not a time from now on"),
        ({"probability": 2}, "not between 0 and 1"),
        ({"condition": "position >> 3"}, "is not a comparison"),
        ({"condition": "position > 3 bar"}, "a length is wanted"),
        ({"condition": "posn > 3 mm"}, "no signal 'posn'"),
        ({"condition": "up and away"}, '"up" is not a comparison'),
        ({"condition": "position > 1 mm and " * 30 + "position > 1 mm"}, "longer than 500"),
        ({"value": "inf bar"}, r"inf bar is outside -2500 bar \.\.\. 2500 bar"),
        ({"value": "1e305 bar"}, "outside"),
        ({"value": [[[]]]}, "neither text nor a number"),
        ({"start": "1e305 s"}, "at most 1e.09 s"),
        ({"duration": "inf s"}, "at most 1e.09 s"),
        ({"probability": float("nan")}, "not between 0 and 1"),
        pytest.param({"probability": 10**5000}, "plain numbers", id="huge probability"),
        ({"seed": float("inf")}, "plain numbers"),
        ({"seed": -1}, "the seed is not between"),
        ({"self": 1}, "no parameter 'self'"),
    ],
)
def test_a_wrong_value_is_named_with_its_place(options: dict[str, object], message: str) -> None:
    """Units, ranges and conditions are checked before anything happens."""
    with pytest.raises(UserError, match=message):
        fault("pressure_a", "offset", **options)


def test_a_value_out_of_range_says_what_is_allowed() -> None:
    """A wrong length has at most 8 bytes."""
    with pytest.raises(UserError, match=r"length: 9 is outside 0 \.\.\. 8"):
        fault("tpdo1", "wrong_length", length=9)


def test_a_target_may_be_in_capitals() -> None:
    """It is the same one, with the same units."""
    chosen = fault("PRESSURE_A", "offset", value="3 bar")
    assert (chosen.target, chosen.values["value"]) == ("pressure_a", pytest.approx(3e5))


def test_a_parameter_is_read_in_its_unit() -> None:
    """Bar, millimetres and milliseconds become SI; a COB-ID may be hexadecimal."""
    assert fault("pressure_a", "offset", value="3 bar").values["value"] == pytest.approx(3e5)
    assert fault("position", "delay", time="30 ms").values["time"] == pytest.approx(0.03)
    assert fault("bus", "babbling", can_id="0x7F").values["can_id"] == 0x7F
    assert fault("supply", "loss", ramp="50 ms").ramp_ns == 50_000_000


def test_every_target_has_a_kind_and_every_layer_a_target() -> None:
    """Every layer has a target, and every target a kind."""
    reached = {kind.layer for target in targets() for kind in kinds_of(target).values()}
    assert reached == set(Layer)
    assert all(kinds_of(target) for target in targets())


def test_a_kind_takes_what_can_be_said_about_it() -> None:
    """A declaration whose function lacks a parameter is refused where it stands."""
    with pytest.raises(DeclarationError, match=r"'leak' takes .*given .*'conductance'"):

        @plant_fault("cylinder", "leakage", FaultParam("conductance", "1", "how much", 1.0))
        def leak() -> None:
            """Leak."""


@pytest.mark.parametrize(
    ("target", "kind", "message"),
    [
        (5, "stuck", "unknown target '5'"),
        (["a"], "stuck", "neither text nor a number"),
        ("pressure_a", None, "cannot have 'None'"),
        ("node5.pressure_a", "stuck", "a node has messages and objects only; write pressure_a"),
        ("node5.supply", "loss", "a node has messages and objects only; write supply"),
        ("node" + "9" * 5000, "silence", "unknown target"),
        ("x" * 60_000, "stuck", "unknown target"),
        ("supply", "x" * 60_000, "cannot have"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_a_target_that_is_none_is_one_short_message(
    target: object, kind: object, message: str
) -> None:
    """Whatever it is and however long, and the plant and its sensors belong to no single node."""
    with pytest.raises(UserError, match=message) as caught:
        fault(target, kind)  # type: ignore[arg-type]
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("param", [p for k in KINDS for p in k.params if p.unit != TEXT], ids=str)
def test_every_parameter_has_bounds(param: FaultParam) -> None:
    """No parameter may be infinite, which plant and frames would not survive."""
    assert math.isfinite(param.low)
    assert math.isfinite(param.high)
    assert param.default is not None
    assert param.low <= param.default <= param.high
