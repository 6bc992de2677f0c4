"""The plant's parameters, and their sound values behind those that faults have changed."""

from collections.abc import Collection, Mapping

from hil_emulator.errors import UserError
from hil_emulator.model.declare import is_on
from hil_emulator.model.effects.lines import shut_off_valves
from hil_emulator.model.plant import Plant

NEEDED = {"lines_closed": shut_off_valves}
"""Effects without which a parameter has nothing to act on."""


class PlantParameters:
    """The plant's parameters as faults leave them, and as they are without."""

    def __init__(self, plant: Plant) -> None:
        self._vector = plant.parameter_vector
        self._built_in = plant.supply.built_in
        self._index = {name: i for i, name in enumerate(plant.kernel.parameters.names or ())}
        self._sound: dict[str, float] = {}

    def sound(self, name: str) -> float:
        """Return the value a parameter has without faults."""
        return self._sound.get(name, float(self._vector[self._index[name]]))

    def require(self, name: str) -> None:
        """Make sure that a parameter acts on something.

        Raises:
            UserError: if the machine lacks what it acts on.

        """
        if not self._built_in:
            raise UserError(f"{name}: an FMU moves in place of the built-in plant that has it")
        effect = NEEDED.get(name)
        if effect is None:
            return
        index = self._index.get(effect.field_of(effect.knob))
        if index is None or not is_on(effect, float(self._vector[index])):
            raise UserError(
                f"{name}: the machine has no {effect.name}; give it some in the table "
                f"[{effect.stage.table}] of its configuration"
            )

    def set_sound(self, name: str, value: float) -> None:
        """Set the value a parameter has without faults.

        Raises:
            UserError: if the machine lacks what it acts on.

        """
        self.require(name)
        if name in self._sound:
            self._sound[name] = value
        else:
            self._vector[self._index[name]] = value

    def change(self, values: Mapping[str, float]) -> None:
        """Give parameters faulty values."""
        for name, value in values.items():
            self._sound.setdefault(name, float(self._vector[self._index[name]]))
            self._vector[self._index[name]] = value

    def restore(self, faulty: Collection[str]) -> None:
        """Give all parameters but the `faulty` ones their sound values again."""
        for name in [n for n in self._sound if n not in faulty]:
            self._vector[self._index[name]] = self._sound.pop(name)
