"""Compiled loops of the predictor, with a cache on disk.

The loops take the functions of a model as first-class values, so that their machine code serves all
models. The cache stores a generated module with all their sources, since numba's own cache checks
only the age of one file and would miss an edit elsewhere.
"""

import hashlib
import inspect
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index, Single
from hil_emulator.identify.prediction.filter import (
    extended_kalman_filter,
    free_run,
    innovations,
    propagation,
    sample_jacobian,
    sensor_replay,
    smoothing,
    transition,
)
from hil_emulator.identify.prediction.model_run import (
    quasi_static,
    run,
    small_matrices,
    static_forces,
)
from hil_emulator.identify.prediction.model_run.records import (
    Data,
    Entries,
    Errors,
    Gains,
    Jacobians,
    Moments,
    ParametrisedModel,
    Places,
    Rate,
    Restarts,
    Sense,
    SensorInputs,
    Start,
    Sweep,
    Tuning,
    Unknowns,
)
from hil_emulator.identify.prediction.plant.function_values import RATE, SENSE, FunctionValue
from hil_emulator.identify.prediction.plant.ticks import Ticks
from hil_emulator.model.compiling import allocating, entry_point, inlined
from hil_emulator.model.constants import SLIDING_BEND
from hil_emulator.model.kernel import Kernel, keep, sources_digest

_MAKERS: tuple[Callable[..., object], ...] = (
    run.begin,
    run.second_run,
    run.install,
    run.enter,
    extended_kalman_filter.estimate_of,
    transition.slopes_of,
    free_run.show,
    free_run.widen,
    smoothing.observe,
    smoothing.proceed,
    smoothing.forward_pass,
    smoothing.backward_pass,
    quasi_static.implicit_step,
    quasi_static.pass_row,
)
"""Parts of loops that allocate arrays."""

_PARTS: tuple[Callable[..., object], ...] = (
    run.advance,
    run.follow,
    run.correct,
    run.compare,
    run.move,
    run.refine,
    run.begin_period,
    run.elapse_part,
    run.end_period,
    run.elapse,
    sample_jacobian.creeps,
    sample_jacobian.empties,
    sample_jacobian.move_on,
    small_matrices.copy,
    small_matrices.root_of_inverse,
    small_matrices.multiply,
    small_matrices.divide,
    small_matrices.duplicate,
    small_matrices.congruence,
    small_matrices.multiply_eights,
    innovations.predict_samples,
    innovations.pick,
    extended_kalman_filter.update,
    transition.differentiate,
    transition.approximate,
    transition.map_part,
    transition.carry_on,
    sample_jacobian.elapse_linearly,
    sample_jacobian.note,
    sample_jacobian.read_widely,
    extended_kalman_filter.set_secant,
    extended_kalman_filter.measure,
    extended_kalman_filter.spread,
    extended_kalman_filter.filter_samples,
    propagation.propagate_samples,
)
"""Parts of loops that work on given arrays."""

_LOOPS: tuple[Callable[..., object], ...] = (
    innovations.predict, extended_kalman_filter.linearise, propagation.propagate,
    sensor_replay.reread, static_forces.forces, free_run.run_freely, free_run.carry,
    smoothing.smooth, quasi_static.sweep,
)  # fmt: skip

_RECORDS = (
    run.Run, run.Instruments, run.Passage, transition.Slopes, extended_kalman_filter.Estimate,
    propagation.Changes, Gains, Jacobians, Entries, Errors, SensorInputs, smoothing.Driven,
    smoothing.ForwardPass,
)  # fmt: skip
"""Named tuples that the loops create."""


