"""The configuration of a machine as TOML, with the origin of every number as a comment."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from hil_emulator.machines import sizing
from hil_emulator.machines.questions import (
    FIXED,
    IDEAL,
    QUESTIONS,
    Answers,
    Inquiry,
    number,
    valve,
)
from hil_emulator.machines.valve_sheet import GIVEN, PRINTED, ValveSheet
from hil_emulator.model.constants import DISCHARGE, S1
from hil_emulator.model.declare import SETTING
from hil_emulator.model.effects.edges import land_leakage
from hil_emulator.model.quantities import PARAMS
from hil_emulator.model.rating import at_rated_current
from hil_emulator.units import show

BULK_MODULUS = 1.3e9
"""Effective modulus of mineral oil with hoses and cylinder walls [Pa] (S1 3.1.1: measured)."""

SLOT = 0.25e-3
"""Height of an edge's slot at the rated current [m] (assumed)."""


_CONVERGED = 60
"""Steps of a fixed-point iteration whose error decreases by a factor of 3 or more per step."""

TOLERANCES = {"assumed": "50 %", "from memory": "20 %"}
"""Tolerance of a number for `identify`, by a word in its origin (assumed)."""


@dataclass(frozen=True)
class Assignment:
    """One line of a table: `key = value  # reason`."""

    key: str
    value: str
    why: str = ""

    def __str__(self) -> str:
        """Return the line."""
        text = f"{self.key} = {self.value}"
        return f"{text:<35} # {self.why}" if self.why else text


Table = tuple[str, str, Sequence[Assignment]]
"""Name of a table, comment above it, and its lines."""


def configuration(answers: Answers, eds: str, schema: str, step: float) -> str:
    """Return the text of a configuration.

    Args:
        answers: of the user.
        eds: path of the node's EDS from the file.
        schema: path of the JSON Schema from the file.
        step: integration step [s].

    """
    head = (
        f"#:schema ./{schema}",
        f"# {answers['name']}",
        "# Written by `hil-emulator init`. Measure assumed values, and look up those from memory.",
        "# `identify` fits both within the tolerance that is written with them.",
        "# docs/how_to/machine.md lists the numbers that matter most.",
        f"# {S1}",
    )
    tables = [_table(*table) for table in _tables(answers, eds, step)]
    return "\n".join([*head, "", "\n\n".join(tables), ""])


def _table(name: str, comment: str, entries: Sequence[Assignment]) -> str:
    title = name if name.startswith("[") else f"[{name}]"
    lines = (str(_with_tolerance(name, entry)) for entry in entries)
    return "\n".join([*([f"# {comment}"] if comment else []), title, *lines])


def _with_tolerance(table: str, entry: Assignment) -> Assignment:
    """Return a line with the tolerance of its number, unless the user or the sheet states it."""
    settings = {p.name for p in PARAMS.get(table, ()) if p.spread is SETTING}
    wide = next((size for word, size in TOLERANCES.items() if word in entry.why), "")
    if not wide or table not in PARAMS or entry.key in settings:
        return entry
    return replace(entry, value=f'{{ value = {entry.value}, tolerance = "{wide}" }}')


def _tables(answers: Answers, eds: str, step: float) -> Iterator[Table]:
    yield (
        "rig",
        "",
        [
            Assignment("tick", '"1 ms"', "period of the loop and of the sensors"),
            Assignment(
                "step", f'"{step * 1e6:.6g} us"', "integration step; `check` tests its length"
            ),
            Assignment("seed", "1"),
        ],
    )
    yield (
        "[[node]]",
        "",
        [
            Assignment("id", f"{number(answers, 'node_id'):.0f}"),
            Assignment("eds", f'"{eds}"'),
            Assignment("safe_current", '"0 mA"', "valve centred when the set points stop"),
        ],
    )
    yield "supply", "", list(_supply(answers))
    yield "tank", "", [_asked(answers, "tank_pressure", "pressure")]
    yield "valve", f"{valve(answers).title}: {valve(answers).sheet}", list(_valve(answers))
    if kept := valve(answers).get("compensator"):
        why = f"of the valve: {valve(answers).origins['compensator']}"
        yield "lines", "", [Assignment("pressure_compensator", _shown(kept, "Pa", "bar"), why)]
    yield "oil", "ISO VG 46 mineral oil", [
        Assignment("bulk_modulus", _shown(BULK_MODULUS, "Pa", "MPa"),
              "assumed: effective value measured on HyQ (S1 3.1.1)"),
        Assignment("entrained_air", '"0.1 %"', "assumed: little, the modulus has its share in it"),
    ]  # fmt: skip
    yield "cylinder", "", list(_cylinder(answers))
    yield (
        "friction",
        "",
        [
            _typical("viscous_friction", sizing.viscous_friction(answers), "N*s/m"),
            _typical("coulomb_friction", sizing.coulomb_friction(answers), "N"),
        ],
    )
    yield "load", "", list(_load(answers))
    yield (
        "initial",
        "",
        [Assignment("position", _shown(0.5 * number(answers, "stroke"), "m", "mm"), "mid-stroke")],
    )
    yield from _sensors(answers)


