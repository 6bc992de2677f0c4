"""A controller against the emulator, through CAN frames, in lock-step: the main job in seconds."""
