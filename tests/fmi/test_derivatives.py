"""Partial derivatives of the exported FMU: the linear model at a communication point."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from hil_emulator.config.load import load
from hil_emulator.model import quantities
from hil_emulator.model.equilibrium import Model
from hil_emulator.platform.paths import cache_folder, shipped
from hil_emulator.simulation.active_effects import acting
from hil_emulator.simulation.assembly import compiled
from tests.fmi.instance import Run

Matrix = NDArray[np.float64]

TICK = 1e-3
INPUTS = [q.name for q in quantities.INPUTS]


def built_in() -> Model:
    """Return the reference machine with the parameters of the exported FMU."""
    config = acting(load([shipped("configs/hyq_knee.toml")]))
    return Model(compiled(config.effects, cache_folder()), config.plant)


def states(run: Run) -> list[str]:
    """Return the names of the states that move."""
    rates = [name for name in run.references if name.startswith("der(")]
    derivatives = run.jacobian(rates, [name[4:-1] for name in rates] + INPUTS)
    moves = np.any(derivatives != 0.0, axis=1)
    return [name[4:-1] for name, moving in zip(rates, moves, strict=True) if moving]


def moving(run: Run) -> list[str]:
    """Let the rod move for 40 ms, and return the names of the states."""
    run.begin()
    run.set(valve_current=1.5e-3, external_force=200.0)
    for tick in range(40):
        run.fmu.doStep(tick * TICK, TICK)
    return states(run)


def test_it_is_the_linear_model_of_the_built_in_plant(run: Run) -> None:
    """A, B and C at the same point of a motion, to 1e-6 of each row's largest effect."""
    names = moving(run)
    model = built_in()
    for name in names:
        model.set(name.removeprefix("state."), run.get(name)[0])
    model.inputs[:2] = 1.5e-3, 200.0
    kept = [model.names.index(name.removeprefix("state.")) for name in names]
    rates = [f"der({name})" for name in names]
    outputs = [f"model.{q.name}" for q in quantities.SIGNALS]
    s, u = model.scales[kept], model.input_scales

    def agree(derivatives: Matrix, expected: Matrix) -> None:
        largest = np.abs(expected).max(axis=1, keepdims=True)
        assert np.all(np.abs(derivatives - expected) <= 1e-6 * largest)

    agree(
        run.jacobian(rates, names) * s / s[:, None],
        model.by_states(model.rates)[np.ix_(kept, kept)],
    )
    agree(run.jacobian(rates, INPUTS) * u / s[:, None], model.by_inputs(model.rates)[kept])
    agree(run.jacobian(outputs, names) * s, model.by_states(model.signals)[:, kept])
    assert not run.jacobian(outputs, INPUTS).any()
    assert not run.jacobian(["position", "load_force"], names).any()


def test_it_predicts_the_effect_of_an_input_in_the_next_step(run: Run) -> None:
    """States move by the integral of exp(A t) B du over the step, and the outputs by C times that.

    Two steps from one state are taken, under inputs that differ; nothing is linearised in them.
    """
    names = moving(run)
    model = built_in()
    scales = model.scales[[model.names.index(name.removeprefix("state.")) for name in names]]
    rates = [f"der({name})" for name in names]
    outputs = ["model.hydraulic_force", "model.flow_a", "model.position"]
    a, b = run.jacobian(rates, names), run.jacobian(rates, INPUTS)
    kept = (run.fmu.getFMUState if run.three else run.fmu.getFMUstate)()
    for i, (name, before, change) in enumerate(
        [("valve_current", 1.5e-3, 1e-6), ("external_force", 200.0, 1.0)]
    ):
        ends = []
        for value in (before - change, before + change):
            (run.fmu.setFMUState if run.three else run.fmu.setFMUstate)(kept)
            run.set(**{name: value})
            run.fmu.doStep(0.04, TICK)
            ends.append((np.array(run.get(*names)), np.array(run.get(*outputs))))
        whole = np.block([[a, b[:, [i]]], [np.zeros((1, len(names) + 1))]])
        foretold = expm(whole * TICK)[:-1, -1] * 2.0 * change
        moved = ends[1][0] - ends[0][0]
        assert moved / scales == pytest.approx(
            foretold / scales, abs=0.02 * np.abs(foretold / scales).max()
        )
        c = run.jacobian(outputs, names)
        assert ends[1][1] - ends[0][1] == pytest.approx(c @ moved, rel=1e-3)
    (run.fmu.freeFMUState if run.three else run.fmu.freeFMUstate)(kept)


def test_ahead_of_the_start_pressures_follow_from_the_supply(run: Run) -> None:
    """Unloaded and level, p_a = alpha p_s/(1 + alpha) and p_b = p_s/(1 + alpha)."""
    if not run.three:
        run.fmu.setupExperiment(startTime=0.0)
    run.fmu.enterInitializationMode()
    run.set(load__mass=0.0)
    (alpha,) = run.get("cylinder.area_ratio")
    slopes = run.jacobian(["model.pressure_a", "model.pressure_b"], ["supply.pressure"])
    assert slopes[:, 0] == pytest.approx([alpha / (1.0 + alpha), 1.0 / (1.0 + alpha)], rel=1e-6)
    run.fmu.exitInitializationMode()


def test_adjoint_derivatives_are_those_of_the_transposed_jacobian(run: Run) -> None:
    """By any two seeds v and w, w (J v) is (w J) v."""
    names = moving(run)
    if not run.three:
        pytest.skip("FMI 2.0 has no adjoint derivatives")
    unknowns = [run.references[f"der({name})"] for name in names]
    knowns = [run.references[name] for name in names + INPUTS]
    v, w = np.sin(np.arange(len(knowns))), np.cos(np.arange(len(unknowns)))
    forward = np.array(run.fmu.getDirectionalDerivative(unknowns, knowns, v))
    backward = np.array(run.fmu.getAdjointDerivative(unknowns, knowns, w, len(knowns)))
    assert w @ forward == pytest.approx(backward @ v, rel=1e-12)


def test_what_has_no_derivative_is_an_error_of_fmi(run: Run) -> None:
    """These are by an output, of an input, and by a parameter that is zero."""
    import fmpy

    run.begin()
    run.set(load__mass=0.0)
    for unknown, input_ in (
        ("model.position", "model.velocity"),
        ("valve_current", "state.position"),
        ("der(state.velocity)", "load.mass"),
    ):
        with pytest.raises(fmpy.fmi1.FMICallException):
            run.jacobian([unknown], [input_])
