"""The command line: arguments only; what each command does is in `hil_emulator.commands`."""