def _supply(answers: Answers) -> Iterator[Assignment]:
    sheet = valve(answers)
    yield _asked(answers, "supply_pressure", "pressure")
    if pilot := sheet.get("pilot_leakage"):
        conductance = pilot / sheet.get("leakage_pressure")
        text = _shown(conductance, "m^3/(s*Pa)", "cm^3/(min*bar)")
        yield Assignment("pilot_leakage", text, f"of the valve: {_leak(sheet, 'pilot_leakage')}")
    if answers["pump"] == IDEAL:
        return
    kind = "fixed_pump" if answers["pump"] == FIXED else "variable_pump"
    yield _asked(answers, "pump_flow", kind)
    if "precharge" in answers:
        volume, precharge = (_answer(answers, name) for name in ("accumulator", "precharge"))
        yield Assignment(
            "accumulator",
            f"{{ gas_volume = {volume}, precharge = {precharge} }}",
            _given(answers, "accumulator", "precharge"),
        )


def _valve(answers: Answers) -> Iterator[Assignment]:
    sheet = valve(answers)
    for name in ("nominal_flow", "rated_current", sheet.drop):
        yield Assignment(name, _printed(sheet, name), sheet.origins[name])
    hertz, why = sheet.natural_frequency
    yield Assignment("natural_frequency", _shown(hertz, "Hz"), why)
    ratio, why = sheet.damping_ratio
    yield Assignment("damping_ratio", f"{ratio:.2g}", why)
    width = sizing.laminar_width(answers)
    yield _typical("laminar_width", width, "Pa", "bar")
    slot = SLOT / sheet.full_opening
    yield Assignment("slot_per_ampere", _shown(slot, "m/A"), "0.25 mm open, assumed")
    rated = sheet.get("rated_current")
    yield Assignment("current_saturation", _shown(rated, "A", "mA"), "the driver gives no more")
    if step := sheet.get("step_time"):
        why = f"0 to 100 % in {show(step, 's', 'ms')}: {sheet.origins['step_time']}"
        yield Assignment("spool_rate_limit", _shown(rated / step, "A/s"), why)
    yield from _null(sheet)


def _null(sheet: ValveSheet) -> Iterator[Assignment]:
    """Yield the lines of a valve's behaviour at null, and of edges that differ."""
    for name in ("overlap", "hysteresis", "threshold"):
        if part := sheet.get(name):
            why = f"of the rated current: {sheet.origins[name]}"
            yield Assignment(name, _shown(part, "1", "%"), why)
    if (share := sheet.get("port_b_flow", 1.0)) != 1.0:
        for edge in ("sb", "bt"):
            why = f"flow at port b: {sheet.origins['port_b_flow']}"
            yield Assignment(f"gain_{edge}", _shown(share - 1.0, "1", "%"), why)
            if lap := sheet.get("overlap") * (1.0 - 1.0 / share):
                yield Assignment(f"lap_{edge}", _shown(lap, "1", "%"), "opens where the others do")
    opening = clearance(sheet)
    if opening > 0.0:
        leak = _leak(sheet, "null_leakage")
        yield Assignment("land_leakage", _shown(opening, "A", "uA"), leak)


def clearance(sheet: ValveSheet) -> float:
    """Return the clearance of the lands for the leakage at null [A].

    Two parallel paths, each with half the pressure at an edge, carry half of the leakage without
    the pilot stage: q = K_v u sqrt(p/2) (1 + (Re_c/Re)⁴)^-¼, with Re of turbulent flow. This is
    solved for the turbulent q; K_v sqrt(p/2) is the nominal flow over the full opening at that
    pressure. With an overlap z a clearance c is equivalent to an opening u = c sqrt(c/(c + 2 z))
    (`land_leakage`).
    """
    leak = 0.5 * (sheet.get("null_leakage") - sheet.get("pilot_leakage"))
    half, rated = 0.5 * sheet.get("leakage_pressure"), sheet.get("rated_current")
    lap = sheet.get("overlap") * rated
    if leak <= 0.0 or half <= 0.0:
        return 0.0
    usual = {p.name: p.default or 0.0 for table in ("valve", "oil") for p in PARAMS[table]}
    speed = DISCHARGE * math.sqrt(2.0 * half / usual["density"])
    reynolds = 2.0 * SLOT * speed / usual["kinematic_viscosity"]
    # turbulent flow at the critical Reynolds number
    critical = sheet.flow(half) * usual["critical_reynolds_number"] / reynolds
    fourth = 0.5 * (leak**4 + leak**2 * math.sqrt(leak**4 + 4.0 * critical**4))
    turbulent = math.sqrt(math.sqrt(fourth))
    opening = turbulent / sheet.flow(half) * sheet.full_opening
    worth = opening
    for _ in range(_CONVERGED):
        worth = math.cbrt(opening**2 * (worth + 2.0 * lap))
    return min(at_rated_current(land_leakage.knob, rated).high, worth)


