"""A machine whose actuators are the joints of a leg."""

from collections.abc import Callable
from pathlib import Path

import pytest

from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import load
from hil_emulator.config.machine import load_machine
from hil_emulator.errors import UserError
from hil_emulator.platform.paths import cache_folder, shipped
from hil_emulator.simulation.machine import assemble_machine

CONFIGS = shipped("configs/hyq_leg.toml").parent
LEG = shipped("configs/hyq_leg.toml").read_text().replace('"hyq_', f'"{CONFIGS}/hyq_')
HIP, KNEE = ("[[actuator]]" + part for part in LEG.split("[[actuator]]")[1:])

Write = Callable[[str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a function that writes a machine's file."""

    def write(text: str) -> Path:
        file = tmp_path / "leg.toml"
        file.write_text(text)
        return file

    return write


def hips_way(file: Path) -> float:
    """Apply a force to the lower leg with the hip's valve closed; return the hip's motion [m]."""
    settings = load_machine([file])
    buses = {n: Bus({"interface": "virtual", "channel": f"leg {n}"}) for n in settings.buses}
    rigs = assemble_machine(settings, buses, cache_folder()).rigs
    rigs["hip"].plant.step(10_000)
    begin, distances = float(rigs["hip"].plant.signals.position), []
    rigs["knee"].plant.inputs.valve_current = 8e-3
    for _ in range(30):
        rigs["hip"].integrate()
        distances.append(abs(float(rigs["hip"].plant.signals.position) - begin))
    for bus in buses.values():
        bus.close()
    return max(distances)


@pytest.mark.slow
def test_a_kick_of_the_lower_leg_shakes_the_upper_one(write: Write) -> None:
    """The reaction compresses the hip's oil, for any order in the file; without coupling hardly."""
    head = LEG.partition("[[actuator]]")[0]
    coupled = hips_way(write(LEG))
    assert coupled > 1e-4
    assert hips_way(write(head + KNEE + "\n" + HIP)) == pytest.approx(coupled, rel=1e-9)
    apart = LEG.replace('carries = "knee"', "")
    assert hips_way(write(apart)) < 0.2 * coupled


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('carries = "knee"', 'carries = "foot"', "carries 'foot'; there are: hip, knee"),
        ('carries = "knee"', 'carries = "hip"', "a leg has two joints"),
        ('supply = "pump"\ncarries', "carries", "give both the same supply"),
        ("hyq_lower_leg", "hyq_hip", r"\[load.rotary_joint\] is wanted in the files of both"),
        ("hyq_upper_leg", "hyq_lower_leg", "here with link_length"),
    ],
)
def test_an_invalid_leg_is_refused(write: Write, old: str, new: str, message: str) -> None:
    """The message has the mistake, its place and the remedy."""
    assert old in LEG
    with pytest.raises(UserError, match=message):
        load_machine([write(LEG.replace(old, new))])


def test_a_link_is_not_lighter_than_what_it_carries(write: Write, tmp_path: Path) -> None:
    """An inertia without the lower leg's mass is refused: the mass matrix would be indefinite."""
    (tmp_path / "light.toml").write_text('[load.rotary_joint]\ninertia = "0.05 kg*m^2"')
    text = LEG.replace('/hyq_upper_leg.toml"', '/hyq_upper_leg.toml", "light.toml"')
    with pytest.raises(UserError, match=r"lacks the mass of what it carries: add the mass of knee"):
        load_machine([write(text)])


@pytest.mark.parametrize("text", [LEG, "actuator = 1", "actuator = []", "[actuator]"])
def test_a_command_for_one_actuator_names_the_files_of_one(write: Write, text: str) -> None:
    """A machine of several actuators is refused; the message names the files of one actuator."""
    with pytest.raises(UserError, match=r"takes one: name its files, such as .*knee\.toml"):
        load([write(text)])
