"""A configured actuator: simulation, linearisation, changes."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hil_emulator.api.tables import recorded
from hil_emulator.config.load import Configuration, built_in, load_texts, whole
from hil_emulator.config.load import load as load_one
from hil_emulator.config.machine import has_actuators, load_machine
from hil_emulator.errors import UserError, brief, did_you_mean
from hil_emulator.model.actuator import INPUTS
from hil_emulator.model.declare import Effect, Param, is_on
from hil_emulator.model.plant import Matrix
from hil_emulator.model.sensors import CHANNELS, Channel
from hil_emulator.platform.packaged import CONFIGURATIONS, Purpose, found, packaged
from hil_emulator.signals.columns import columns
from hil_emulator.units import show, to_si

if TYPE_CHECKING:
    import pandas

    from hil_emulator.api.linear_model import LinearModel

Quantity = str | float
"""A number with its unit, such as "3 mA", or a number in SI."""

Course = Quantity | ArrayLike | Callable[[float], float]
"""Course of an input: a constant quantity, a value for each tick (SI), or a function of the time
[s] (SI)."""

SPAN = "span"
"""Unit of a sensor effect's parameter: its channel's."""

_UNITS = {q.name: q.unit for q in INPUTS}


@dataclass(frozen=True)
class ActuatorModel:
    """A configured actuator; its methods return changed copies.

    Attributes:
        name: for reports.
        config: its checked configuration, SI.

    """

    name: str
    config: Configuration

    def simulate(
        self, current: Course = 0.0, duration: Quantity | None = None, **inputs: Course
    ) -> "pandas.DataFrame":
        """Return the signals and readings of a simulation without a bus.

        Args:
            current: of the valve [A].
            duration: of the simulation [s]; by default that of an array.
            inputs: further inputs of the plant, such as `external_force`.

        Returns:
            A row for each tick, indexed by the time [s] at which it began; columns as in a
            recording, SI. `attrs["units"]` has their units, `attrs["digest"]` the configuration's.

        Raises:
            UserError: for a wrong quantity or input, or a state that is not finite.

        """
        tick = self.config.tick_ns * 1e-9
        courses = {"valve_current": current, **inputs}
        ticks = _ticks(courses, duration, tick)
        times = tick * np.arange(ticks, dtype=np.float64)
        driven = {n: _sampled(n, c, times) for n, c in courses.items()}
        # the same
        from hil_emulator.api.standalone import StandAlone

        alone = StandAlone(built_in(whole(self.config)))
        rows = np.empty((ticks, len(columns())))
        for i in range(ticks):
            alone.step(**{name: values[i] for name, values in driven.items()})
            rows[i] = alone.row()
        return recorded(rows, machine=self.name, digest=self.config.digest)

    def linearise(self, position: Quantity | None = None, current: Quantity = 0.0) -> "LinearModel":
        """Return the linear models around a position, at rest or in the motion of a current.

        Args:
            position: of the rod [m]; the configured start without one.
            current: valve current [A]; with 0 at rest.

        Raises:
            UserError: if there is no equilibrium.

        """
        # slow to import, and rarely used
        from hil_emulator.api.linear_model import linearised

        place = None if position is None else si("position", position, "m")
        return linearised(built_in(whole(self.config)), place, si("current", current, "A"))

    def with_effect(
        self, name: str, value: Quantity | None = None, *, channel: str = "", **shape: Quantity
    ) -> "ActuatorModel":
        """Return the actuator with an effect of the catalogue at a value.

        Args:
            name: of the effect.
            value: of its knob; the typical one without it.
            channel: of the sensor, for an effect of a sensor.
            shape: its other parameters.

        Raises:
            UserError: for an unknown effect or a wrong value.

        """
        effect = _effect(self.config.effects, name)
        if (effect.stage.table == "sensors") != bool(channel):
            raise UserError(
                f"{name}: is an effect of a sensor: name its channel, such as position"
                if not channel
                else f"{name}: is no effect of a sensor; leave the channel out"
            )
        knob = effect.knob
        span, of = (c.span, c.unit) if (c := _channel(channel)) else (1.0, "")
        typical = knob.typical * (span if SPAN in knob.unit else 1.0)
        settings = {knob.name: typical if value is None else value, **shape}
        units = {p.name: p.unit.replace(SPAN, of) for p in effect.params}
        pairs = ", ".join(f"{n} = {_written(v, units.get(n, '1'))}" for n, v in settings.items())
        table = ".".join(filter(None, (effect.stage.table, channel)))
        return self.with_layer(f"[{table}]\n{name} = {{ {pairs} }}\n", f"with_effect({name})")

    def with_layer(self, text: str, origin: str = "with_layer") -> "ActuatorModel":
        """Return the actuator with a layer of configuration, as TOML, laid over it.

        Raises:
            UserError: with every mistake in it; messages name `origin`.

        """
        old = self.config
        files = [*old.files, Path(origin)]
        new = load_texts(files, [*old.texts, text], lambda path, content: None)
        new = dataclasses.replace(new, nodes=old.nodes, supply_mates=old.supply_mates)
        return ActuatorModel(self.name, new)

    @property
    def effects(self) -> dict[str, str]:
        """The effects that are on, by name, each with the value of its knob."""
        places: list[tuple[str, Channel | None, Mapping[str, float]]] = [
            ("", None, self.config.plant)
        ]
        places += [(f"{c.name}.", c, self.config.sensors.get(c.name, {})) for c in CHANNELS]
        return {
            f"{place}{e.name}": _shown(e.knob, values[knob], channel)
            for place, channel, values in places
            for e in self.config.effects
            if is_on(e, values.get(knob := e.field_of(e.knob), e.off))
        }

    def __repr__(self) -> str:
        files = ", ".join(file.name for file in self.config.files)
        on = ", ".join(f"{name} {value}" for name, value in self.effects.items())
        return f"{self.name} ({files}; digest {self.config.digest})\neffects: {on or '-'}"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(n)}</td><td>{escape(v)}</td></tr>" for n, v in self.effects.items()
        )
        return f"<b>{escape(self.name)}</b><table><tr><th>effect<th>value</tr>{rows}</table>"


def load(*what: str | Path, actuator: str = "") -> ActuatorModel:
    """Return an actuator by its names or files, later ones over earlier ones.

    Args:
        what: names of the package, see `machines`, or paths of files (TOML).
        actuator: its name in a machine of several.

    Raises:
        UserError: for an unknown name, or with every mistake in the files.

    """
    if not what:
        raise UserError(f"name a machine of the package, {', '.join(machines())}, or a file")
    files = [found(str(w), *CONFIGURATIONS) for w in what]
    if len(files) > 1 or not has_actuators(files[0]):
        return ActuatorModel(files[0].stem, load_one(files))
    several = {a.name: a.config for a in load_machine(files).actuators}
    if actuator not in several:
        choices = " or ".join(f'actuator="{name}"' for name in several)
        raise UserError(f"{files[0]}: has several actuators; name one, {choices}")
    return ActuatorModel(actuator, several[actuator])


def machines() -> list[str]:
    """Return the names of the machines of the package."""
    return list(packaged(Purpose.MACHINE))


def _channel(name: str) -> Channel | None:
    """Return a sensor channel; None for no name.

    Raises:
        UserError: lists the channels that there are.

    """
    channels = {channel.name: channel for channel in CHANNELS}
    if name and name not in channels:
        raise UserError(f"no channel '{brief(name)}'{did_you_mean(name, channels)}")
    return channels.get(name)


def _effect(effects: Sequence[Effect], name: str) -> Effect:
    for effect in effects:
        if effect.name == name:
            return effect
    raise UserError(f"no effect '{brief(name)}'{did_you_mean(name, [e.name for e in effects])}")


def _shown(knob: Param, value: float, channel: Channel | None) -> str:
    """Return a knob's value as text; that of a sensor in the unit of its channel."""
    if channel is None or knob.unit != SPAN:
        return show(value, knob.unit, knob.shown)
    return show(value, channel.unit, channel.shown)


