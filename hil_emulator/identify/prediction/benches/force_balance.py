"""Predictor of the load force from measured pressures and position, without a valve.

A friction rig or test machine moves the rod. The force is computed from the measured states, sample
by sample. A chamber that was not measured is at tank pressure. On a driven axis the measured force
is that of the drive, which moves the load against friction.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hil_emulator.identify.data_checks.plausible import hydraulic_force
from hil_emulator.identify.measured.experiment import Array, Experiment, Mask
from hil_emulator.identify.prediction.benches.boundary import with_values
from hil_emulator.identify.prediction.benches.kinematics import Motion, motion
from hil_emulator.identify.prediction.benches.presliding import (
    RETREAT,
    Path,
    directions,
    distance_of,
    reversals,
)
from hil_emulator.identify.prediction.free_terms.balances import CELL, PISTON, Balance
from hil_emulator.identify.prediction.free_terms.regressors import Regressors, regressors
from hil_emulator.identify.prediction.model_run.records import Moments, Places
from hil_emulator.identify.prediction.observer.predictor import FixedCovariance
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.prediction.residuals.correlation import (
    Correlogram,
    Noise,
    correlogram,
    shared,
)
from hil_emulator.model.constants import SLIDING_BEND
from hil_emulator.model.stages import SAMPLED, friction, inertia, load, stop

PRESLIDING = 1e-3
"""Presliding travel of seals after a reversal [m] (assumed)."""

PRESLIDING_OF_GUIDES = 5e-5
"""The same for the guides of a driven axis [m]: rolling elements slide after 10 to 50 um
(Armstrong-Helouvry et al. 1994). A longer distance would exclude short motions."""

SLID_AFTER = 4.0
"""Travel after a reversal, over the presliding distance, at which dry friction has reached 96 % of
its new value."""

ALL_BUT = 1.0 - 1e-9
"""Largest direction with a finite bristle deflection."""

VALVE = frozenset({"valve_current", "spool_position", "supply_flow", "tank_flow"})
CHAMBERS = frozenset({"pressure_a", "pressure_b"})
"""Signals of parts that a bench may not have."""

AT_ANY_SPEED = {"friction_transition_velocity": 1e9}
"""Makes the direction of friction independent of the velocity."""


@dataclass
class MeasuredStates:
    """One experiment as a series of measured states."""

    experiment: Experiment
    channels: tuple[str, ...]
    measured: Array
    states: Array
    acceleration: Array
    present: Mask
    weights: Array
    correlogram: Correlogram | None = None


class StaticObserver(FixedCovariance):
    """Computes the residual of the force balance, with the interface of `observer.Observer`.

    Args:
        model: the model.
        driven: whether the measured force is that of a drive instead of the rod's.
        chambers: whether a chamber has pressure.

    """

    measure = "N"
    balances: tuple[Balance, ...] = (PISTON, CELL)

    def __init__(self, model: PlantModel, driven: bool = False, chambers: bool = True) -> None:
        self.model = model
        self.driven = driven
        self.absent = VALVE if chambers else VALVE | CHAMBERS
        self.channels: tuple[str, ...] = ("load_force",)
        at = model.signal_names.index
        names = list(model.kernel.state.names or ())
        self._bends = [i for i, name in enumerate(names) if name.endswith("bend")]
        parameters = list(model.kernel.parameters.names or ())
        self._distance = parameters.index("friction_presliding_distance")
        self._places = Places(
            at("hydraulic_force"), at("friction_force"), at("stop_force"), at("load_force"),
            at("resisting_force"), at("rod_mass"),
            parameters.index("load_mass"),
            model.names.index("load_force"), driven,
        )  # fmt: skip
        self._motions: dict[int, tuple[Experiment, Motion]] = {}
        self.later: frozenset[str] = frozenset()

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without cached motions, whose keys are not valid in another process."""
        return self.__dict__ | {"_motions": {}}

    def presliding(self, experiments: Sequence[Experiment]) -> float:
        """Model presliding along the path if it is long; return its distance [m], or 0.

        The distance is estimated unless it is stated.

        Args:
            experiments: all training and validation data.

        """
        field = "friction_presliding_distance"
        distance = self.model.plant_values[field]
        if field not in self.model.config.stated:
            distance = distance_of([self._path(e) for e in experiments])
        if distance <= (PRESLIDING_OF_GUIDES if self.driven else PRESLIDING) / SLID_AFTER:
            return 0.0
        self.model = with_values(self.model, {field: distance, **AT_ANY_SPEED})
        self.later = frozenset({field})
        return distance

    def _path(self, e: Experiment) -> Path:
        """Return the motion of the rod, and the load force without that of the chambers."""
        rest = e.readings["load_force"] - hydraulic_force(e, self.model.plant_values)
        return Path(self._motion(e).states, rest)

    @property
    def correlation_time(self) -> float:
        """0: the correlation is estimated, see `noise_estimate`."""
        return 0.0

    def cost(self, par: Array) -> float:
        """Return 1: all predictions take the same time."""
        return 1.0

    def freeze(self, experiment: Experiment, par: Array, chan: Array) -> MeasuredStates:
        """Convert readings to states."""
        names = list(self.model.kernel.state.names or ())
        states = np.tile(self.model.start(par, 1e-5, None), (experiment.samples, 1))
        position, velocity, acceleration = self._motion(experiment).states.T
        tank = float(par[list(self.model.kernel.parameters.names or ()).index("tank_pressure")])
        for side in ("pressure_a", "pressure_b"):
            level = experiment.readings.get(side, np.full(experiment.samples, tank))
            states[:, names.index(side)] = level
        states[:, names.index("position")] = position
        states[:, names.index("velocity")] = velocity
        # only sliding samples are used
        states[:, names.index("seal_bend")] = SLIDING_BEND * np.sign(velocity)
        measured = experiment.matrix(self.channels)
        present = np.isfinite(states).all(axis=1) & np.isfinite(measured[:, 0])
        located = np.isfinite(experiment.readings["position"])
        present &= located
        if self.later:
            # the deflection at the start is unknown until the first reversal
            edges = reversals(position, velocity, RETREAT * par[self._distance])
            present[: edges[1] if len(edges) > 2 else 0] = False
        else:
            # within a gap of the position, reversals are unknown
            distance = PRESLIDING_OF_GUIDES if self.driven else PRESLIDING
            present[located] &= _sliding(position[located], velocity[located], distance)
        states[~present] = 0.0
        return MeasuredStates(
            experiment, self.channels, measured, states, acceleration, present, np.ones(1)
        )

    def _motion(self, experiment: Experiment) -> Motion:
        """Return the motion of the rod, cached since it does not depend on parameters."""
        if id(experiment) not in self._motions:
            smoothed = motion(experiment.readings["position"], experiment.period)
            self._motions[id(experiment)] = experiment, smoothed
        return self._motions[id(experiment)][1]

    def innovations(
        self, frozen: MeasuredStates, par: Array, chan: Array, track: bool = False
    ) -> tuple[Array, Array]:
        """Return the weighted residual of the load force, shape (samples, 1), and the signals.

        Without `track` the signals are not stored, which saves most of the time.
        """
        model = self.model
        path = np.zeros((len(frozen.states) if track else 0, len(model.signal_names)))
        states = self._bent(frozen, float(par[self._distance])) if self.later else frozen.states
        force = model.loops.forces(
            model.at(par, chan), Moments(states, frozen.acceleration, frozen.present),
            self._places, frozen.experiment.period, path,
        )  # fmt: skip
        residual = np.where(frozen.present, frozen.measured[:, 0] - force, 0.0)
        return residual[:, None] * frozen.weights, path

    def _bent(self, frozen: MeasuredStates, distance: float) -> Array:
        """Return the states with bristle deflections for a presliding distance [m]."""
        position, velocity, _ = self._motion(frozen.experiment).states.T
        states = frozen.states.copy()
        # the model's direction is the hyperbolic tangent of the deflection
        bends = np.arctanh(ALL_BUT * directions(position, velocity, distance))
        states[:, self._bends] = bends[:, None]
        return states

    def with_other_sensors(
        self, frozen: MeasuredStates, par: Array, chan: Array, others: Sequence[Array]
    ) -> Array:
        """Return the residuals with other sensors; there are no state corrections."""
        return np.stack([self.innovations(frozen, par, other)[0] for other in others])

    def weigh(self, frozen: MeasuredStates, par: Array, chan: Array) -> None:
        """Set the weights from the noise of this experiment, until `share` is called."""
        frozen.weights = np.ones(1)
        residual = self.innovations(frozen, par, chan)[0][:, 0]
        e = frozen.experiment
        frozen.correlogram = correlogram(residual, frozen.present, e.period, e.copies)
        self.share(frozen, shared([frozen.correlogram]))

    def noise_estimate(self, frozen: MeasuredStates) -> Correlogram | None:
        """Return an experiment's contribution to the common noise."""
        return frozen.correlogram

    def share(self, frozen: MeasuredStates, noise: Noise) -> None:
        """Set the weights for which the sum of squares counts independent values."""
        e = frozen.experiment
        frozen.weights = np.array([noise.weight(e.period, e.copies)])

    def regressors(self, frozen: MeasuredStates, path: Array) -> Regressors:
        """Return the regressors of free terms."""
        e = frozen.experiment
        return regressors(path, self.model.signal_names, e.period, absent=self.absent)

    def through(self, frozen: MeasuredStates, balance: Balance, terms: Array) -> Array:
        """Return the change of the residual by terms."""
        sign = 1.0 if balance is PISTON and not self.driven else -1.0
        return np.asarray(np.where(frozen.present, sign * terms.T, 0.0) * frozen.weights[0])


