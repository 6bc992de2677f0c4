"""Settings of a running rig: its surroundings, and set points as a controller sends them."""

from collections.abc import Sequence

from hil_emulator.device.abort import SdoAbort
from hil_emulator.device.nmt import State
from hil_emulator.device.node import Node
from hil_emulator.errors import UserError
from hil_emulator.faults.plant_parameters import PlantParameters
from hil_emulator.model.plant import Plant
from hil_emulator.signals.inputs import COMMANDS


class Settings:
    """Applies settings.

    Args:
        plant: holds the inputs.
        nodes: hold the objects of set points.
        parameters: of the plant; a fault may hold a parameter.

    """

    def __init__(self, plant: Plant, nodes: Sequence[Node], parameters: PlantParameters) -> None:
        self._plant, self._nodes, self._parameters = plant, tuple(nodes), parameters

    def put(self, name: str, value: float) -> None:
        """Apply a setting [SI], or write a set point into the nodes.

        Raises:
            UserError: for a missing wall, or a value that a node refuses.

        """
        if name in COMMANDS:
            self._command(name, value)
        elif name == "wall_shift" and not self._plant.knows("wall_stiffness"):
            raise UserError('wall_shift: there is no wall to move; set [load] wall = "1e6 N/m"')
        elif name in (self._plant.kernel.inputs.names or ()):
            self._plant.command({name: value})
        else:
            self._parameters.set_sound(name, value)

    def waits(self, name: str) -> str:
        """Return the nodes that apply a set point only in OPERATIONAL; "" if all apply it now."""
        if name not in COMMANDS:
            return ""
        waiting = [
            n
            for n in self._nodes
            if n.state is not State.OPERATIONAL and n.dictionary.named(name) is not None
        ]
        states = ", ".join(f"node {n.node_id} is {n.state.name.replace('_', '-')}" for n in waiting)
        return f"{name} waits: {states}; an NMT start puts it in force" if waiting else ""

    def _command(self, name: str, value: float) -> None:
        """Write a set point into all nodes as an SDO client does; a refusal changes no node."""
        dictionaries = [node.dictionary for node in self._nodes]
        commanded = [(d, entry) for d in dictionaries if (entry := d.named(name)) is not None]
        try:
            for _, entry in commanded:
                entry.check(entry.digits(value))
            for dictionary, entry in commanded:
                dictionary.write(entry.index, entry.subindex, entry.digits(value))
        except SdoAbort as abort:
            raise UserError(f"{name}: {value:g} is refused: {abort}") from None