def _leak(sheet: ValveSheet, name: str) -> str:
    flow, pressure = (_printed(sheet, key).strip('"') for key in (name, "leakage_pressure"))
    return f"{flow} at {pressure}: {sheet.origins[name]}"


def _cylinder(answers: Answers) -> Iterator[Assignment]:
    for name in ("bore", "rod", "stroke"):
        yield _asked(answers, name, name)
    yield _typical("dead_volume_a", sizing.dead_volume(answers, 1.0), "m^3", "ml")
    annulus = sizing.dead_volume(answers, sizing.area_ratio(answers))
    yield Assignment(
        "dead_volume_b", _shown(annulus.value, "m^3", "ml"), "assumed: the same for the annulus"
    )
    yield _typical("end_stops", sizing.end_stop_stiffness(answers), "N/m")
    yield _typical("internal_leakage", sizing.leakage(answers), "m^3/(s*Pa)", "cm^3/(min*bar)")
    yield _typical("rod_mass", sizing.rod_mass(answers), "kg")


def _load(answers: Answers) -> Iterator[Assignment]:
    yield _asked(answers, "mass", "mass")
    if "slope" in answers:
        yield _asked(answers, "slope", "slope")
    elif number(answers, "weight"):
        yield _asked(answers, "weight", "gravity")


def _sensors(answers: Answers) -> Iterator[Table]:
    pressure, force = sizing.pressure_range(answers).value, sizing.force_range(answers).value
    stroke = number(answers, "stroke")
    for name in ("pressure_a", "pressure_b", "supply_pressure"):
        yield _sensor(name, (-0.01 * pressure, 1.03 * pressure), pressure, ("Pa", "bar"),
                      f"0 to {show(pressure, 'Pa', 'bar')}, 16 bits")  # fmt: skip
    yield _sensor("position", (-0.05 * stroke, 1.05 * stroke), stroke, ("m", "mm"), "16 bits")
    yield _sensor("load_force", (-force, force), 2.0 * force, ("N", "N"),
                  f"±{show(force, 'N', 'kN')}, 16 bits")  # fmt: skip


def _sensor(
    name: str, ends: tuple[float, float], span: float, units: tuple[str, str], what: str
) -> Table:
    lower, upper = (_shown(end, *units) for end in ends)
    lines = [
        Assignment("noise", _shown(4e-4 * span, *units), "assumed: 0.04 % of the span"),
        Assignment("resolution", _shown(span / 2**16, *units)),
        Assignment("measuring_range", f"{{ lower = {lower}, upper = {upper} }}"),
    ]
    return f"sensors.{name}", what, lines if name != "position" else lines[1:]


def _question(name: str) -> Inquiry:
    return next(q for q in QUESTIONS if q.name == name)


def _answer(answers: Answers, name: str) -> str:
    return f'"{_question(name).written(answers[name])}"'


def _asked(answers: Answers, name: str, key: str) -> Assignment:
    """Return the line of an answer."""
    return Assignment(key, _answer(answers, name), _given(answers, name))


def _given(answers: Answers, *names: str) -> str:
    """Return the names of the answers given by the user."""
    stated = [name for name in names if name in answers.given]
    if len(stated) == len(names):
        return GIVEN
    return f"{', '.join(stated)} {GIVEN}, else default" if stated else "default"


def _printed(sheet: ValveSheet, name: str) -> str:
    param = PRINTED[name]
    return f'"{show(sheet.get(name), param.unit, param.shown)}"'


def _typical(key: str, typical: sizing.Typical, unit: str, shown: str = "") -> Assignment:
    return Assignment(key, _shown(typical.value, unit, shown), typical.reason)


def _shown(value: float, unit: str, shown: str = "") -> str:
    """Return a computed value with three digits."""
    return f'"{show(float(f"{value:.3g}"), unit, shown)}"'