def _sliding(position: Array, velocity: Array, distance: float) -> Mask:
    """Return a mask of samples in gross sliding, the only ones at which friction has no memory.

    Args:
        position: along the path [m].
        velocity: there [m/s].
        distance: presliding distance [m].

    """
    edges = reversals(position, velocity, RETREAT * distance)
    run = np.clip(np.searchsorted(edges, np.arange(len(position)), "right") - 1, 0, len(edges) - 2)
    begin, end = position[edges[run]], position[edges[run + 1]]
    along = velocity * (end - begin) > 0.0
    begun = np.abs(position - begin) > distance
    return np.asarray(along & begun & (np.abs(position - end) > 0.5 * distance))


def examinable(candidate: Coordinate, predictor: StaticObserver) -> bool:
    """Return whether an effect without memory changes the force balance.

    The force of a drive depends on effects of the load, too; friction and mass of piston and load
    are then not separable.
    """
    effect = candidate.effect
    if effect is None or candidate.channel not in ("", "load_force"):
        return False
    if any(predictor.absent & set(law.arguments) for law in effect.laws):
        return False
    inside = all(
        law.stage in (stop, *SAMPLED) or law.stage.table == friction.table
        or (law.stage == load and "velocity" not in law.arguments if predictor.driven
            else law.stage == inertia)
        for law in effect.laws
    )  # fmt: skip
    return inside and (effect.stage in SAMPLED or not effect.states)
