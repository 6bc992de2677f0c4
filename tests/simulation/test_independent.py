"""Independent actuators and their assignment to processes."""

from pathlib import Path

import pytest

from hil_emulator.config.machine import MachineSettings, load_machine
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.independent import parts

KNEE = shipped("configs/hyq_knee.toml")
SUPPLY = shipped("configs/hyq_supply.toml")


def machine(folder: Path, actuators: str) -> MachineSettings:
    """Return a machine from text such as "a:1 b:1 c:2@p": name, bus and supply of each actuator."""
    lines, buses, supplies = [], set(), set()
    for i, word in enumerate(actuators.split()):
        place, _, supply = word.partition("@")
        name, _, bus = place.partition(":")
        buses.add(bus)
        lines += ["[[actuator]]", f'name = "{name}"', f'files = ["{KNEE}"]', f'bus = "{bus}"']
        lines.append(f"node_offset = {i}")
        if supply:
            supplies.add(supply)
            lines.append(f'supply = "{supply}"')
    head = [f'[buses.{b}]\ninterface = "virtual"\nchannel = "{b}"' for b in sorted(buses)]
    head += [f'[supplies.{s}]\nfiles = ["{SUPPLY}"]' for s in sorted(supplies)]
    file = folder / "machine.toml"
    file.write_text("\n".join([*head, *lines]))
    return load_machine([file])


@pytest.mark.parametrize(
    ("actuators", "processes", "divided"),
    [
        ("a:1 b:2 c:3", 3, ["a", "b", "c"]),
        ("a:1 b:2 c:3 d:4", 2, ["ac", "bd"]),
        ("a:1 b:2 c:3", 1, ["abc"]),
        ("a:1 b:2", 5, ["a", "b"]),
        ("a:1 b:1 c:2", 3, ["ab", "c"]),
        ("a:1@p b:2@p c:3", 3, ["ab", "c"]),
        ("a:1@p b:2@p c:2 d:3", 4, ["abc", "d"]),
        ("a:1 b:2 c:1 d:2@p e:3@p f:4", 2, ["acf", "bde"]),
    ],
)
def test_actuators_with_a_common_bus_or_supply_stay_together(
    actuators: str, processes: int, divided: list[str], tmp_path: Path
) -> None:
    """The others are assigned evenly, and each part has only its buses."""
    settings = machine(tmp_path, actuators)
    groups = parts(settings, processes)
    assert ["".join(a.name for a in part.actuators) for part in groups] == divided
    for part in groups:
        assert set(part.buses) == set(part.wires) == {a.bus for a in part.actuators}