def _written(value: Quantity, unit: str) -> str:
    """Return a value as TOML; a plain number is in SI."""
    if isinstance(value, str):
        return f'"{value}"'
    return repr(float(value)) if unit == "1" else f'"{float(value)!r} {unit}"'


def si(name: str, value: Quantity, unit: str) -> float:
    """Return a quantity in a unit.

    Raises:
        UserError: if it has another dimension; names its purpose.

    """
    try:
        return to_si(value, unit) if isinstance(value, str) else float(value)
    except (TypeError, ValueError) as error:
        raise UserError(f"{name}: {error}") from None


def _ticks(courses: dict[str, Course], duration: Quantity | None, tick: float) -> int:
    if duration is not None:
        seconds = si("duration", duration, "s")
        if not 0.0 <= seconds < np.inf:
            raise UserError(f"duration: {duration} is no time to come")
        return round(seconds / tick)
    lengths = {np.size(c) for c in courses.values() if not callable(c) and np.ndim(c) == 1}
    if len(lengths) != 1:
        raise UserError(
            'duration is missing: give duration="1 s", or an array with a value per tick'
        )
    return lengths.pop()


def _sampled(name: str, course: Course, times: Matrix) -> Matrix:
    """Return the values of an input at the beginning of each tick, SI."""
    if name not in _UNITS:
        raise UserError(f"the plant has no input '{brief(name)}'{did_you_mean(name, _UNITS)}")
    if callable(course):
        return np.array([float(course(t)) for t in times.tolist()])
    if isinstance(course, str) or np.ndim(course) == 0:
        return np.full(len(times), si(name, course, _UNITS[name]))  # type: ignore[arg-type]
    values = np.asarray(course, float)
    if values.shape != times.shape:
        raise UserError(f"{name}: {values.shape} values for {len(times)} ticks")
    return values
