"""Choice of the predictor for the measured channels, and of the effects that it can examine."""

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from hil_emulator.identify.data_checks import direction
from hil_emulator.identify.data_checks.consistency import DRIVEN, travel
from hil_emulator.identify.measured.experiment import FLOW, REFERENCE, Experiment
from hil_emulator.identify.prediction.benches import force_balance
from hil_emulator.identify.prediction.benches.flow_bench import FlowBench, flow_bench
from hil_emulator.identify.prediction.benches.flow_bench import examinable as flow_examinable
from hil_emulator.identify.prediction.benches.sweep_bench import (
    SweepBench,
    averaged,
    sweep_bench,
)
from hil_emulator.identify.prediction.benches.sweep_bench import examinable as at_rest
from hil_emulator.identify.prediction.benches.valve_bench import bench
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.nominal import of_forces
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.units import show

FORCES = {
    "force balance": ("position", "load_force", "pressure_a", "pressure_b"),
    "driven axis": ("position", "load_force"),
}  # fmt: skip
"""Required channels of a force bench, by kind."""

SLOW = ("quasi-static sweep", "valve leakage")
"""Kinds of bench with rows in equilibrium."""

SLOWEST = 5e-3
"""Longest sample period for a hydraulic mode of about 50 Hz [s]."""


def predicting(
    model: PlantModel, learn: list[Experiment], check: list[Experiment], contrary: str = ""
) -> tuple[Predictor | None, list[Experiment], list[Experiment], str]:
    """Choose the predictor by the measured channels.

    Args:
        model: of the actuator.
        learn: experiments for the fit.
        check: experiments for the acceptance test.
        contrary: contradiction in the data that prevents an examination, in words; or "".

    Returns:
        The predictor, or None; the experiments, converted for it; and the reason for None.

    """
    everything = [*learn, *check]
    declared = model.config.bench.kind
    names = tuple(
        c.name for c in CHANNELS
        if not c.differenced and all(c.name in e.readings for e in everything)
    )  # fmt: skip
    travels = [travel(e) for e in everything]
    if declared == "closed loop" and not all(len(e.current) for e in everything):
        lacking = next(e.name for e in everything if not len(e.current))
        return None, learn, check, f"{lacking} lacks {REFERENCE} or position: what commands it?"
    if declared in SLOW:
        rows = [averaged(e) for e in everything]
        swept, why = sweep_bench(model, rows)
        return swept, rows[: len(learn)], rows[len(learn) :], why
    metered_only = any(FLOW in e.readings for e in everything) and max(travels) < DRIVEN
    if declared == "valve flow" or metered_only:
        metered, why = flow_bench(model, everything)
        return metered, learn, check, why
    if max(travels) < DRIVEN:
        valve, why = bench(model, everything)
        still = "the rod hardly moves; move it by some millimetres" if max(travels) > 0.0 else (
            "no experiment shows a moving position"
        )  # fmt: skip
        why = f"{still}; {why}" if why else _slow(everything)
        return None if why else valve, learn, check, why
    if min(travels) < DRIVEN:
        return None, learn, check, "the rod hardly moves in some; move it by some millimetres"
    if contrary:
        return None, learn, check, contrary
    if declared in FORCES:
        return _balance(model, learn, check)
    if all(len(e.current) for e in everything):
        why = _slow(everything)
        return None if why else Observer(model, names), learn, check, why
    if "load_force" in names and {"pressure_a", "pressure_b"} & set(names):
        turned = direction.dissipative(everything, model.plant_values)
        return (
            force_balance.StaticObserver(model), turned[: len(learn)], turned[len(learn) :], ""
        )  # fmt: skip
    why = (
        f"with {', '.join(names)} alone no balance can be examined; add valve_current, or a "
        "chamber pressure and load_force"
    )
    return None, learn, check, why


def _balance(
    model: PlantModel, learn: list[Experiment], check: list[Experiment]
) -> tuple[Predictor | None, list[Experiment], list[Experiment], str]:
    """Return the predictor of a bench that is configured as a force bench."""
    kind = model.config.bench.kind
    for e in (*learn, *check):
        lacking = [name for name in FORCES[kind] if name not in e.readings]
        if lacking:
            return None, learn, check, _unknown(e, kind, lacking)
    driven = kind == "driven axis"
    stated = [model.config.bench.chambers.get(name, 0.0) for name in force_balance.CHAMBERS]
    chambers = not driven and not all(math.isnan(pressure) for pressure in stated)
    turned = direction.dissipative([*learn, *check], model.plant_values, driven)
    model = copy.copy(model)
    model.nominal = of_forces(turned)
    balance = force_balance.StaticObserver(model, driven, chambers)
    if distance := balance.presliding(turned):
        way = show(float(f"{distance:.2g}"), "m", "mm")
        late = f"friction: slides after a presliding_distance of {way}"
        turned[0] = replace(turned[0], notes=(*turned[0].notes, late))
    return balance, turned[: len(learn)], turned[len(learn) :], ""


def _unknown(e: Experiment, kind: str, lacking: Sequence[str]) -> str:
    """Return a message with the missing channels, and how to state a pressure instead."""
    why = f"{e.name} has no {' and no '.join(lacking)}, which a {kind} needs"
    pressures = [name for name in lacking if name.startswith("pressure")]
    if not pressures:
        return why
    entries = " and ".join(f'{name} = "absent" or "3 bar"' for name in pressures)
    return f"{why}; if it is not measured, set {entries} under [bench]"


def tolerances(predictor: Predictor) -> Mapping[str, float]:
    """Return the prior tolerances of stated values that differ on a bench, by field."""
    if isinstance(predictor, force_balance.StaticObserver):
        return parameters.CARRIAGE if predictor.driven else parameters.UNKNOWN_SEALS
    return {}


def _slow(experiments: Sequence[Experiment]) -> str:
    """Return why experiments are sampled too slowly, or ""."""
    slowest = max(e.period for e in experiments)
    if slowest <= SLOWEST:
        return ""
    return (
        f"sampled every {slowest * 1e3:.3g} ms: pressures move within that time; record at "
        f"{SLOWEST * 1e3:g} ms or faster"
    )


def examinable(model: PlantModel, predictor: Predictor) -> list[Coordinate]:
    """Return the effects that change the predictions."""
    sensors = tuple(c for c in predictor.channels if c in model.names)
    candidates = [c for c in parameters.candidates(model, sensors) if _described(c, model)]
    if isinstance(predictor, FlowBench):
        return [c for c in candidates if flow_examinable(c)]
    if isinstance(predictor, SweepBench):
        return [c for c in candidates if at_rest(c, predictor)]
    if isinstance(predictor, force_balance.StaticObserver):
        return [c for c in candidates if force_balance.examinable(c, predictor)]
    return candidates


def _described(candidate: Coordinate, model: PlantModel) -> bool:
    """Return whether the configuration states all arguments of an effect's laws."""
    laws = candidate.effect.laws if candidate.effect else ()
    names = {a for law in laws for a in law.arguments if isinstance(a, str)}
    return not any(math.isnan(model.plant_values.get(name, 0.0)) for name in names)
