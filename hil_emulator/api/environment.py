"""The knee as an environment of Gymnasium, for reinforcement learning."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hil_emulator.api.actuator import ActuatorModel, Quantity, load, si
from hil_emulator.api.standalone import StandAlone

Observation = NDArray[np.float32]

TICKS = 5
"""Ticks that an action lasts: 5 ms at 1 kHz (assumed: well below the valve's 250 Hz)."""

STEPS = 400
"""Actions of an episode: 2 s (assumed)."""

_REACH = 2.0
"""Largest observation as a share of its range; larger values are clipped (assumed)."""

_MIDDLE = (0.2, 0.8)
"""Shares of the stroke between which the target lies (assumed)."""


class Reaching(gymnasium.Env[Observation, NDArray[np.float32]]):
    """Move the rod of an actuator to a random position.

    An action is the valve current over the largest one. An observation is the readings over the
    machine's ranges: position and target over the stroke, both pressures over the supply pressure,
    load force over the force of the supply pressure on the piston. The reward of a step is minus
    the distance from the target over the stroke.

    Args:
        machine: the actuator; by default HyQ's knee.
        largest_current: the valve current of the action 1, SI or with its unit.

    """

    metadata = {"render_modes": []}  # noqa: RUF012  as Gymnasium declares it

    def __init__(
        self, machine: ActuatorModel | str = "hyq_knee", largest_current: Quantity = "10 mA"
    ) -> None:
        actuator = load(machine) if isinstance(machine, str) else machine
        self._config = actuator.config
        plant = actuator.config.plant
        self._stroke = plant["cylinder_stroke"]
        self._current = si("largest_current", largest_current, "A")
        supply = plant["supply_pressure"]
        force = supply * plant["cylinder_piston_area"]
        self._ranges = {
            "position": self._stroke, "pressure_a": supply, "pressure_b": supply,
            "load_force": force,
        }  # fmt: skip
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.observation_space = spaces.Box(-_REACH, _REACH, (len(self._ranges) + 1,), np.float32)
        self._target = 0.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin at rest; `options` may state the target as a share of the stroke."""
        super().reset(seed=seed)
        drawn = self.np_random.uniform(*_MIDDLE)
        self._target = float((options or {}).get("target", drawn)) * self._stroke
        self._alone = StandAlone(self._config, int(self.np_random.integers(2**31)))
        return self._observed(), {"target": self._target}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Apply an action for `TICKS` ticks."""
        current = float(np.clip(action[0], -1.0, 1.0)) * self._current
        for _ in range(TICKS):
            self._alone.step(valve_current=current)
        apart = abs(float(self._alone.plant.signals.position) - self._target)
        return self._observed(), -apart / self._stroke, False, False, {"target": self._target}

    def _observed(self) -> Observation:
        read = self._alone.readings
        shares = [read[name] / largest for name, largest in self._ranges.items()]
        observation = np.array([*shares, self._target / self._stroke], np.float32)
        return np.clip(observation, -_REACH, _REACH)
