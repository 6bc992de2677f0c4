"""The plant's parameters, and their sound values behind those that faults have changed."""

from collections.abc import Collection, Mapping

from hil_emulator.model.plant import Plant


class PlantParameters:
    """The plant's parameters as faults leave them, and as they are without."""

    def __init__(self, plant: Plant) -> None:
        self._vector = plant.parameter_vector
        self._index = {name: i for i, name in enumerate(plant.kernel.parameters.names or ())}
        self._sound: dict[str, float] = {}

    def sound(self, name: str) -> float:
        """Return the value a parameter has without faults."""
        return self._sound.get(name, float(self._vector[self._index[name]]))

    def set_sound(self, name: str, value: float) -> None:
        """Set the value a parameter has without faults."""
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
