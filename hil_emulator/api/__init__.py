"""The Python interface, `import hil_emulator as hil`, which the commands use too."""
