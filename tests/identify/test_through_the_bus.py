"""From the bus to a name: an effect hidden in a running emulator, found in a stock logger's files.

The emulator runs in lock-step with an effect in its own configuration. A controller that sees
nothing but frames moves it through several experiments, and python-can's logger writes down what
passes. `identify` gets these files and the plain configuration, and nothing else.
"""

import json
import struct
from collections.abc import Sequence
from pathlib import Path

import can
import numpy as np
import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.config.load import load
from hil_emulator.simulation.emulator import Emulator
from tests.identify.rig_data import KNEE, reference

NODE = 5
PERIOD = 1e-3
GAIN, LIMIT = 0.45, 6e-3
"""Of the controller [A/m], [A]."""


class Station:
    """A controller and a logger on the emulator's bus.

    Args:
        emulator: at the other end of the bus.
        file: where the logger writes; the ending decides the format.

    """

    def __init__(self, emulator: Emulator, file: Path) -> None:
        self._emulator = emulator
        self._bus = can.Bus(**emulator.bus)
        self._logger = can.Logger(str(file))
        self.position = 0.0

    def send(self, can_id: int, data: bytes) -> None:
        """Send a frame, and let the logger see it."""
        message = can.Message(
            self._emulator.now, can_id, False, data=data, is_rx=False, channel=0
        )  # fmt: skip
        self._bus.send(message)
        self._logger(message)

    def listen(self) -> None:
        """Log what has come, and take the position out of TPDO2."""
        while (message := self._bus.recv(0)) is not None:
            message.timestamp, message.channel = self._emulator.now, 0
            self._logger(message)
            if message.arbitration_id == 0x280 + NODE:
                self.position = struct.unpack_from("<i", message.data)[0] * 1e-7

    def close(self) -> None:
        """Leave the bus and finish the file."""
        self._logger.stop()
        self._bus.shutdown()


def captured(files: Sequence[Path], file: Path, kind: str, duration: float) -> Path:
    """Move the emulated rod along a reference and capture the bus."""
    config = load(files)
    random = np.random.default_rng(config.seed)
    wanted = reference(kind, np.arange(round(duration / PERIOD)) * PERIOD, random)
    with Emulator(config) as emulator:
        station = Station(emulator, file)
        for _ in range(5):
            emulator.tick()
        station.send(0x000, bytes([1, NODE]))
        for target in wanted:
            emulator.tick()
            station.listen()
            current = np.clip(GAIN * (target - station.position), -LIMIT, LIMIT)
            station.send(0x200 + NODE, struct.pack("<i", round(current * 1e9)))
        emulator.tick()
        station.listen()
        station.close()
    return file


def examined(folder: Path, hidden: str, duration: float = 1.0) -> dict[str, object]:
    """Capture three experiments and a fourth to check, and return `identify`'s result."""
    layer = folder / "hidden.toml"
    files = []
    for seed, (kind, ending) in enumerate(
        [("multisine", ".blf"), ("steps", ".asc"), ("triangles", ".log"), ("steps", ".blf")], 1
    ):
        layer.write_text(f"[rig]\nseed = {seed}\n{hidden}")
        file = folder / f"{kind}_{seed}{ending}"
        files.append(str(captured([KNEE, layer], file, kind, duration)))
    done = CliRunner().invoke(
        main, ["identify", str(KNEE), *files[:3], "--validate", files[3], "--out", str(folder)]
    )
    assert done.exit_code == 0, done.output
    result: dict[str, object] = json.loads((folder / "result.json").read_text())
    return result


@pytest.mark.slow
def test_an_effect_in_the_emulator_is_named_from_captures(tmp_path: Path) -> None:
    """Leakage past the piston: one name out of the whole catalogue, its size within 5 %."""
    result = examined(tmp_path, '[cylinder]\ninternal_leakage = "1e-13 m^3/(s*Pa)"')
    assert result["verdict"] == "missing_effects"
    (effect,) = result["effects"]  # type: ignore[misc]
    assert effect["name"] == "internal_leakage"
    assert effect["value"] == pytest.approx(1e-13, rel=0.05)


@pytest.mark.full(sibling="test_an_effect_in_the_emulator_is_named_from_captures")
@pytest.mark.parametrize(
    ("hidden", "name", "value"),
    [
        ('[valve]\ntransport_delay = "1.5 ms"', "transport_delay", 1.5e-3),
        ('[friction]\nstribeck_friction = "60 N"', "stribeck_friction", 60.0),
        ('[sensors.pressure_a]\noffset = "3 bar"', "pressure_a.offset", 3e5),
    ],
)
def test_delays_friction_and_sensors_are_named_too(
    tmp_path: Path, hidden: str, name: str, value: float
) -> None:
    """Even a delay of one and a half samples: the reader keeps the order of the loop."""
    result = examined(tmp_path, hidden, 2.0)
    values = {e["name"]: e["value"] for e in result["effects"]}  # type: ignore[attr-defined]
    assert values[name] == pytest.approx(value, rel=0.1)


@pytest.mark.full(sibling="test_an_effect_in_the_emulator_is_named_from_captures")
def test_an_emulator_that_is_as_configured_lacks_nothing(tmp_path: Path) -> None:
    """Quantisation, transport and the timing of PDOs are no effects."""
    assert examined(tmp_path, "", 2.0)["verdict"] == "nothing_missing"
