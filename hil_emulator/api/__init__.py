"""The package from Python: what `import hil_emulator as hil` offers, and the commands stand on."""
