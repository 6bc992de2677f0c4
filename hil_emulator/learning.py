"""Environments of Gymnasium; the import registers them.

import gymnasium
import hil_emulator.learning

environment = gymnasium.make("hil_emulator/Knee-v0")

In one expression: `gymnasium.make("hil_emulator.learning:hil_emulator/Knee-v0")`.
"""

import gymnasium

from hil_emulator.api.environment import STEPS

gymnasium.register(
    "hil_emulator/Knee-v0", entry_point="hil_emulator.api.environment:Reaching",
    max_episode_steps=STEPS,
)  # fmt: skip