@dataclass(frozen=True)
class Loops:
    """Compiled loops, and the functions of one model for them.

    Attributes:
        predict: see `innovations.predict`.
        linearise: see `extended_kalman_filter.linearise`.
        propagate: see `propagation.propagate`.
        reread: see `sensor_replay.reread`.
        forces: see `static_forces.forces`.
        run_freely: see `free_run.run_freely`.
        carry: see `free_run.carry`.
        smooth: see `smoothing.smooth`.
        sweep: see `quasi_static.sweep`.
        ticks: integrations of the model for sets of effects.
        rate: derivative of its state.
        sense: its sensor chain.

    """

    predict: Callable[[ParametrisedModel, Data, Start, Gains, Array, Array, SensorInputs], None]
    linearise: Callable[
        [ParametrisedModel, Data, Start, Tuning, Array, Gains, Array, Index], Jacobians
    ]
    propagate: Callable[[Gains, Jacobians, Entries, Array, Array, Single], None]
    reread: Callable[[ParametrisedModel, Data, SensorInputs, Array], None]
    forces: Callable[[ParametrisedModel, Moments, Places, float, Array], Array]
    run_freely: Callable[[ParametrisedModel, Data, Start, Gains, Restarts], Errors]
    carry: Callable[[Gains, Jacobians, Array, Array, Array, Restarts, Array, Array], None]
    smooth: Callable[[Gains, Jacobians, Entries, Array, Array, float, float, Array], None]
    sweep: Callable[[ParametrisedModel, Sweep, Array, Unknowns, Index], tuple[Array, Array]]
    ticks: Ticks
    rate: Rate
    sense: Sense


@lru_cache(maxsize=4)
def bind(kernel: Kernel, cache: Path | None) -> Loops:
    """Return the loops with the functions of a model.

    Args:
        kernel: the compiled model.
        cache: folder for machine code; None compiles for this process only.

    """
    rate, sense = FunctionValue(kernel.rate, RATE), FunctionValue(kernel.sense, SENSE)
    return Loops(**_compiled(cache), ticks=Ticks(kernel, cache), rate=rate, sense=sense)


@lru_cache(maxsize=4)
def _compiled(cache: Path | None) -> dict[str, Any]:
    """Return the loops by name."""
    chapters = (("compiled", _PARTS), ("allocating", _MAKERS), ("entry_point", _LOOPS))
    parts = [f"@{name}\n{inspect.getsource(f)}" for name, functions in chapters for f in functions]
    source = "\n\n".join(["from __future__ import annotations\n", *parts])
    folder = cache and cache / _digest(sources_digest(()))
    file = keep(source, folder, "hil_emulator_identify") if folder else None
    # numba finds the functions again through a module of this name
    module = ModuleType(file.stem if file else "hil_emulator_identify")
    sys.modules[module.__name__] = module
    module.__dict__.update({record.__name__: record for record in _RECORDS})
    module.__dict__.update(
        np=np, INPUT_COUNT=run.INPUT_COUNT, SLIDING_BEND=SLIDING_BEND, SLID=sample_jacobian.SLID,
        CREEPING=sample_jacobian.CREEPING, NEARLY_EMPTY=sample_jacobian.NEARLY_EMPTY,
        SMALLEST=propagation.SMALLEST, FINEST=quasi_static.FINEST,
        compiled=inlined(nogil=True),
        allocating=allocating(nogil=True),
        entry_point=entry_point(file, rolled=True, nogil=True, _nrt=True),
    )  # fmt: skip
    exec(compile(source, str(file or "<identify>"), "exec"), module.__dict__)
    return {loop.__name__: getattr(module, loop.__name__) for loop in _LOOPS}


def digest(kernel: Kernel) -> str:
    """Return a digest of the model and of the sources of the loops."""
    return _digest(sources_digest(kernel.effects) + kernel.source)


def _digest(model: str) -> str:
    """Return a digest of a text and of the sources of the loops."""
    hasher = hashlib.sha256(model.encode())
    folder = Path(__file__).parents[1]
    for file in sorted(folder.rglob("*.py")):
        hasher.update(str(file.relative_to(folder)).encode() + file.read_bytes())
    return hasher.hexdigest()[:16]
