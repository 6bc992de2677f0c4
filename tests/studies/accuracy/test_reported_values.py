"""The tool that counts how far values are off: its medians, and what it holds against a machine."""

from hil_emulator.identify.conclusion.findings import Refitted
from hil_emulator.identify.conclusion.result import Result
from tests.studies.accuracy.reported_values import Reported, off, report, values
from tests.studies.generator.cases import case, machine


def test_medians_are_those_of_all_and_of_friction() -> None:
    """One law of friction and two other effects, one of which misses its interval."""
    effects = [
        Reported("stribeck_friction", True, 0.08, 0.02, 0.05, True, 0.5),
        Reported("gravity", False, 0.02, 0.01, 0.02, True, 0.5),
        Reported("load_spring", False, 0.04, 0.03, 0.02, False, 0.5),
    ]
    assert report(effects, [0.0, 3.0, -1.0, 1.0]) == [
        "friction: 1 effects, median error 8.00% fitted, 2.00% reported, "
        "half width 5.00%, 1 inside",
        "all: 3 effects, median error 4.00% fitted, 2.00% reported, half width 2.00%, 2 inside",
        "4 ordinary parameters: off by 1.66 deviations (root mean square), 75.0% inside",
    ]


def test_a_parameter_is_off_by_the_deviation_that_its_interval_has() -> None:
    """A mass that is reported 0.5 kg too large, with 95 % within 0.98 kg either way."""
    which = case("none", 60)
    mass = machine(which).mass
    result = Result("nothing_missing", "")
    result.parameters = {
        "load_mass": Refitted(50.0, mass + 0.5, mass - 0.48, mass + 1.48, "kg", "kg"),
        "end_stops": Refitted(1e8, 1e8, 1e7, 1e9, "N/m", "N/m"),
    }
    (deviations,) = off(which, result)
    assert abs(deviations - 1.0) < 1e-3
    assert list(values(which, result)) == []
